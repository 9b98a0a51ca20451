#include "sim/simulation/saved_state.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <tuple>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/index.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/contact/detection/shape_support_point.h"

namespace duet {
namespace {

// Calls visit(pointer, bytes) for every number that the next step reads, in a fixed order, but for the lists
// whose length differs from state to state. These follow at the end of a saved state: the forces of pairs of
// surfaces after their number, and the cached contacts.
template <class Visit>
void visit_state(World& world, std::int64_t& frame, double& omega_squared, Visit&& visit) {
  visit(&frame, sizeof frame);
  visit(&omega_squared, sizeof omega_squared);
  Particles& particles = world.bodies.particles;
  visit(particles.x.data(), particles.x.size() * sizeof(Vec3));
  visit(particles.v.data(), particles.v.size() * sizeof(Vec3));
  RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    RigidState& state = rigid.state[i];
    visit(&state.pose.position, sizeof(Vec3));
    visit(state.pose.orientation.coeffs().data(), 4 * sizeof(double));
    visit(&state.velocity, sizeof(Vec3));
    visit(&rotation_variable(state, rigid.properties[i]), sizeof(Vec3));
  }
  GeneralizedVelocity& acceleration = world.last_step.acceleration;
  for (std::vector<Vec3>* values : {&acceleration.particle, &acceleration.linear, &acceleration.angular})
    visit(values->data(), values->size() * sizeof(Vec3));
  std::vector<Vec3>& friction = world.last_step.surface_friction;
  visit(friction.data(), friction.size() * sizeof(Vec3));
  RigidForces& drive = world.last_step.joint_drive;
  for (std::vector<Vec3>* values : {&drive.linear, &drive.angular})
    visit(values->data(), values->size() * sizeof(Vec3));
  for (std::vector<double>* values : {&world.last_step.control_angle, &world.last_step.pressure})
    visit(values->data(), values->size() * sizeof(double));
}

// Largest magnitude of a loaded number, in its SI unit. The step computes fourth powers of positions,
// velocities and forces, which must stay below the largest double, 1.8e308.
constexpr double largest = 1e60;
// Largest error of unit vectors and weights, and of the poses of bodies that never move (relative beyond 1
// m).
constexpr double rounding = 1e-6;

template <class... Values>
[[noreturn]] void refuse(fmt::format_string<Values...> what, Values&&... values) {
  throw Error(ExitStatus::files, "the saved state does not fit this scene: " +
                                     fmt::format(what, std::forward<Values>(values)...));
}

// Returns whether the value is a number of at most `largest` in magnitude; false for NaN.
bool is_sound(double value) { return std::abs(value) <= largest; }
bool is_sound(const Vec3& value) { return is_sound(value.x()) && is_sound(value.y()) && is_sound(value.z()); }

template <class Value>
void check_all(std::span<const Value> values, const std::string& body, const char* quantity) {
  const auto found =
      std::find_if_not(values.begin(), values.end(), [](const Value& v) { return is_sound(v); });
  if (found != values.end())
    refuse("{} {} of {} is not finite or above {:g}", quantity, found - values.begin(), body, largest);
}

void check_particles(const World& world) {
  const Particles& particles = world.bodies.particles;
  for (const DeformableBody& body : world.bodies.deformable) {
    const auto of_body = [&](const std::vector<Vec3>& values) {
      return std::span(values).subspan(as_index(body.first_particle), as_index(body.particle_count));
    };
    check_all(of_body(particles.x), '`' + body.name + '`', "position");
    check_all(of_body(particles.v), '`' + body.name + '`', "velocity");
  }
}

void check_rigid(const RigidBodies& rigid, const std::vector<RigidState>& built) {
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    const RigidState& state = rigid.state[i];
    const Pose &pose = state.pose, &before = built[i].pose;
    if (!is_sound(pose.position) || !is_sound(state.velocity) ||
        !is_sound(rotation_variable(state, rigid.properties[i])))
      refuse("the place or velocity of `{}` is not finite or above {:g}", rigid.name[i], largest);
    if (!(std::abs(pose.orientation.norm() - 1) <= rounding))
      refuse("the orientation of `{}` is no rotation", rigid.name[i]);
    if (rigid.properties[i].moves()) continue;
    const double allowed = rounding * (1 + before.position.norm());
    if (!((pose.position - before.position).norm() <= allowed) ||
        !((pose.orientation.coeffs() - before.orientation.coeffs()).norm() <= rounding))
      refuse("`{}`, which never moves, stands elsewhere", rigid.name[i]);
  }
}

// Checks the number of a feature of a cached contact, of which there are `count`. `number` is the index of
// the contact, for messages.
void check_index(int index, std::size_t count, const char* feature, std::size_t number) {
  if (index < 0 || as_index(index) >= count)
    refuse("contact {} is of {} {}, and there are {}", number, feature, index, count);
}

