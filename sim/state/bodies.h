// The state of all rigid and deformable bodies together, and their momentum and energy.
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
#include "sim/embedding/embedded_particles.h"
#include "sim/geometry/mesh/elements_around.h"
#include "sim/rigid/rigid_bodies.h"
#include "sim/state/generalized_velocity.h"

namespace duet {

/// A prescribed particle: it moves with a kinematic body. Its inverse mass is zero, as that of every particle
/// that is held, so that no force moves it.
struct PrescribedParticle {
  int particle = 0;           ///< Index of the particle.
  std::size_t kinematic = 0;  ///< Index into RigidBodies::kinematic of the body that carries the particle.
  Vec3 arm = Vec3::Zero();    ///< Position of the particle in the frame of the body, m.
};

/// All rigid and deformable bodies of a scene, with what connects them.
struct Bodies {
  RigidBodies rigid;                        ///< The rigid bodies: dynamic, kinematic and static ones.
  Particles particles;                      ///< The particles of all deformable bodies, body after body.
  std::vector<PrescribedParticle> carried;  ///< Prescribed particles, which kinematic bodies carry.
  std::vector<EmbeddedParticle> bound;      ///< Embedded particles, which dynamic rigid bodies carry.
  InternalForces forces;                    ///< Internal forces of the deformable bodies.
  std::vector<Tet> tets;                    ///< Tetrahedra of all volumes, as global particle indices.
  ElementLists neighbors;                   ///< For each particle: its neighbors along edges of `tets`.
  /// For each static body: the static bodies that adjoin it; empty lists for others. See adjoining_bodies().
  ElementLists adjoining;
  NodalVolumes nodal_volumes;              ///< Nodal volumes of the incompressible bodies.
  std::vector<DeformableBody> deformable;  ///< The deformable bodies, as ranges of the arrays here.
  std::vector<SurfacePoint> points;        ///< Surface points of all deformable bodies, body after body.
  /// Boundary edges of all deformable bodies that touch with more than their particles, body after body.
  std::vector<BoundaryEdge> edges;
  std::vector<Triangle> triangles;  ///< Boundary triangles, body after body, as global particle indices.
  ElementLists faces_around;        ///< For each particle: the boundary triangles of volumes that contain it.
  /// Segments of rods, body after body, as global particle indices.
  std::vector<std::array<int, 2>> segments;
  Articulation articulation;  ///< Joints between the rigid bodies.
  /// For each rigid body: its jointed group, named by the first member, or -1; see linked_bodies(). Empty in
  /// scenes without joints.
  std::vector<int> linked;
  /// Collision exclusions between rigid bodies: pairs with the lesser index first, sorted.
  std::vector<std::pair<int, int>> collision_exclusions,
      collision_exclusions_deformable;  ///< Collision exclusions: pairs of a rigid and a deformable body,
                                        ///< sorted.
  CollisionSurface collision_surface;   ///< Surfaces for self-repulsion and self-collision; empty without.
  /// True if deformable bodies push rigid ones. If false, contact is one-way: impulses of deformable guests
  /// do not move their rigid hosts.
  bool push_back = true;
};

/// Returns whether the rigid bodies `a` and `b` are a collision exclusion, as two bodies of a joint are.
inline bool is_excluded(const Bodies& bodies, int a, int b) {
  return !bodies.collision_exclusions.empty() &&
         std::binary_search(bodies.collision_exclusions.begin(), bodies.collision_exclusions.end(),
                            std::pair<int, int>(std::minmax(a, b)));
}

/// Returns whether a rigid and a deformable body are a collision exclusion, as a bone and its flesh are.
inline bool is_excluded_deformable(const Bodies& bodies, int rigid, int deformable) {
  return !bodies.collision_exclusions_deformable.empty() &&
         std::binary_search(bodies.collision_exclusions_deformable.begin(),
                            bodies.collision_exclusions_deformable.end(), std::pair(rigid, deformable));
}

/// Linear and angular momentum.
struct Momentum {
  Vec3 linear = Vec3::Zero();   ///< Linear momentum, kg m/s.
  Vec3 angular = Vec3::Zero();  ///< Angular momentum about the origin of the world, kg m^2/s.
};
/// Returns the momentum of all particles and rigid bodies at their present positions.
Momentum momentum(const Bodies& bodies);
/// Returns the kinetic energy of all particles and rigid bodies, J.
double kinetic_energy(const Bodies& bodies);
/// Returns the potential energy -sum m g.x in the field `gravity` (m/s^2), J. It is zero at the origin.
double gravitational_energy(const Bodies& bodies, const Vec3& gravity);

}  // namespace duet
