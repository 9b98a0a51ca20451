#include "sim/step/state_hashes.h"

#include <algorithm>

#include "sim/base/hash.h"
#include "sim/step/world.h"

namespace duet {
namespace {

// Fills a list of quantities from its beginning, and drops what is left over at the end. Entries keep their
// storage.
class Writer {
 public:
  explicit Writer(std::vector<QuantityHashes>& out) : out_(out) {}
  ~Writer() { out_.resize(used_); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

  // Starts the next quantity, and returns its empty list of hashes.
  std::vector<std::uint64_t>& begin(std::string_view name, Owner owner) {
    if (used_ == out_.size()) out_.emplace_back();
    QuantityHashes& quantity = out_[used_++];
    quantity.name = name;
    quantity.owner = owner;
    quantity.hashes.clear();
    return quantity.hashes;
  }

 private:
  std::vector<QuantityHashes>& out_;
  std::size_t used_ = 0;
};

std::uint64_t hash_values(const Vec3* values, std::size_t count) {
  return hash_bytes(values, count * sizeof(Vec3));
}

std::uint64_t add_value(std::uint64_t hash, double value) { return hash_bytes(&value, sizeof value, hash); }
std::uint64_t add_value(std::uint64_t hash, int value) { return hash_bytes(&value, sizeof value, hash); }
std::uint64_t add_value(std::uint64_t hash, const FeatureId& value) {
  return add_value(add_value(add_value(hash, static_cast<int>(value.kind)), value.index), value.sub);
}
std::uint64_t add_value(std::uint64_t hash, const Vec3& value) {
  return hash_bytes(value.data(), sizeof value, hash);
}

// Adds a quantity with the hash of(i) for every rigid body i.
template <class Of>
void add_rigid(Writer& writer, const RigidBodies& rigid, std::string_view name, Of&& of) {
  std::vector<std::uint64_t>& hashes = writer.begin(name, Owner::rigid);
  for (std::size_t i = 0; i < rigid.size(); ++i) hashes.push_back(of(i));
}

// Adds a quantity with a hash of the `values` of each deformable body's particles.
void add_particles(Writer& writer, const Bodies& bodies, std::string_view name,
                   const std::vector<Vec3>& values) {
  std::vector<std::uint64_t>& hashes = writer.begin(name, Owner::deformable);
  for (const DeformableBody& body : bodies.deformable)
    hashes.push_back(
        hash_values(values.data() + body.first_particle, static_cast<std::size_t>(body.particle_count)));
}

// Adds the quantities of hash_state().
void add_state(Writer& writer, const World& world) {
  const RigidBodies& rigid = world.bodies.rigid;
  add_rigid(writer, rigid, "position",
            [&](std::size_t i) { return hash_values(&rigid.state[i].pose.position, 1); });
  add_rigid(writer, rigid, "orientation", [&](std::size_t i) {
    return hash_bytes(rigid.state[i].pose.orientation.coeffs().data(), 4 * sizeof(double));
  });
  add_rigid(writer, rigid, "velocity",
            [&](std::size_t i) { return hash_values(&rigid.state[i].velocity, 1); });
  add_rigid(writer, rigid, "angular momentum", [&](std::size_t i) {
    return hash_values(&rotation_variable(rigid.state[i], rigid.properties[i]), 1);
  });
  add_particles(writer, world.bodies, "positions", world.bodies.particles.x);
  add_particles(writer, world.bodies, "velocities", world.bodies.particles.v);

  const auto add_scene = [&](std::string_view name, std::uint64_t hash) {
    writer.begin(name, Owner::scene).push_back(hash);
  };
  add_scene("frequency bound", add_value(hash_seed, world.bodies.forces.max_omega_squared()));
  const GeneralizedVelocity& acceleration = world.last_step.acceleration;
  add_scene("particle accelerations",
            hash_values(acceleration.particle.data(), acceleration.particle.size()));
  add_scene("linear accelerations", hash_values(acceleration.linear.data(), acceleration.linear.size()));
  add_scene("angular accelerations", hash_values(acceleration.angular.data(), acceleration.angular.size()));
  const std::vector<Vec3>& friction = world.last_step.surface_friction;
  const auto acts = [](const Vec3& force) { return !force.isZero(0); };
  if (std::any_of(friction.begin(), friction.end(), acts))  // else as without surfaces that touch
    add_scene("friction between surfaces", hash_values(friction.data(), friction.size()));
  const RigidForces& drive = world.last_step.joint_drive;
  if (std::any_of(drive.linear.begin(), drive.linear.end(), acts) ||
      std::any_of(drive.angular.begin(), drive.angular.end(), acts)) {
    add_scene("forces of joints", hash_values(drive.linear.data(), drive.linear.size()));
    add_scene("moments of joints", hash_values(drive.angular.data(), drive.angular.size()));
  }
  const std::vector<double>& pressure = world.last_step.pressure;
  if (!pressure.empty())
    add_scene("pressures", hash_bytes(pressure.data(), pressure.size() * sizeof(double)));
  const PairForces& pairs = world.last_step.pair_forces;
  if (!pairs.empty())
    add_scene("forces between surfaces", hash_bytes(pairs.data(), pairs.size() * sizeof(PairForce)));
  const ContactCache& cache = world.last_step.contact_cache;
  add_scene("contact cache", hash_bytes(cache.data(), cache.size() * sizeof(CachedContact)));
}

// Adds a quantity with a hash per body of the contacts in which it is the guest; add(hash, contact) extends a
// hash.
template <class Add>
void add_contacts(Writer& writer, const World& world, bool has_contacts, std::string_view name, Add&& add) {
  const Bodies& bodies = world.bodies;
  std::vector<std::uint64_t>& hashes = writer.begin(name, Owner::body);
  hashes.assign(bodies.rigid.size() + bodies.deformable.size(), hash_seed);
  if (!has_contacts) return;
  const ContactSet& contacts = world.context.contact.contacts;
  for (const ContactPair& pair : contacts.pairs) {
    std::uint64_t& hash = hashes[guest_node(bodies, pair)];
    for (int i = pair.begin; i < pair.end; ++i)
      hash = add(hash, contacts.points[static_cast<std::size_t>(i)]);
  }
}

}  // namespace

void hash_state(const World& world, std::vector<QuantityHashes>& out) {
  Writer writer(out);
  add_state(writer, world);
}

void hash_step(const World& world, bool has_contacts, std::vector<QuantityHashes>& out) {
  Writer writer(out);
  writer.begin("time step", Owner::scene)
      .push_back(add_value(add_value(hash_seed, world.context.time), world.context.dt));
  add_state(writer, world);
  add_contacts(writer, world, has_contacts, "contacts", [](std::uint64_t hash, const ContactPoint& contact) {
    hash = add_value(add_value(hash, contact.host), contact.feature);
    hash = add_value(add_value(hash, contact.normal), contact.gap);
    return add_value(add_value(hash, contact.host_arm), contact.guest_arm);
  });
  add_contacts(writer, world, has_contacts, "contact impulses",
               [](std::uint64_t hash, const ContactPoint& contact) {
                 return add_value(add_value(hash, contact.impulse), contact.target);
               });
}

std::vector<BodyHashes> state_hashes(const World& world) {
  std::vector<QuantityHashes> quantities;
  hash_state(world, quantities);
  std::vector<BodyHashes> result;
  const auto add = [&](Owner owner, const std::string& name, std::size_t index) {
    BodyHashes& body = result.emplace_back(BodyHashes{owner, name, {}});
    for (const QuantityHashes& quantity : quantities)
      if (quantity.owner == owner) body.quantities.push_back({quantity.name, quantity.hashes[index]});
  };
  const Bodies& bodies = world.bodies;
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) add(Owner::rigid, bodies.rigid.name[i], i);
  for (std::size_t i = 0; i < bodies.deformable.size(); ++i)
    add(Owner::deformable, bodies.deformable[i].name, i);
  add(Owner::scene, {}, 0);
  return result;
}

}  // namespace duet
