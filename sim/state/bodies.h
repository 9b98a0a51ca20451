// Rigid and deformable bodies together, and whole-state velocities of both kinds.
#pragma once

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "sim/articulation/joint.h"
#include "sim/deformable/forces/internal_forces.h"
#include "sim/deformable/incompressibility.h"
#include "sim/deformable/particles.h"
#include "sim/deformable/self_contact/collision_surface.h"
#include "sim/embedding/bound_particles.h"
#include "sim/geometry/mesh/elements_around.h"
#include "sim/rigid/rigid_bodies.h"

namespace duet {

// A particle that moves with a kinematic body. Like every particle that is held it has no inverse mass.
struct CarriedParticle {
  int particle = 0;
  std::size_t kinematic = 0;  // index into RigidBodies::kinematic
  Vec3 arm = Vec3::Zero();    // m, in the body's space
};

struct Bodies {
  RigidBodies rigid;
  Particles particles;
  std::vector<CarriedParticle> carried;
  std::vector<BoundParticle> bound;
  InternalForces forces;    // of the deformable bodies
  std::vector<Tet> tets;    // of all volumes
  ElementLists neighbours;  // of each particle, in those
  ElementLists adjoining;   // of each rigid body, see adjoining_bodies()
  OneRings one_rings;       // of incompressible bodies
  std::vector<DeformableBody> deformable;
  std::vector<SurfacePoint> points;          // of all deformable bodies, body after body
  std::vector<BoundaryEdge> edges;           // the same, of what touches with more than its particles
  std::vector<Triangle> triangles;           // their boundaries, global particle indices
  ElementLists faces_around;                 // of each particle, those of the boundaries of volumes
  std::vector<std::array<int, 2>> segments;  // of rods, the same
  Articulation articulation;                 // joints between the rigid bodies
  std::vector<int> linked;                   // of each rigid body, see linked_bodies(); empty without joints
  // Two rigid bodies, the lesser first, and a rigid and a deformable one, that never touch; sorted.
  std::vector<std::pair<int, int>> apart, apart_deformable;
  CollisionSurface collision_surface;  // of the deformable bodies in their order, if they can meet or fold
  bool push_back = true;  // deformable bodies on rigid ones; without it, these have no use for momentum
};

// Whether contact passes over two rigid bodies, as over those that a joint holds together.
inline bool never_touch(const Bodies& bodies, int a, int b) {
  return !bodies.apart.empty() &&
         std::binary_search(bodies.apart.begin(), bodies.apart.end(), std::pair<int, int>(std::minmax(a, b)));
}

// The same for a rigid and a deformable body, as for bones and the flesh around them.
inline bool never_touch_deformable(const Bodies& bodies, int rigid, int deformable) {
  return !bodies.apart_deformable.empty() &&
         std::binary_search(bodies.apart_deformable.begin(), bodies.apart_deformable.end(),
                            std::pair(rigid, deformable));
}

// A velocity of every particle and body. Rigid rotation is stored as angular momentum: angular velocities
// saved before and restored after a change of orientation would create energy (paper section 2, facts of the
// original's stage I). Of bodies without finite momentum it is the angular velocity.
struct VelocityState {
  std::vector<Vec3> particle;  // m/s
  std::vector<Vec3> rigid;     // m/s
  std::vector<Vec3> rotation;  // rotation_variable: kg m^2/s of dynamic bodies, rad/s of others
};

void store_velocities(const Bodies& bodies, VelocityState& out);
void restore_velocities(const VelocityState& velocities,
                        Bodies& bodies);  // w follows from L and the orientation now
void add_velocities(const VelocityState& change, Bodies& bodies);
// out = (velocities of `bodies` now) - base
void velocity_difference(const Bodies& bodies, const VelocityState& base, VelocityState& out);

// Linear and angular momentum about the origin, and kinetic energy.
struct Momentum {
  Vec3 linear = Vec3::Zero();   // kg m/s
  Vec3 angular = Vec3::Zero();  // kg m^2/s
};
Momentum momentum(const Bodies& bodies);
double kinetic_energy(const Bodies& bodies);                             // J
double gravitational_energy(const Bodies& bodies, const Vec3& gravity);  // J, zero at the origin

}  // namespace duet