// Checks that a cached contact has a plane of its own if its feature asks for one, and none if not.
void check_plane(const CachedContact& contact, bool has_plane, std::size_t number) {
  if (contact.edge.normal.isZero(0) == has_plane)
    refuse("contact {} {} plane of its own", number, has_plane ? "lacks the" : "has a");
}

// Checks the feature of a deformable guest that a cached contact names.
void check_soft_guest(const Bodies& bodies, const CachedContact& contact, std::size_t number) {
  const FeatureId& feature = contact.feature;
  check_plane(contact, feature.kind != FeatureId::Kind::point, number);
  switch (feature.kind) {
    case FeatureId::Kind::point:
      return check_index(feature.index, bodies.points.size(), "surface point", number);
    case FeatureId::Kind::edge:
      return check_index(feature.index, bodies.edges.size(), "edge", number);
    case FeatureId::Kind::in_face: {
      check_index(feature.sub, bodies.deformable.size(), "deformable body", number);
      const std::ptrdiff_t face = contact.edge.face;
      if (face < 0 || as_index(face) >= bodies.triangles.size())
        refuse("contact {} is of face {}, and there are {}", number, face, bodies.triangles.size());
      return;
    }
    default:
      refuse("contact {} has no place on a deformable body", number);
  }
}

// Checks the feature of a rigid guest that a cached contact names.
void check_rigid_guest(const RigidProperties& guest, const CachedContact& contact, std::size_t number) {
  const FeatureId& feature = contact.feature;
  if (!feature.is_support()) check_plane(contact, feature.uses_edge_point(), number);
  switch (feature.kind) {
    case FeatureId::Kind::support:
      return check_index(feature.index, as_index(support_numbers(guest.shape)), "support point", number);
    case FeatureId::Kind::point:
    case FeatureId::Kind::point_on_plane:
      return check_index(feature.index, guest.samples.size(), "sample", number);
    case FeatureId::Kind::round:
      check_index(feature.index, guest.on_round.size(), "patch", number);
      if (guest.on_round[as_index(feature.index)].patch < 0)
        refuse("contact {} is of patch {}, which does not exist", number, feature.index);
      return;
    case FeatureId::Kind::vertex:
      return check_index(feature.index, guest.round ? guest.round->vertices.size() : 0, "vertex", number);
    case FeatureId::Kind::edge:
      return check_index(feature.index,
                         is_swept_by_ball(guest.shape)
                             ? std::max(guest.feature_edges.nodes.size(), std::size_t{ring_numbers})
                             : guest.feature_edges.nodes.size(),
                         "node", number);
    default:
      refuse("contact {} has no place on a rigid body", number);
  }
}

// Checks the edge contact of a cached contact.
void check_lowest(const EdgePoint& lowest, std::size_t number) {
  for (const Vec3* vector : {&lowest.place, &lowest.normal, &lowest.foot})
    if (!is_sound(*vector)) refuse("contact {} has a place that is not finite", number);
  if (!lowest.normal.isZero(0) && !(std::abs(lowest.normal.norm() - 1) <= rounding))
    refuse("contact {} has a normal that is no unit vector", number);
  if (!is_sound(lowest.radius) || lowest.radius < 0) refuse("contact {} has a negative radius", number);
  for (const double weight : lowest.weight)
    if (!(weight >= -rounding && weight <= 1 + rounding))
      refuse("contact {} has a weight outside 0 to 1", number);
}

void check_contact(const Bodies& bodies, const CachedContact& contact, std::size_t number) {
  const RigidBodies& rigid = bodies.rigid;
  if (contact.host < 0 || as_index(contact.host) >= rigid.size())
    refuse("contact {} is with rigid body {}, and there are {}", number, contact.host, rigid.size());
  if (contact.guest_rigid < -1 || contact.guest_rigid == contact.host ||
      contact.guest_rigid >= static_cast<int>(rigid.size()))
    refuse("contact {} is of rigid body {} with {}, and there are {}", number, contact.guest_rigid,
           contact.host, rigid.size());
  if (!is_sound(contact.impulse)) refuse("contact {} has an impulse that is not finite", number);
  if (!(contact.duration > 0 && is_sound(contact.duration)) || contact.unused != 0)
    refuse("contact {} acted for no time", number);
  check_lowest(contact.edge, number);
  if (contact.guest_rigid < 0) return check_soft_guest(bodies, contact, number);
  check_rigid_guest(rigid.properties[as_index(contact.guest_rigid)], contact, number);
}

// Checks the forces of pairs of deformable surfaces.
void check_pairs(const Bodies& bodies, const PairForces& pairs) {
  for (const PairForce& pair : pairs) {
    for (const int p : pair.particle)
      if (p < 0 || as_index(p) >= bodies.particles.size())
        refuse("a pair of surfaces has particle {}, and there are {}", p, bodies.particles.size());
    if (!is_sound(pair.force)) refuse("a force between surfaces is not finite or above {:g}", largest);
  }
  if (!std::is_sorted(pairs.begin(), pairs.end(),
                      [](const PairForce& a, const PairForce& b) { return a.particle < b.particle; }))
    refuse("its pairs of surfaces are not in order");
}

