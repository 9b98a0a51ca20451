// From a validated scene to a World that can be stepped.
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

// A shell, a rod or a particle as it is drawn around its particles.
struct ThinShape {
  std::variant<ThickSheet, Tube, Bead> surface;
  std::size_t first_particle = 0, particle_count = 0;
};

// Render data that the step never reads.
struct BodyShape {
  std::string name;
  BoundarySurface surface;          // at rest, in body space; rigid bodies: vertex_nodes is empty
  std::optional<ThinShape> thin{};  // of all but volumes: they have no boundary surface
  // With a skin this is `surface`, without vertex_nodes, and the tets carry it.
  CarriedSurface skin{};
  std::size_t first_particle = 0;  // of those tets
};

struct BuiltWorld {
  World world;
  std::vector<TetSize> tet_meshes;
  std::vector<SkinSize> skins;    // of those without contact
  std::vector<BodyShape> shapes;  // scene's rigid bodies, then deformable ones; the ground has none
};

// The ground, if any, is the last rigid body. Throws Error when something cannot be built.
BuiltWorld build_world(const Scene& scene, const EffectSet& plan);

}  // namespace duet::scene
