// Shapes and supports of the tests of everyday contact (tests/physics/everyday_*), in all sizes.
#pragma once

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "tests/support/meshes.h"
#include "tests/support/scenes.h"

#include "sim/base/rotation.h"
#include "sim/step/world.h"

namespace duet::test {

// Kinds of bodies that others lie, land or roll on.
enum class Support { ground, static_box, tiles, mesh, kinematic_box, dynamic_box };

// Returns the name of the enumerator.
std::string name_of(Support support);

// Adds a support for bodies of the size `size` (m), with its top at y = 0 and room for 60 sizes along x.
// Tiles meet at x = size, 3.6 size and so on, so that no body starts on an internal edge.
void add_support(scene::Scene& scene, Support support, double size);

// A rigid shape of size 1 and its resting position.
struct EverydayShape {
  std::string name;
  scene::Shape shape;                   // m, for the size 1
  Quat orientation = Quat::Identity();  // of the resting body
  double height = 0;  // m, of the center of the resting body above the support, for the size 1
  std::shared_ptr<TriangleMesh> mesh = {};  // surface of a mesh of size 1; null for other kinds
};

// Returns the shape with all lengths multiplied by `size`.
scene::Shape scaled(scene::Shape shape, double size);

// Adds a body called "body" of the size `size` (m) and the density of water (1000 kg/m^3). It rests at x = z
// = 0 with its lowest point at y = `above` (m).
scene::RigidBody& add_shape(scene::Scene& scene, const EverydayShape& everyday, double size, double above);

// Returns the place among the rigid bodies of the one that add_shape() added; the ground is one of them as
// well. Throws std::out_of_range if there is none.
std::size_t index_of_shape(const Bodies& bodies);

// Returns shapes at rest, among them cylinders and capsules that lie on their side.
std::vector<EverydayShape> shapes_that_lie_flat();

// Returns shapes that roll along x, with their axes along z. Their `height` is the rolling radius.
std::vector<EverydayShape> shapes_that_roll();

}  // namespace duet::test