// Returns the numbers that name a contact and by which contacts are sorted.
auto name_of(const CachedContact& contact) {
  return std::tie(contact.host, contact.guest_rigid, contact.feature);
}

}  // namespace

void pack_state(World& world, std::int64_t frame, std::vector<unsigned char>& bytes) {
  double frequency = world.bodies.forces.max_omega_squared();
  const PairForces& pairs = world.last_step.pair_forces;
  const ContactCache& cache = world.last_step.contact_cache;
  const std::uint64_t pair_count = pairs.size();
  std::size_t size =
      sizeof pair_count + pairs.size() * sizeof(PairForce) + cache.size() * sizeof(CachedContact);
  visit_state(world, frame, frequency, [&](const void*, std::size_t more) { size += more; });
  bytes.resize(size);
  std::size_t at = 0;
  const auto append = [&](const void* data, std::size_t more) {
    if (more > 0) std::memcpy(bytes.data() + at, data, more);  // without particles, `data` is null
    at += more;
  };
  visit_state(world, frame, frequency, append);
  append(&pair_count, sizeof pair_count);
  append(pairs.data(), pairs.size() * sizeof(PairForce));
  append(cache.data(), cache.size() * sizeof(CachedContact));
}

void unpack_state(const std::vector<unsigned char>& bytes, World& world, std::int64_t& frame) {
  double frequency = 0;
  std::uint64_t pair_count = 0;
  std::size_t needed = sizeof pair_count, at = 0;
  visit_state(world, frame, frequency, [&](const void*, std::size_t size) { needed += size; });
  const auto check_size = [&] {
    if (bytes.size() < needed)
      refuse("it has {} bytes where {} and whole contacts are needed", bytes.size(), needed);
  };
  const auto take = [&](void* data, std::size_t size) {
    if (size > 0) std::memcpy(data, bytes.data() + at, size);  // without particles, `data` is null
    at += size;
  };
  check_size();
  visit_state(world, frame, frequency, take);
  take(&pair_count, sizeof pair_count);
  if (pair_count > bytes.size() / sizeof(PairForce))
    refuse("it has {} bytes and forces of {} pairs of surfaces", bytes.size(), pair_count);
  needed += pair_count * sizeof(PairForce);
  check_size();
  if ((bytes.size() - needed) % sizeof(CachedContact) != 0)
    refuse("it has {} bytes where {} and whole contacts are needed", bytes.size(), needed);
  PairForces& pairs = world.last_step.pair_forces;
  pairs.resize(pair_count);
  for (PairForce& pair : pairs) take(&pair, sizeof pair);
  // The cached contacts follow, as many as there were when the state was saved.
  ContactCache& cache = world.last_step.contact_cache;
  cache.resize((bytes.size() - needed) / sizeof(CachedContact));
  for (CachedContact& contact : cache) take(&contact, sizeof contact);
  world.bodies.forces.set_max_omega_squared(frequency);
  RigidBodies& rigid = world.bodies.rigid;
  for (std::size_t i = 0; i < rigid.size(); ++i)
    update_orientation_dependents(rigid.state[i], rigid.properties[i]);
}

void check_state(const World& loaded, std::int64_t frame, const std::vector<RigidState>& built) {
  const Bodies& bodies = loaded.bodies;
  if (frame < 0 || frame >= std::numeric_limits<int>::max()) refuse("it is of frame {}", frame);
  const double frequency = bodies.forces.max_omega_squared();
  if (!(frequency >= 0 && is_sound(frequency))) refuse("its bound on frequencies is not finite");
  check_particles(loaded);
  check_rigid(bodies.rigid, built);
  const GeneralizedVelocity& acceleration = loaded.last_step.acceleration;
  for (const std::vector<Vec3>* values :
       {&acceleration.particle, &acceleration.linear, &acceleration.angular})
    check_all(std::span(*values), "the last solve", "acceleration");
  check_all(std::span(loaded.last_step.surface_friction), "the last step", "friction between surfaces");
  const RigidForces& drive = loaded.last_step.joint_drive;
  for (const std::vector<Vec3>* values : {&drive.linear, &drive.angular})
    check_all(std::span(*values), "the last step", "force of joints");
  check_all(std::span<const double>(loaded.last_step.control_angle), "the joints", "angle");
  check_all(std::span<const double>(loaded.last_step.pressure), "the last solve", "pressure");
  check_pairs(bodies, loaded.last_step.pair_forces);
  const ContactCache& cache = loaded.last_step.contact_cache;
  for (std::size_t i = 0; i < cache.size(); ++i) check_contact(bodies, cache[i], i);
  if (!std::is_sorted(cache.begin(), cache.end(),
                      [](const CachedContact& a, const CachedContact& b) { return name_of(a) < name_of(b); }))
    refuse("its contacts are not in order");
}

}  // namespace duet
