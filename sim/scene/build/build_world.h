// Converts a validated scene to a World that can be stepped.
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "sim/embedding/carried_surface.h"
#include "sim/geometry/level_set/thick_surface.h"
#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/scene/scene.h"
#include "sim/scene/world_sizes.h"
#include "sim/step/world.h"

namespace duet::scene {

/// The drawn surface of a shell, rod or particle around its particles.
struct ThinShape {
  std::variant<ThickSheet, Tube, Bead> surface;  ///< Makes the surface from positions of particles.
  std::size_t first_particle = 0,                ///< Index of the first of its particles.
      particle_count = 0;                        ///< Number of its particles.
};

/// The drawn surface of a body. The step never reads it.
struct BodyShape {
  std::string name;  ///< Name of the body.
  /// Surface at rest, m: of rigid bodies in shape space, of deformable bodies in the coordinates of the
  /// shape. Its `vertex_nodes` (global particle indices) are empty except for volumes without a skin.
  BoundarySurface surface;
  /// Surface of a shell, rod or particle. None: the body is rigid or a volume.
  std::optional<ThinShape> thin{};
  CarriedSurface skin{};           ///< How tetrahedra carry `surface` if it is a skin; else empty.
  std::size_t first_particle = 0;  ///< Index of the first particle of these tetrahedra.
  /// True if `surface` is the contact surface of the body; false if other bodies touch another one.
  bool is_touched = true;
};

/// A world with the data that only output needs.
struct BuiltWorld {
  World world;                      ///< The world.
  std::vector<TetSize> tet_meshes;  ///< Sizes of the tetrahedral meshes.
  std::vector<SkinSize> skins;      ///< Sizes of the skins that are not in contact.
  std::vector<BodyShape> shapes;  ///< Drawn surfaces: rigid bodies, then deformable ones, without the ground.
};

/// Builds the world of `scene` with the effects of `plan`. The rigid bodies keep the order of the scene; the
/// ground, if any, is the last rigid body. Throws Error (usage) if something cannot be built.
BuiltWorld build_world(const Scene& scene, const EffectSet& plan);

}  // namespace duet::scene
