// Flesh on bones that nothing else touches keeps its angular momentum, whatever joints and bindings connect
// it, at any spin, step and integration. A body that falls keeps its spin about its center of mass.
#include <algorithm>
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/step/step.h"

namespace duet::everyday_soft_spin_test {
namespace {

using scene::Integration;
using scene::JointType;

// Bound of the relative change of angular momentum. Without its correction, moving positions takes a fraction
// of order (w dt)^2 of the spin, 1e-3 to 1e-2 in a second. With it only rounding remains: 1e-16 in each of
// some thousand steps, of moments that nearly cancel.
constexpr double rounding = 1e-11;

// Returns bones of 1 m in a row along x, each jointed to the one before, in a bar of flesh that reaches over
// their ends. All turn about the middle at `spin` (rad/s).
scene::Scene bones_in_flesh(int bones, JointType type, const Vec3& spin, double youngs_modulus = 1e5) {
  scene::Scene scene = test::free_space();
  test::add_chain(scene, bones, type, false);
  const Vec3 middle(0.5 * bones, 0, 0);
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", middle, Vec3(1.1 * bones, 0.3, 0.3), 2, youngs_modulus);
  scene.materials.back().damping = 0.02;
  flesh.shape.cells = Vec3i(6 * bones, 2, 2);
  flesh.placement.angular_velocity = spin;
  for (scene::RigidBody& bone : scene.rigid) {
    bone.placement.angular_velocity = spin;
    bone.placement.velocity = spin.cross(bone.placement.position - middle);
    flesh.attach.push_back(bone.name);
  }
  return scene;
}

// The sum of all angular momenta about the common center of mass, and the sum of their magnitudes (kg m^2/s).
struct Spin {
  Vec3 sum = Vec3::Zero();
  double magnitude = 0;
};

// Returns the spin of all bodies.
Spin spin_of(const Bodies& bodies) {
  const Particles& particles = bodies.particles;
  const RigidBodies& rigid = bodies.rigid;
  double mass = 0;
  Vec3 center = Vec3::Zero();
  for (std::size_t p = 0; p < particles.size(); ++p) {
    mass += particles.mass[p];
    center += particles.mass[p] * particles.x[p];
  }
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    mass += rigid.properties[i].mass;
    center += rigid.properties[i].mass * rigid.state[i].pose.position;
  }
  center /= mass;
  Spin spin;
  const auto add = [&](const Vec3& moment) {
    spin.sum += moment;
    spin.magnitude += moment.norm();
  };
  const Vec3 drift = momentum(bodies).linear / mass;
  for (std::size_t p = 0; p < particles.size(); ++p)
    add(particles.mass[p] * (particles.x[p] - center).cross(particles.v[p] - drift));
  for (std::size_t i = 0; i < rigid.size(); ++i) {
    const RigidState& state = rigid.state[i];
    add(rigid.properties[i].mass * (state.pose.position - center).cross(state.velocity - drift) +
        state.angular_momentum);
  }
  return spin;
}

// Returns how long (s) spin must last: what is lost without its keeping shows within a fifth of a second as
// well.
double long_enough() { return test::runs_in_full() ? 1 : 0.2; }

// Returns the largest change of spin over the frames, relative to the largest sum of magnitudes.
double change_of_spin(const scene::Scene& scene, double seconds) {
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const Vec3 start = spin_of(bodies).sum;
  double change = 0, largest = 0;
  for (int frame = 0; frame < seconds * scene.fps; ++frame) {
    simulation.advance_frame();
    const Spin now = spin_of(bodies);
    change = std::max(change, (now.sum - start).norm());
    largest = std::max(largest, now.magnitude);
  }
  return change / largest;
}

const Vec3 tumbling(0.4, 1, 2);  // rad/s

// Joints of every type transmit equal and opposite impulses and torques.
TEST(EverydaySoftSpin, HoldsForAllJoints) {
  for (const auto& [type, name] : {std::pair(JointType::point, "point"),
                                   {JointType::hinge, "hinge"},
                                   {JointType::universal, "universal"},
                                   {JointType::prismatic, "prismatic"},
                                   {JointType::prismatic_twist, "prismatic_twist"},
                                   {JointType::weld, "weld"}})
    for (const int bones : {2, 3}) {
      const scene::Scene scene = bones_in_flesh(bones, type, tumbling);
      test::expect_below(change_of_spin(scene, long_enough()), rounding,
                         fmt::format("{}_bones_{}", bones, name));
    }
}

// The change is rounding at any rate and step, though the correction grows with (w dt)^2.
TEST(EverydaySoftSpin, HoldsAtAnySpinAndStep) {
  for (const double rate : {0.1, 1.0, 5.0})
    for (const double step : {1.0 / 48, 5e-4}) {
      scene::Scene scene = bones_in_flesh(3, JointType::point, rate * tumbling);
      scene.solver.max_time_step = step;
      test::expect_below(change_of_spin(scene, long_enough()), rounding,
                         fmt::format("at_{}_rad_s_in_steps_of_{:.1g}_s", rate * tumbling.norm(), step));
    }
}

// Gravity acts at the center of mass and gives no spin.
TEST(EverydaySoftSpin, HoldsInFreeFall) {
  scene::Scene scene = bones_in_flesh(2, JointType::point, tumbling);
  scene.gravity = Vec3(0, -9.8, 0);
  test::expect_below(change_of_spin(scene, long_enough()), rounding, "in_free_fall");
}

// Zero-length springs keep spin as embedded particles do.
TEST(EverydaySoftSpin, HoldsWithOneBoneAndWithSprings) {
  for (const int bones : {1, 2}) {
    scene::Scene scene = bones_in_flesh(bones, JointType::point, tumbling);
    test::expect_below(change_of_spin(scene, long_enough()), rounding, fmt::format("{}_bones", bones));
    scene.deformable[0].attach_springs = scene::AttachSprings{1e4, 1};
    test::expect_below(change_of_spin(scene, long_enough()), rounding,
                       fmt::format("{}_bones_on_springs", bones));
  }
}

// Implicit steps find velocities together with joints and damping in one solve, and so do solves of strongly
// damped flesh and of the alternate order. All of them keep the spin.
TEST(EverydaySoftSpin, HoldsInImplicitStepsAndWithOtherSolves) {
  for (const double youngs_modulus : {1e5, 1e6}) {
    scene::Scene scene = bones_in_flesh(2, JointType::point, tumbling, youngs_modulus);
    scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
    test::expect_below(change_of_spin(scene, long_enough()), rounding,
                       fmt::format("constraints_first_{:.0e}_Pa", youngs_modulus));
    scene.solver.velocity_constraints = scene::VelocityConstraints::after_solve;
    scene.solver.integration = scene::Integration::implicit;
    test::expect_below(change_of_spin(scene, long_enough()), rounding,
                       fmt::format("implicit_{:.0e}_Pa", youngs_modulus));
    scene.solver.integration = scene::Integration::semi_implicit;
    scene.materials.back().damping = 20;  // s, a hundred times critical damping and more
    test::expect_below(change_of_spin(scene, long_enough()), rounding,
                       fmt::format("strongly_damped_{:.0e}_Pa", youngs_modulus));
  }
}

// Without `solver.keep_spin` moving positions takes spin, by far more than rounding. This shows that the
// other tests of this file can fail.
TEST(EverydaySoftSpin, IsLostWithoutItsKeeping) {
  scene::Scene scene = bones_in_flesh(2, JointType::point, 5 * tumbling);
  scene.solver.keep_spin = false;
  test::expect_above(change_of_spin(scene, long_enough()), 1e-5, "semi_implicit");
  scene.solver.integration = scene::Integration::implicit;
  test::expect_above(change_of_spin(scene, long_enough()), 1e-5, "implicit");
}

// Controlled joints bend flesh that is at rest at first. The sum of its angular momentum stays zero, as that
// of a cat that turns in the air.
TEST(EverydaySoftSpin, StaysNoneWhileMusclesMove) {
  for (const double gain : {40.0, 400.0}) {
    scene::Scene scene = bones_in_flesh(2, JointType::point, Vec3::Zero());
    scene::Joint& joint = scene.joints.back();
    joint.has_control = true;
    joint.control.gain = gain;
    joint.control.target.sinusoid = {{Vec3(0, 40, 0), 0, 1, 90}, {Vec3(0, 0, 40), 0, 1, 0}};
    test::expect_below(change_of_spin(scene, 2 * long_enough()), rounding, fmt::format("gain_{:.0f}", gain));
  }
}

// Controlled joints that bend flesh in implicit steps store no more energy in it than in short semi-implicit
// steps, whatever the step, because the flesh takes part in the solve after they have acted.
TEST(EverydaySoftSpin, MusclesDoNotWindFleshUpInImplicitSteps) {
  const auto max_stored = [](scene::Integration integration, double longest_step, double gain) {
    scene::Scene scene = bones_in_flesh(2, JointType::point, Vec3::Zero(), 3e6);
    scene.solver.integration = integration;
    scene.solver.max_time_step = longest_step;
    scene.joints.back().has_control = true;
    scene.joints.back().control.gain = gain;
    scene.joints.back().control.target.sinusoid = {{Vec3(0, 40, 0), 0, 1, 90}, {Vec3(0, 0, 40), 0, 1, 0}};
    Simulation simulation(scene, test::plan(scene));
    double most = 0;  // J
    for (int frame = 0; frame < 24; ++frame) {
      simulation.advance_frame();
      most = std::max(most, simulation.stats().elastic);
    }
    return most;
  };
  test::Cases cases(2);  // 1 of 2
  for (const double gain : {400.0, 40.0}) {
    if (!cases.takes()) continue;
    const double expected = max_stored(scene::Integration::semi_implicit, 1.0 / 24, gain);
    EXPECT_GT(expected, 1) << "the flesh is bent";
    for (const double step : {1.0 / 24, 1.0 / 48, 1.0 / 200})
      test::expect_below(max_stored(scene::Integration::implicit, step, gain) / expected, 1.2,
                         fmt::format("stored, over that of short steps, gain_{:.0f}", gain));
  }
}

// Two bars are in one world, and a joint connects one of them to a static body. That one swings and takes
// momentum from its peg; the other one must keep its spin. A correction that sums over all bodies would mix
// them.
TEST(EverydaySoftSpin, OfOneIslandIsItsOwn) {
  scene::Scene scene = bones_in_flesh(2, JointType::point, tumbling);
  test::add_peg(scene, "peg", Vec3(5, 5, 0));
  test::add_box(scene, "held", Vec3(5, 4, 0), Vec3(0.2, 1, 0.2), 10).placement.velocity = Vec3(1, 0, 0);
  test::add_joint(scene, JointType::point, "peg", "held", Vec3(5, 5, 0));
  scene::DeformableBody& other = test::add_soft_box(scene, "other", Vec3(5, 4, 0), Vec3(0.4, 1.2, 0.4), 2);
  other.shape.cells = Vec3i(2, 4, 2);
  other.attach = {"held"};
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const auto spin_of_first = [&] {
    Vec3 spin = Vec3::Zero(), center = Vec3::Zero();
    double mass = 0;
    const auto visit = [&](auto&& work) {
      for_each_particle(bodies.deformable[0], [&](std::size_t p) {
        work(bodies.particles.mass[p], bodies.particles.x[p], bodies.particles.v[p], Vec3(Vec3::Zero()));
      });
      for (std::size_t i = 0; i < 2; ++i)
        work(bodies.rigid.properties[i].mass, bodies.rigid.state[i].pose.position,
             bodies.rigid.state[i].velocity, bodies.rigid.state[i].angular_momentum);
    };
    visit([&](double m, const Vec3& x, const Vec3&, const Vec3&) {
      mass += m;
      center += m * x;
    });
    center /= mass;
    visit([&](double m, const Vec3& x, const Vec3& v, const Vec3& own) {
      spin += m * (x - center).cross(v) + own;
    });
    return spin;
  };
  const Vec3 start = spin_of_first();
  for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
  test::expect_below((spin_of_first() - start).norm() / start.norm(), rounding, "free_one");
  EXPECT_GT(momentum(bodies).linear.norm(), 1) << "the held one has got momentum from its peg";
}

// Returns a damped body of one kind in free space that turns about z at `spin` (rad/s).
scene::Scene spinning(std::string_view kind, double damping, double spin, Integration integration) {
  scene::Scene scene = test::free_space();
  scene.solver.integration = integration;
  scene::DeformableBody& body = test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(0.6, 0.2, 0.2), 2, 1e6);
  body.shape.cells = Vec3i(6, 2, 2);
  body.placement.angular_velocity = Vec3(0, 0, spin);
  scene::Material& material = scene.materials.front();
  material.density = 1000;
  material.poisson_ratio = 0.3;
  material.damping = damping;
  if (kind == "springs") {
    material.has_springs = true;
    material.springs = {2e5, 100 * damping};
  } else if (kind == "rod") {
    body.shape = {};
    body.shape.kind = scene::DeformableKind::rod;
    body.shape.points = {Vec3(-0.3, 0, 0), Vec3(0.3, 0, 0)};
    body.shape.segments = 12;
    body.thickness = 0.02;
  }
  return scene;
}

