// Shapes and supports of the tests of everyday contact, in all sizes.
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

enum class Support { ground, static_box, tiles, mesh, kinematic_box, dynamic_box };

std::string name_of(Support support);

// What a body of the size `size` (m) lies, lands or rolls on, with its top at y = 0 and room for 60 sizes
// along x. Tiles meet at x = size, 3.6 size and so on: nothing starts on a seam.
void add_support(scene::Scene& scene, Support support, double size);

struct EverydayShape {
  std::string name;
  scene::Shape shape;                   // of the size 1
  Quat orientation = Quat::Identity();  // as it lies
  double height = 0;                    // of its center as it lies
  std::shared_ptr<TriangleMesh> mesh = {};
};

// A shape with all lengths `size` times as long.
scene::Shape scaled(scene::Shape shape, double size);

// A body of the given size (m) and of the density of water, lying at x = 0 with its lowest point `above` (m).
scene::RigidBody& add_shape(scene::Scene& scene, const EverydayShape& everyday, double size, double above);

// Where the body that add_shape() adds is in a simulation, which has the ground, too.
std::size_t index_of_shape(const Bodies& bodies);

std::vector<EverydayShape> shapes_that_lie_flat();

// With their axis along z; `height` is the radius that they roll on.
std::vector<EverydayShape> shapes_that_roll();

}  // namespace duet::test
