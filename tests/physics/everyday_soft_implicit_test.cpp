// Loads on soft bodies in implicit steps rest, as deep as elasticity says, on materials from rubber foam to
// stone, at any size and with any step. Bodies that land gain no energy.
#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/column.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/step/world.h"

namespace duet::everyday_soft_implicit_test {
namespace {

constexpr double gravity = 9.8, density = 1000;  // m/s^2, kg/m^3

// A soft cube under a rigid box.
struct Load {
  double youngs_modulus = 1e7;  // Pa
  double size = 1;              // m, of a soft cube
  double mass = 0.1;            // of the box, over the cube's mass
  double footprint = 1;         // side of the box over the cube's
  double longest_step = 1.0 / 24;
  double poisson_ratio = 0;
  double friction = 0;
};

// Returns a text that describes the load.
std::string name_of(const Load& load) {
  return fmt::format("{:g} Pa, {:g} m, load {:g}, steps of {:g} s", load.youngs_modulus, load.size, load.mass,
                     load.longest_step);
}

// Returns the cube on the ground with the box on it, both at the height of the unloaded cube.
scene::Scene loaded(const Load& load) {
  scene::Scene scene = test::on_ground(load.friction);
  scene.gravity = Vec3(0, -gravity, 0);
  const Vec3 size = Vec3::Constant(load.size);
  test::add_soft_box(scene, "soft", Vec3(0, load.size / 2, 0), size, 3, load.youngs_modulus);
  scene::Material& material = scene.materials[0];
  material.density = density;
  material.poisson_ratio = load.poisson_ratio;
  // The slowest mode, in which the load sinks, is about critically damped.
  const double frequency = 1.6 / load.size * std::sqrt(load.youngs_modulus / density / (1 + 3 * load.mass));
  material.damping = 1 / frequency;
  scene::RigidBody& box =
      test::add_box(scene, "load", Vec3(0, 1.25 * load.size, 0),
                    Vec3(load.footprint * load.size, load.size / 2, load.footprint * load.size),
                    load.mass * density * load.size * load.size * load.size);
  box.friction = load.friction;
  box.restitution = 0;
  scene.solver.integration = scene::Integration::implicit;
  scene.solver.max_time_step = load.longest_step;
  return scene;
}

// Returns how far (m) the top of the cube sinks by theory.
double sinking(const Load& load) {
  return load.size * test::shortening(load.youngs_modulus, gravity * density * load.size, load.mass);
}

// Measurements of the load and of the energy.
struct Rest {
  double sunk = 0;     // m, how far the load has sunk at the end
  double risen = 0;    // m, largest height of the load above its start
  double moving = 0;   // m/s, speed of the load at the end
  double kinetic = 0;  // J, of all bodies at the end
  double gained = 0;   // J, largest rise of the total energy above an earlier frame
  double above = 0;    // J, largest rise of the total energy above the start
  double drift = 0;    // m, sideways displacement of the load
};

// Simulates the loaded cube.
Rest rest(const Load& load, int frames = 18) {
  const scene::Scene scene = loaded(load);
  Simulation simulation(scene, test::plan(scene));
  const RigidState& state = simulation.world().bodies.rigid.state[0];
  const double height = state.pose.position.y();
  const auto energy = [&] {
    const FrameStats stats = simulation.stats();
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double start = energy();
  double least = start;
  Rest found;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    found.risen = std::max(found.risen, state.pose.position.y() - height);
    const double now = energy();
    found.gained = std::max(found.gained, now - least);
    found.above = std::max(found.above, now - start);
    least = std::min(least, now);
  }
  found.sunk = height - state.pose.position.y();
  found.moving = state.velocity.norm();
  found.kinetic = simulation.stats().kinetic;
  found.drift = std::hypot(state.pose.position.x(), state.pose.position.z());
  return found;
}

// Returns the work (J) of the load and of the cube's weight on their way down, which is the most energy that
// motion can have.
double exchanged(const Load& load) {
  const double weight = gravity * density * load.size * load.size * load.size;
  return (load.mass + 0.5) * weight * sinking(load);
}

// The sinking is compared with the compressed column of shortening(), to 4 %: the lattice of 3 cells carries
// 1 % less than a finer one. Energy may rise by 1 % of what is exchanged on the way, never above the start.
TEST(EverydaySoftImplicit, LoadsSinkByTheory) {
  double worst = 0, gained = 0, risen = 0;
  test::Cases cases(3);  // 8 of 22
  for (const Load& load : {Load{1e3, 0.01, 0.1}, Load{1e4, 0.1, 0.1}, Load{1e5, 0.1, 1}, Load{1e5, 1, 0.1},
                           Load{1e6, 1, 1}, Load{1e7, 0.1, 1}, Load{1e7, 1, 0.1}, Load{1e7, 10, 0.1},
                           Load{1e8, 1, 1}, Load{1e9, 1, 0.1}, Load{1e9, 10, 1}})
    for (const double step : {1.0 / 24, 1.0 / 100}) {
      if (!cases.takes()) continue;
      Load each = load;
      each.footprint = 1.2;  // its edges must not lie on the cube's
      each.friction = 0.5;
      each.longest_step = step;
      SCOPED_TRACE(name_of(each));
      const Rest found = rest(each, each.youngs_modulus < 1e4 ? 36 : 18);
      const double theory = sinking(each);
      EXPECT_NEAR(found.sunk, theory, 0.04 * theory);
      worst = std::max(worst, std::abs(found.sunk / theory - 1));
      EXPECT_LE(found.above, 0);
      gained = std::max(gained, found.gained / exchanged(each));
      risen = std::max(risen, found.risen / each.size);
    }
  test::expect_below(worst, 0.04, "depth, relative");
  test::expect_below(gained, 0.01, "energy gained on the way, over what is exchanged");
  test::expect_below(risen, 1e-6, "rise, over the size");
}

// Loads used to be thrown: one with a tenth of the cube's weight, by 0.42 m to 48 m. They must not rise by
// more than 1e-6 of the size, and must come to rest.
TEST(EverydaySoftImplicit, LoadsRest) {
  double risen = 0, speed = 0, drift = 0;
  test::Cases cases(4);  // 10 of 40
  for (const double youngs_modulus : {1e5, 1e6, 1e7, 1e8, 1e9})
    for (const double size : {0.3, 1.0, 5.0})
      for (const double step : {1.0 / 24, 1.0 / 48, 1.0 / 250}) {
        // 100 kg on 1 m, 9 kg on 0.3 m: too little to compress the cube far
        const double mass = 1 / (1 + 3 * size);
        const Load load{youngs_modulus, size, mass, 0.5, step, 0.3, 0.5};
        if (gravity * density * size > 0.05 * youngs_modulus || !cases.takes()) continue;
        SCOPED_TRACE(name_of(load));
        const double frequency = std::sqrt(youngs_modulus / density) / size;  // rad/s
        const Rest found = rest(load, std::max(12, static_cast<int>(24 * 15 / frequency)));
        EXPECT_LE(found.above, 0);
        EXPECT_LT(found.risen, 1e-6 * size);
        risen = std::max(risen, found.risen / size);
        speed = std::max(speed, found.moving / std::sqrt(gravity * size));
        drift = std::max(drift, found.drift / size);
      }
  test::expect_below(risen, 1e-6, "rise, over the size");
  test::expect_below(speed, 1e-3, "speed at the end, over that of a fall by the size");
  test::expect_below(drift, 1e-3, "drift, over the size");
}

// Steps far shorter than a frame must not throw loads either.
TEST(EverydaySoftImplicit, LoadsRestInStepsOfAMillisecond) {
  for (const Load& load :
       {Load{1e5, 0.1, 0.5, 0.5, 1e-3, 0.3, 0.5}, Load{1e7, 1, 0.1, 0.5, 1e-3, 0.3, 0.5},
        Load{1e8, 0.3, 0.3, 0.5, 1e-3, 0.3, 0.5}, Load{1e9, 1, 0.1, 0.5, 1e-3, 0.3, 0.5}}) {
    SCOPED_TRACE(name_of(load));
    const Rest found = rest(load, 4);
    EXPECT_LE(found.above, 0);
    EXPECT_LT(found.risen, 1e-6 * load.size);
    EXPECT_LT(found.moving, 0.01 * std::sqrt(gravity * load.size));
  }
}

// A cube that stands on the ground does not tremble in implicit steps as long as frames: no particle is
// faster than the tolerance of the solves, 1e-3 m/s.
TEST(EverydaySoftImplicit, CubesLieStill) {
  double speed = 0;
  for (const double youngs_modulus : {1e6, 1e7, 1e8}) {
    SCOPED_TRACE(youngs_modulus);
    scene::Scene scene = test::on_ground();
    test::add_soft_box(scene, "soft", Vec3(0, 0.5, 0), Vec3(1, 1, 1), 3, youngs_modulus);
    scene.solver.integration = scene::Integration::implicit;
    scene.solver.max_time_step = 1.0 / 24;
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 48; ++frame) simulation.advance_frame();
    for (const Vec3& v : simulation.world().bodies.particles.v) speed = std::max(speed, v.norm());
  }
  test::expect_below(speed, 1e-3, "m/s, of any particle");
}

// A cube that falls by half its size never gains energy, up to 1 % of that of the fall, and comes to rest.
TEST(EverydaySoftImplicit, LandingsBringNoEnergy) {
  double gained = 0, left = 0;
  test::Cases cases(3);  // 4 of 10
  for (const double youngs_modulus : {1e4, 1e6, 1e8})
    for (const double size : {0.1, 1.0})
      for (const double step : {1.0 / 24, 1.0 / 100}) {
        if (gravity * density * size > 0.2 * youngs_modulus) continue;  // it would be compressed too far
        if (!cases.takes()) continue;
        SCOPED_TRACE(fmt::format("{:g} Pa, {:g} m, steps of {:g} s", youngs_modulus, size, step));
        scene::Scene scene = test::on_ground();
        test::add_soft_box(scene, "soft", Vec3(0, size, 0), Vec3::Constant(size), 3, youngs_modulus);
        scene.materials[0].poisson_ratio = 0.3;
        scene.materials[0].damping = 0.3 * size * std::sqrt(density / youngs_modulus);
        scene.solver.integration = scene::Integration::implicit;
        scene.solver.max_time_step = step;
        Simulation simulation(scene, test::plan(scene));
        const double fall = gravity * density * std::pow(size, 4) / 2;  // J
        double least = 0, energy = 0;
        for (int frame = 0; frame < 48; ++frame) {
          simulation.advance_frame();
          const FrameStats stats = simulation.stats();
          energy = stats.kinetic + stats.potential + stats.elastic;
          if (frame > 0) gained = std::max(gained, (energy - least) / fall);
          least = frame > 0 ? std::min(least, energy) : energy;
          ASSERT_GT(stats.min_det_F, 0);
        }
        left = std::max(left, simulation.stats().kinetic / fall);
      }
  test::expect_below(gained, 0.01, "energy gained, over that of the fall");
  test::expect_below(left, 0.01, "energy of motion at the end, over that of the fall");
}

// Friction slows a sliding body by mu g. The bound of 1 % is a measurement with a margin.
TEST(EverydaySoftImplicit, SlidesByItsFriction) {
  constexpr double friction = 0.3;
  double worst = 0;
  test::Cases cases(5);  // 2 of 6
  for (const double youngs_modulus : {1e5, 1e6, 1e7})
    for (const double step : {1.0 / 24, 1.0 / 200}) {
      if (!cases.takes()) continue;
      SCOPED_TRACE(fmt::format("{:g} Pa, steps of {:g} s", youngs_modulus, step));
      scene::Scene scene = test::on_ground(friction);
      scene.gravity = Vec3(0, -gravity, 0);
      test::add_soft_box(scene, "soft", Vec3(0, 0.1, 0), Vec3(0.5, 0.2, 0.5), 4, youngs_modulus)
          .placement.velocity = Vec3(2, 0, 0);
      scene.solver.integration = scene::Integration::implicit;
      scene.solver.max_time_step = step;
      Simulation simulation(scene, test::plan(scene));
      const auto speed = [&] {
        const Particles& particles = simulation.world().bodies.particles;
        double momentum = 0, mass = 0;
        for (std::size_t p = 0; p < particles.size(); ++p) {
          momentum += particles.mass[p] * particles.v[p].x();
          mass += particles.mass[p];
        }
        return momentum / mass;
      };
      for (int frame = 0; frame < 2; ++frame) simulation.advance_frame();  // until it has settled
      const double before = speed();
      for (int frame = 0; frame < 10; ++frame) simulation.advance_frame();
      worst = std::max(worst, std::abs((before - speed()) / (friction * gravity * 10 / scene.fps) - 1));
    }
  test::expect_below(worst, 0.01, "deceleration, relative");
}

// The rims of soft boxes lie on the edges of rigid ones, so that from step to step points come into and go
// out of reach of the faces beside them. These changes must not feed energy in.
TEST(EverydaySoftImplicit, StacksOfSoftAndRigidBodiesLoseEnergy) {
  test::Cases cases(2);  // 1 of 2
  for (const double longest : {1.0 / 48, 1.0 / 24}) {
    if (!cases.takes()) continue;
    scene::Scene scene = test::on_ground(0.5);
    scene.gravity = Vec3(0, -gravity, 0);
    for (int i = 0; i < (test::runs_in_full() ? 6 : 4); ++i) {
      const Vec3 place(0, 1 + 2.0 * i, 0);
      const std::string name = fmt::format("box{}", i);
      if (i % 2 == 0)
        test::add_soft_box(scene, name, place, Vec3::Constant(2), 4, 2e6);
      else
        test::add_box(scene, name, place, Vec3::Constant(2), 8000).friction = 0.4;
    }
    for (scene::Material& material : scene.materials) {
      material.damping = 0.01;
      material.poisson_ratio = 0.45;
    }
    scene.solver.integration = scene::Integration::implicit;
    scene.solver.max_time_step = longest;
    Simulation simulation(scene, test::plan(scene));
    const auto energy = [&] {
      const FrameStats stats = simulation.stats();
      return stats.kinetic + stats.potential + stats.elastic;
    };
    double least = energy(), gained = 0, exchanged = 0;  // J
    for (int frame = 0; frame < (test::runs_in_full() ? 36 : 18); ++frame) {
      simulation.advance_frame();
      gained = std::max(gained, energy() - least);
      least = std::min(least, energy());
      exchanged = std::max(exchanged, simulation.stats().kinetic + simulation.stats().elastic);
    }
    test::expect_below(gained / exchanged, 1e-3, fmt::format("energy gained, steps of {:g} s", longest));
  }
}

}  // namespace
}  // namespace duet::everyday_soft_implicit_test
