// Random scenes: numbers, shapes and joints that are equal with every standard library, and checks that hold
// for all scenes.
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

// A source of random numbers. The distributions of the standard library differ from one implementation to
// another, so that it has its own.
class Draw {
 public:
  // Equal seeds give equal numbers.
  explicit Draw(std::uint64_t seed) : engine_(seed) {}
  // Returns a number from `least` (inclusive) to `most` (exclusive) with 53 random bits.
  double operator()(double least, double most) {
    return least + (most - least) * static_cast<double>(engine_() >> 11) * 0x1p-53;
  }
  // Returns a whole number from 0 to `count` - 1.
  int below(int count) { return static_cast<int>((*this)(0, count)); }
  // Returns a uniformly distributed unit vector.
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

// Returns a shape of any kind. Its radii and lengths are 0.2 to 0.5 of `size` (m); some parts are smaller,
// and round ones up to twice as wide.
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

// Returns a point joint or a hinge halfway between two bodies, with a random axis.
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

// The result of one simulated scene.
struct Outcome {
  std::uint64_t hash = 0;  // of the state after the last frame
  std::string violation;   // text of the first broken bound; empty: none
  double gain = 0;  // largest rise of the energy above that of any earlier frame, over the energy of frame 0
};

// Returns a text that names a body that has fallen through the ground, or an empty one. Rigid bodies count by
// their centers, deformable ones by the vertices of their surfaces: particles inside may sink lower where a
// body is folded. `size` (m) is the size of the bodies.
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

// Simulates a scene and checks three bounds. Energy never rises by more than a hundredth of that of frame 0:
// free flight conserves it, and the rest is the error of contact, which is of first order in the step. Bodies
// overlap by less than `max_overlap` of their `size` (m). No body falls through the ground. Stops at the
// first violation.
inline Outcome keep_promises(const scene::Scene& scene, double size, int frames, double max_overlap) {
  constexpr double max_gain = 1e-2;
  Simulation simulation(scene, plan(scene));
  const auto energy_of = [](const FrameStats& stats) {
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double scale = energy_of(simulation.stats());  // J, energy of frame 0
  double least = scale;
  Outcome outcome;
  for (int frame = 1; frame <= frames && outcome.violation.empty(); ++frame) {
    simulation.advance_frame();
    const FrameStats stats = simulation.stats();
    const double gain = (energy_of(stats) - least) / scale;
    const auto violated = [&](const std::string& what) {
      outcome.violation = fmt::format("frame {}: {}", frame, what);
    };
    if (!(gain < max_gain))
      violated(fmt::format("energy rose by {:.2g} of what there was at first", gain));
    else if (!(stats.max_penetration < max_overlap * size))
      violated(fmt::format("bodies overlap by {:.2g} of their size", stats.max_penetration / size));
    else if (const std::string what = fallen(simulation.world().bodies, size); !what.empty())
      violated(what);
    outcome.gain = std::max(outcome.gain, gain);
    least = std::min(least, energy_of(stats));
    outcome.hash = stats.hash;
  }
  return outcome;
}

// Simulates the scenes of the seeds 1 to `count`; the environment variable DUET_RANDOM_SCENES overrides the
// number (tools/test --full: 10,000). Every tenth scene runs with two threads as well and must give equal
// hashes. No scene may violate a bound, and fewer than 2 and the fraction `share` of them may gain more than
// a thousandth of their energy. `simulate` maps a seed to an Outcome.
template <class Simulate>
void expect_promises(int count, double share, Simulate&& simulate) {
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
  expect_below(gaining, 2 + share * count, fmt::format("gaining_of_{}", count));
}

}  // namespace duet::test
