#include "sim/simulation/contact_output.h"

#include <algorithm>
#include <variant>

#include <Eigen/Geometry>

namespace duet {
namespace {

// Impulses on the particles of one body, in N s.
struct Impulse {
  Vec3 total = Vec3::Zero(), without_normal = Vec3::Zero();
  double normal = 0;

  void add(double weight, const Impulse& other) {
    total += weight * other.total;
    without_normal += weight * other.without_normal;
    normal += weight * other.normal;
  }
};

// The part of a surface around each of its positions: its area, and its area vector, m^2.
struct Patches {
  std::vector<double> area;
  std::vector<Vec3> vector;

  explicit Patches(const Surface& surface)
      : area(surface.positions.size(), 0), vector(surface.positions.size(), Vec3::Zero()) {
    for (const auto& triangle : surface.triangles) {
      const auto at = [&](std::size_t k) { return surface.positions[as_index(triangle[k].position)]; };
      const Vec3 third = (at(1) - at(0)).cross(at(2) - at(0)) / 6;
      for (const Corner& corner : triangle) {
        area[as_index(corner.position)] += third.norm();
        vector[as_index(corner.position)] += third;
      }
    }
  }

  // Returns the unit outward normal at a position; zero if the triangles around it have none.
  Vec3 normal(std::size_t i) const { return vector[i].stableNormalized(); }
};

// A particle that moves a position of a surface, by its index in the world, with its weight.
struct Carrier {
  std::size_t particle;
  double weight;
};

// Calls work(position, carrier) for the particles that move each position of the surface of a skin or a thin
// body, in the order of the positions. Negative weights are left out.
template <class Work>
void for_each_carrier(const scene::BodyShape& shape, Work&& work) {
  if (shape.thin) {
    std::visit(
        [&](const auto& thick) {
          for (std::size_t i = 0; i < shape.surface.surface.positions.size(); ++i)
            work(i, Carrier{shape.thin->first_particle + thick.node(i), 1});
        },
        shape.thin->surface);
    return;
  }
  const std::vector<CarriedSurface::Carrier>& carriers = shape.skin.carriers();
  for (std::size_t i = 0; i < carriers.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      if (carriers[i].weights[k] > 0)
        work(i, Carrier{shape.first_particle + as_index(carriers[i].nodes[k]), carriers[i].weights[k]});
}

// Divides the impulses of particles among the positions of a surface that has other vertices than these.
class Division {
 public:
  Division(const ContactImpulses& from, const Patches& patches, const scene::BodyShape& shape)
      : from_(from), patches_(patches), sums_(from.total.size(), Sums()) {
    for_each_carrier(shape, [&](std::size_t i, const Carrier& carrier) {
      Sums& sums = sums_[carrier.particle];
      sums.facing += facing(i, carrier);
      sums.area += carrier.weight * patches_.area[i];
      sums.weight += carrier.weight;
    });
  }

  // Returns whether a particle moves a position.
  bool has(std::size_t particle) const { return sums_[particle].weight > 0; }
  // Returns the fraction of a particle's impulse that a position gets.
  double fraction(std::size_t i, const Carrier& carrier) const {
    const Sums& sums = sums_[carrier.particle];
    if (sums.facing > 0) return facing(i, carrier) / sums.facing;
    if (sums.area > 0) return carrier.weight * patches_.area[i] / sums.area;
    return carrier.weight / sums.weight;
  }

 private:
  // Sums over the positions that a particle moves.
  struct Sums {
    double facing = 0, area = 0, weight = 0;
  };
  // Returns the part of a position that is turned against the impulse of a particle, times its weight.
  double facing(std::size_t i, const Carrier& carrier) const {
    return carrier.weight * std::max(0.0, -patches_.vector[i].dot(from_.total[carrier.particle]));
  }

  const ContactImpulses& from_;
  const Patches& patches_;
  std::vector<Sums> sums_;
};

// Returns the index of the position that is nearest to `x`.
std::size_t nearest(const std::vector<Vec3>& positions, const Vec3& x) {
  std::size_t best = 0;
  for (std::size_t i = 1; i < positions.size(); ++i)
    if ((positions[i] - x).squaredNorm() < (positions[best] - x).squaredNorm()) best = i;
  return best;
}

// Returns the impulse on each position of the present `surface` of a body.
std::vector<Impulse> on_surface(const Bodies& bodies, const ContactImpulses& from, const Patches& patches,
                                const scene::BodyShape& shape, const DeformableBody& body,
                                const Surface& surface) {
  std::vector<Impulse> impulses(surface.positions.size());
  const auto of = [&](std::size_t p) {
    return Impulse{from.total[p], from.without_normal[p], from.normal[p]};
  };
  if (!shape.thin && shape.skin.empty()) {
    for (std::size_t i = 0; i < impulses.size(); ++i)
      impulses[i] = of(as_index(shape.surface.vertex_nodes[i]));
    return impulses;
  }
  const Division division(from, patches, shape);
  for_each_carrier(shape, [&](std::size_t i, const Carrier& carrier) {
    if (!from.total[carrier.particle].isZero(0))
      impulses[i].add(division.fraction(i, carrier), of(carrier.particle));
  });
  for_each_particle(body, [&](std::size_t p) {  // a coarse skin has no position in some tetrahedra
    if (!division.has(p) && !from.total[p].isZero(0))
      impulses[nearest(surface.positions, bodies.particles.x[p])].add(1, of(p));
  });
  return impulses;
}

// Appends the force on each position of the surface of a body, and its pressure.
void add_body(const Bodies& bodies, const ContactImpulses& from, const scene::BodyShape& shape,
              const DeformableBody& body, const Surface& surface, double seconds, ContactLoads& out) {
  const Patches patches(surface);
  const std::vector<Impulse> impulses = on_surface(bodies, from, patches, shape, body, surface);
  for (std::size_t i = 0; i < impulses.size(); ++i) {
    const Impulse& impulse = impulses[i];
    out.force.push_back((impulse.total / seconds).cast<float>());
    const double normal = std::max(0.0, impulse.normal - impulse.without_normal.dot(patches.normal(i)));
    out.pressure.push_back(patches.area[i] > 0 ? static_cast<float>(normal / (patches.area[i] * seconds))
                                               : 0.0F);
  }
}

}  // namespace

void write_contact_loads(const scene::BuiltWorld& built, std::size_t rigid_count,
                         const std::vector<BodySurface>& surfaces, double seconds, ContactLoads& out) {
  const ContactTally& tally = built.world.contact_tally;
  const ContactSums& sums = tally.of_frame();
  const bool is_known = seconds > 0 && tally.knows(built.world.bodies);
  out.rigid_force.assign(rigid_count, Vec3::Zero());
  out.rigid_torque.assign(rigid_count, Vec3::Zero());
  for (std::size_t i = 0; i < rigid_count && is_known; ++i) {
    out.rigid_force[i] = sums.linear[i] / seconds;
    out.rigid_torque[i] = sums.angular[i] / seconds;
    const RigidBodies& rigid = built.world.bodies.rigid;
    if (rigid.properties[i].shape_frame)
      out.rigid_torque[i] +=
          (rigid.state[i].pose.position - shape_pose(rigid, i).position).cross(out.rigid_force[i]);
  }
  out.force.clear();
  out.pressure.clear();
  for (std::size_t i = rigid_count; i < surfaces.size(); ++i) {
    const Surface& surface = surfaces[i].surface;
    if (is_known) {
      const Bodies& bodies = built.world.bodies;
      add_body(bodies, sums.particle, built.shapes[i], bodies.deformable[i - rigid_count], surface, seconds,
               out);
    } else {
      out.force.resize(out.force.size() + surface.positions.size(), Vec3f::Zero());
      out.pressure.resize(out.pressure.size() + surface.positions.size(), 0);
    }
  }
}

}  // namespace duet
