// Particles of coarse soft bodies that could catch at an edge of a rigid body or at an internal edge between
// two. Friction would hold them there forever, and the elements that pull them back would stretch without
// end.
#include <algorithm>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::snagging_test {
namespace {

using test::expect_below;

// Adds a static box with a friction of 0.8.
void add_static_box(scene::Scene& scene, const std::string& name, const Vec3& position, const Vec3& size) {
  scene::RigidBody& box = test::add_box(scene, name, position, size, 1);
  box.mass.reset();
  box.is_static = true;
  box.friction = 0.8;
}

// Returns where a node of a weightless slab of 0.4 x 0.1 x 0.4 m is a second after it was released at
// `start`. All other nodes are pinned.
Vec3 final_place(scene::Scene& scene, const Vec3& center, const Vec3& node, const Vec3& start) {
  scene::DeformableBody& slab = test::add_soft_box(scene, "slab", center, Vec3(0.4, 0.1, 0.4), 2, 2e5);
  slab.shape.cells = Vec3i(2, 1, 2);
  scene.materials.back().poisson_ratio = 0;  // so that it does not move sideways when squeezed from above
  for (const double x : {-0.2, 0.0, 0.2})
    for (const double y : {-0.05, 0.05})
      for (const double z : {-0.2, 0.0, 0.2})
        if (Vec3(x, y, z) != node) slab.pins.push_back({Vec3(x, y, z), {}, 1e-3, {}});
  scene.solver.face_samples = 0;  // these would lift the node beside it
  Simulation simulation(scene, test::plan(scene));
  std::vector<Vec3>& x = simulation.world().bodies.particles.x;
  const Vec3 place = center + node;
  const auto particle = std::find_if(x.begin(), x.end(), [&](const Vec3& p) { return p.isApprox(place); });
  *particle = start;
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  return *particle;
}

// A particle that hangs in front of a step must return to its place on top. Friction at the riser must not
// hold it there.
TEST(Snagging, NoParticleStaysInFrontOfAStep) {
  scene::Scene scene = test::free_space();
  add_static_box(scene, "step", Vec3(0, -0.5, 0), Vec3(6, 1, 8));  // ends at z = 4
  // The node's elements pull it against the riser, and upwards by less than friction holds.
  const Vec3 center(0, 0.055, 3.6), node(0, -0.05, 0.2), hanging(0, -0.05, 4.001);
  expect_below((final_place(scene, center, node, hanging) - center - node).norm(), 1e-3, "distance, m");
}

// A particle between two planks, below their top: each plank by itself would push it sideways into the other
// one, as deep as it is. It must be lifted onto the common surface.
TEST(Snagging, ASeamBearsWhatLiesOnIt) {
  scene::Scene scene = test::free_space();
  add_static_box(scene, "left", Vec3(-2, -0.5, 0), Vec3(4, 1, 8));
  add_static_box(scene, "right", Vec3(2, -0.5, 0), Vec3(4, 1, 8));
  const Vec3 center(0, 0.04, 0), node(0, -0.05, 0), low(0, -0.003, 0);
  expect_below(std::abs(final_place(scene, center, node, low).y()), 1e-9, "depth, m");
}

// Returns the largest stretch after `frames` frames of a box of 1e7 Pa with a damping time of 0.02 s that was
// released at `start` times its length.
double stretch_after(int frames, double start) {
  scene::Scene scene = test::free_space();
  test::add_soft_box(scene, "box", Vec3(0, 0, 0), Vec3(1, 1, 1), 2, 1e7);
  scene.materials.back().damping = 0.02;
  Simulation simulation(scene, test::plan(scene));
  for (Vec3& x : simulation.world().bodies.particles.x) x.x() *= start;
  for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
  return simulation.stats().max_stretch;
}

// Viscosity of the Green strain grows with the square of the stretch. When it was bounded at four times that
// at rest, as it was before, the first box still had a stretch of 2.8. Without a bound the second one becomes
// unstable.
TEST(Snagging, WhatIsDrawnOutComesBackAndStaysWhole) {
  expect_below(stretch_after(20, 6), 1.5, "from 6 times the length");
  expect_below(stretch_after(20, 20), 20, "from 20 times the length");
}

// A box slides and turns over 50 planks as over one floor; edges between planks would stop it.
TEST(Snagging, PlanksAreAFloor) {
  // In m; outside of long tests the floor ends where the box does not come.
  const double from = test::runs_in_full() ? -5 : -1, length = test::runs_in_full() ? 18.5 : 3.7,
               across = test::runs_in_full() ? 20 : 4;
  for (const bool is_soft : {false, true}) {
    Vec3 place[2];
    for (const int planks : {1, test::runs_in_full() ? 50 : 10}) {
      scene::Scene scene = test::free_space();
      scene.gravity = Vec3(0, -9.8, 0);
      const double width = length / planks;
      for (int i = 0; i < planks; ++i)
        add_static_box(scene, "plank" + std::to_string(i), Vec3(from + width * (i + 0.5), -0.5, 0),
                       Vec3(width, 1, across));
      for (scene::RigidBody& plank : scene.rigid) plank.friction = 0.3;
      if (!is_soft) test::add_box(scene, "box", Vec3::Zero(), Vec3(0.6, 0.4, 0.6), 144).friction = 0.3;
      scene::Placement& placement = is_soft
                                        ? test::add_soft_box(scene, "box", Vec3::Zero(), Vec3(0.6, 0.4, 0.6),
                                                             test::runs_in_full() ? 4 : 2, 2e5)
                                              .placement
                                        : scene.rigid.back().placement;
      placement.position = Vec3(0.013, 0.2, 0);
      placement.velocity = Vec3(4, 0, 1.3);
      placement.orientation = Quat(Eigen::AngleAxisd(0.3, Vec3::UnitY()));
      Simulation simulation(scene, test::plan(scene));
      const int frames = test::runs_in_full() ? 24 : 10;  // over 11 internal edges, or 4
      for (int frame = 0; frame < frames; ++frame) simulation.advance_frame();
      const Bodies& bodies = simulation.world().bodies;
      place[planks > 1] = is_soft ? bodies.particles.x.front() : bodies.rigid.state.back().pose.position;
    }
    expect_below((place[1] - place[0]).norm(), 1e-4, is_soft ? "soft box, m" : "rigid box, m");
  }
}

}  // namespace
}  // namespace duet::snagging_test
