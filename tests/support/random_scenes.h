// What the tests of random scenes share: numbers, shapes and joints that are the same with every standard
// library, and the promises that all scenes keep.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <random>
#include <string>

#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/base/index.h"
#include "sim/base/parallel.h"
#include "sim/scene/scene.h"
#include "sim/step/world.h"

namespace duet::test {

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  double operator()(double least, double most) {
    return least + (most - least) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  int below(int count) { return static_cast<int>((*this)(0, count)); }
  Vec3 direction() {
    Vec3 v;
    do
      for (int axis = 0; axis < 3; ++axis) v[axis] = (*this)(-1, 1);
    while (v.norm() > 1 || v.norm() < 0.1);
    return v.normalized();
  }

 private:
  std::mt19937_64 engine_;
};

// Of any kind, its extents between 0.2 and 0.5 of `size` (m), in places less or up to twice that.
inline scene::Shape random_shape(Draw& draw, double size) {
  using scene::ShapeKind;
  const double a = size * draw(0.2, 0.5), b = size * draw(0.2, 0.5), c = size * draw(0.2, 0.5);
  switch (draw.below(6)) {
    case 0:
      return {.kind = ShapeKind::sphere, .radius = a};
    case 1:
      return {.kind = ShapeKind::capsule, .radius = 0.5 * a, .length = b};
    case 2:
      return {.kind = ShapeKind::cylinder, .radius = a, .length = b};
    case 3:
      return {.kind = ShapeKind::torus, .radius = 0.7 * a, .tube = 0.25 * a};
    case 4: {
      scene::Shape shape{.kind = ShapeKind::mesh, .scale = 1};
      shape.cells = 24;
      shape.mesh = std::make_shared<TriangleMesh>(box_mesh(-Vec3(a, b, c) / 2, Vec3(a, b, c) / 2));
      return shape;
    }
    default:
      return {.kind = ShapeKind::box, .size = Vec3(a, b, c)};
  }
}

// Half way between two bodies.
inline scene::Joint random_joint(Draw& draw, const std::string& name, const scene::RigidBody& parent,
                                 const scene::RigidBody& child) {
  scene::Joint joint;
  joint.name = name;
  joint.type = draw.below(2) == 0 ? scene::JointType::point : scene::JointType::hinge;
  joint.parent = parent.name;
  joint.child = child.name;
  joint.world.position = (parent.placement.position + child.placement.position) / 2;
  joint.world.axis = draw.direction();
  return joint;
}

struct Outcome {
  std::uint64_t hash = 0;
  std::string violation;  // the first one
  double gain = 0;        // of energy, the most over any earlier frame, of what there was at first
};

// What has fallen through the ground: bodies of their centres, soft ones of their surfaces, as particles
// inside may sink below these where a body is folded.
inline std::string fallen(const Bodies& bodies, double size) {
  const auto says = [](std::string_view name) { return fmt::format("{} fell through the ground", name); };
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    if (bodies.rigid.properties[i].is_dynamic() && !(bodies.rigid.state[i].pose.position.y() > 0))
      return says(bodies.rigid.name[i]);
  for (const SurfacePoint& point : bodies.points) {
    const int p = point.particle[0];
    if (point.count != 1 || bodies.particles.x[as_index(p)].y() > -0.02 * size) continue;
    for (const DeformableBody& body : bodies.deformable)
      if (p >= body.first_particle && p < body.first_particle + body.particle_count) return says(body.name);
  }
  return {};
}

// Energy never rises by more than a hundredth of what there was at first, above the ground: in free flight it
// is kept, what is left is contact's, of first order in the step. Bodies overlap by less than `most_overlap`
// of their size, and nothing falls through the ground.
inline Outcome keep_promises(const scene::Scene& scene, double size, int frames, double most_overlap) {
  constexpr double most_gain = 1e-2;
  Simulation simulation(scene, plan(scene));
  const auto energy_of = [](const FrameStats& stats) {
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double scale = energy_of(simulation.stats());  // J
  double least = scale;
  Outcome outcome;
  for (int frame = 1; frame <= frames && outcome.violation.empty(); ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    const double gain = (energy_of(stats) - least) / scale;
    const auto violated = [&](const std::string& what) {
      outcome.violation = fmt::format("frame {}: {}", frame, what);
    };
    if (!(gain < most_gain))
      violated(fmt::format("energy rose by {:.2g} of what there was at first", gain));
    else if (!(stats.max_penetration < most_overlap * size))
      violated(fmt::format("bodies overlap by {:.2g} of their size", stats.max_penetration / size));
    else if (const std::string what = fallen(simulation.world().bodies, size); !what.empty())
      violated(what);
    outcome.gain = std::max(outcome.gain, gain);
    least = std::min(least, energy_of(stats));
    outcome.hash = stats.hash;
  }
  return outcome;
}

// Simulates the scenes of the seeds from 1 to `count`, or as many as DUET_RANDOM_SCENES says (tools/test
// --full: 10,000), every tenth of them with two threads as well. None may break a promise, few may gain more
// than a thousandth of their energy.
template <class Simulate>
void expect_promises(int count, Simulate&& simulate) {
  if (const char* wanted = std::getenv("DUET_RANDOM_SCENES")) count = std::atoi(wanted);
  int violations = 0, gaining = 0;
  double most = 0;
  for (int seed = 1; seed <= count; ++seed) {
    set_thread_count(1);
    Outcome outcome = simulate(static_cast<std::uint64_t>(seed));
    gaining += outcome.gain > 1e-3;
    most = std::max(most, outcome.gain);
    if (outcome.violation.empty() && seed % 10 == 0) {
      set_thread_count(2);
      if (simulate(static_cast<std::uint64_t>(seed)).hash != outcome.hash)
        outcome.violation = "two threads give other bits";
    }
    if (outcome.violation.empty()) continue;
    ++violations;
    ADD_FAILURE() << "seed " << seed << ": " << outcome.violation;
  }
  set_thread_count(0);
  record_margin("most_gained", most, "each below 0.01");
  expect_below(violations, 1, fmt::format("violations_of_{}", count));
  expect_below(gaining, 2 + 0.015 * count, fmt::format("gaining_of_{}", count));
}

}  // namespace duet::test