// The velocities of a damping solve are those of a later time than the state of the elements. They turn with
// the body, which damping took for a contraction: it held bodies longer than the centrifugal force stretches
// them. A ball of 1e6 Pa with 0.1 s of damping gained a tenth of its energy at 40 rad/s, and a rope that
// whipped 5 %. Whatever the damping is, a body is stretched no farther, and energy does not rise.
TEST(EverydaySoftSpin, DampingTakesNoTurnForAContraction) {
  for (const char* kind : {"elements", "springs", "rod"}) {
    double stretched = 0;  // J, the elastic energy with the least damping
    for (const double damping : {0.01, 0.1, 0.5})
      for (const auto integration : {Integration::semi_implicit, Integration::implicit}) {
        if (std::string_view(kind) == "rod" && damping > 0.01) continue;  // takes long
        SCOPED_TRACE(fmt::format("{}, damping of {} s, implicit {}", kind, damping,
                                 integration == Integration::implicit));
        Simulation simulation(spinning(kind, damping, 20, integration),
                              test::plan(spinning(kind, damping, 20, integration)));
        const double first = simulation.stats().kinetic;
        double least = first, rise = 0;
        for (int frame = 0; frame < 12; ++frame) {
          simulation.advance_frame();
          const double energy = simulation.stats().kinetic + simulation.stats().elastic;
          rise = std::max(rise, energy - least);
          least = std::min(least, energy);
        }
        test::expect_below(rise / first, 1e-3, "rise of the energy, relative");
        if (integration == Integration::implicit) continue;
        if (stretched == 0) stretched = simulation.stats().elastic;
        test::expect_below(simulation.stats().elastic / stretched, 1.02,
                           "elastic energy, relative to that with the least damping");
      }
  }
}

}  // namespace
}  // namespace duet::everyday_soft_spin_test
