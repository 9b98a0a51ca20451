// Bones inside flesh: particles that are embedded in rigid bodies or bound to them by zero-length springs.
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/articulated.h"
#include "tests/support/elastic_state.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/rotation.h"
#include "sim/step/step.h"

namespace duet::embedding_test {
namespace {

// Returns a soft block of 1 m in free space with a bone across its middle.
scene::Scene block_with_bone(double youngs_modulus, double bone_mass) {
  scene::Scene scene = test::free_space();
  test::add_box(scene, "bone", Vec3(0, 0, 0), Vec3(0.6, 0.3, 0.3), bone_mass);
  scene::DeformableBody& flesh =
      test::add_soft_box(scene, "flesh", Vec3(0, 0, 0), Vec3(1, 1, 1), 5, youngs_modulus);
  flesh.attach = {"bone"};
  return scene;
}

// Adds two bones, connected by a joint, inside a soft bar.
scene::DeformableBody& add_bones_in_flesh(scene::Scene& scene, const Vec3& size, const Vec3i& cells,
                                          double youngs_modulus) {
  test::add_chain(scene, 2, scene::JointType::point, false);
  scene::DeformableBody& flesh = test::add_soft_box(scene, "flesh", Vec3(1, 0, 0), size, 1, youngs_modulus);
  flesh.shape.cells = cells;
  flesh.attach = {"link0", "link1"};
  return flesh;
}

// Returns the speed (m/s) of the fastest particle.
double max_speed(const World& world) {
  double largest = 0;
  for (const Vec3& v : world.bodies.particles.v) largest = std::max(largest, v.norm());
  return largest;
}

// The mass of embedded particles goes to their bone, so that the sum is bone plus flesh, 1050 kg.
TEST(Embedding, NoMassIsLost) {
  scene::Scene scene = block_with_bone(1e5, 50);
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  ASSERT_GT(bodies.bound.size(), 0u);
  double mass = bodies.rigid.properties[0].mass;
  for (const double m : bodies.particles.mass) mass += m;
  EXPECT_NEAR(mass, 50 + 1000, 1e-9);
}

// Embedded particles follow x = q arm + p and v = v_bone + w x arm to rounding.
TEST(Embedding, BoundParticlesStandAndMoveWithTheirBone) {
  scene::Scene scene = block_with_bone(1e5, 50);
  scene.rigid[0].placement.angular_velocity = Vec3(1, 2, 3);
  Simulation simulation(scene, test::plan(scene));
  simulation.advance_frame();
  const Bodies& bodies = simulation.world().bodies;
  const RigidState& bone = bodies.rigid.state[0];
  for (const EmbeddedParticle& bound : bodies.bound) {
    EXPECT_LT((bodies.particles.x[bound.particle] - bone.pose.to_world(bound.arm)).norm(), 1e-14);
    EXPECT_LT(
        (bodies.particles.v[bound.particle] - point_velocity(bone, bone.pose.orientation * bound.arm)).norm(),
        1e-13);
  }
}

// The bone shakes the flesh. Only the two act on each other, so linear momentum is kept to rounding, and so
// is angular momentum by keep_spin; in implicit steps it is kept to second order. In semi-implicit steps no
// stage may have a defect in the ledger, apart from the moment that moving positions leaves.
TEST(Embedding, BoneAndFleshKeepMomentum) {
  for (const scene::Integration integration :
       {scene::Integration::semi_implicit, scene::Integration::implicit}) {
    scene::Scene scene = block_with_bone(1e5, 200);
    scene.solver.integration = integration;
    scene.rigid[0].placement.velocity = Vec3(3, -1, 2);
    scene.rigid[0].placement.angular_velocity = Vec3(0, 2, 1);
    Simulation simulation(scene, test::plan(scene));
    simulation.keep_ledger();
    World& world = simulation.world();
    const Momentum start = momentum(world.bodies);
    double defect = 0;
    for (int frame = 0; frame < 12; ++frame) {
      simulation.advance_frame();
      for (const LedgerStats& stage : simulation.stats().ledger) {
        defect = std::max(defect, stage.momentum_defect / start.linear.norm());
        if (stage.name != name(Stage::advance_position) && stage.name != "step")
          defect = std::max(defect, stage.angular_momentum_defect / start.angular.norm());
      }
    }
    const Momentum end = momentum(world.bodies);
    test::expect_below((end.linear - start.linear).norm() / start.linear.norm(), 1e-10, "linear_momentum");
    if (integration == scene::Integration::semi_implicit)
      test::expect_below(defect, 1e-10, "defect_of_a_stage");
    test::expect_below((end.angular - start.angular).norm() / start.angular.norm(),
                       integration == scene::Integration::implicit ? 1e-5 : 1e-10, "angular_momentum");
  }
}

// The alternate order of step V, constraints before the solve, keeps momentum as well.
TEST(Embedding, ConstraintsFirstKeepMomentumToo) {
  scene::Scene scene = block_with_bone(1e5, 200);
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  scene.rigid[0].placement.velocity = Vec3(3, -1, 2);
  scene.rigid[0].placement.angular_velocity = Vec3(0, 2, 1);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  World& world = simulation.world();
  const Momentum start = momentum(world.bodies);
  double defect = 0;
  for (int frame = 0; frame < 6; ++frame) {
    simulation.advance_frame();
    for (const Stage stage : {Stage::re_evaluation, Stage::damping_at_end}) {
      defect = std::max(defect, world.ledger[stage].linear_defect / start.linear.norm());
      defect = std::max(defect, world.ledger[stage].angular_defect / start.angular.norm());
    }
  }
  test::expect_below(defect, 1e-10, "defect_of_a_stage");
  test::expect_below((momentum(world.bodies).linear - start.linear).norm() / start.linear.norm(), 1e-10,
                     "linear_momentum");
}

// In the alternate order the damping of the flesh must leave the joints between its bones closed, because
// they take part in the solve. Joints that were only projected before the solve would show a velocity gap.
TEST(Embedding, ConstraintsFirstKeepJointsToo) {
  scene::Scene scene = test::free_space();
  scene::DeformableBody& flesh = add_bones_in_flesh(scene, Vec3(2.2, 0.4, 0.4), Vec3i(16, 4, 4), 1e5);
  flesh.placement.velocity = Vec3(0, 3, 0);
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const Joint& joint = bodies.articulation.joints.back();
  const auto at = [&](int body, const Pose& frame) {
    const RigidState& state = bodies.rigid.state[static_cast<std::size_t>(body)];
    return point_velocity(state, state.pose.orientation * frame.position);
  };
  for (int frame = 0; frame < 4; ++frame) {
    simulation.advance_frame();
    const Vec3 gap = at(joint.parent, joint.parent_frame) - at(joint.child, joint.child_frame);
    test::expect_below(gap.norm(), 1e-9, "velocity_gap");
  }
}

// Bones with a joint, flesh and contact continue from a saved state with the same bits.
TEST(Embedding, ResumesToTheSameBits) {
  scene::Scene scene = test::on_ground();
  scene::DeformableBody& flesh = add_bones_in_flesh(scene, Vec3(2.2, 0.4, 0.4), Vec3i(16, 4, 4), 1e5);
  flesh.placement.position.y() += 0.3;
  scene.joints.back().has_control = true;
  scene.joints.back().control.target.sinusoid = {{Vec3(0, 0, 30), 0, 0.5, 0}};
  for (scene::RigidBody& link : scene.rigid) link.placement.position.y() += 0.3;
  scene.joints.back().world.position->y() += 0.3;
  Simulation whole(scene, test::plan(scene)), resumed(scene, test::plan(scene));
  for (int i = 0; i < 4; ++i) whole.advance_frame();
  resumed.load_state(whole.save_state());
  for (int i = 0; i < 3; ++i) {
    whole.advance_frame();
    resumed.advance_frame();
    EXPECT_EQ(whole.stats().hash, resumed.stats().hash) << i;
  }
}

// Zero-length springs act on flesh and bone with equal and opposite forces at one place, so they give no
// momentum, and they return the flesh to its bone.
TEST(Embedding, SoftBindingsKeepMomentumAndComeToRest) {
  scene::Scene scene = block_with_bone(1e5, 200);
  scene.deformable[0].attach_springs = scene::AttachSprings{1e4, 1};
  scene.rigid[0].placement.velocity = Vec3(3, -1, 2);
  scene.rigid[0].placement.angular_velocity = Vec3(0, 2, 1);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  World& world = simulation.world();
  ASSERT_GE(world.bodies.forces.zero_length_springs.size(), 8u);
  const Momentum start = momentum(world.bodies);
  double defect = 0;
  for (int frame = 0; frame < 24; ++frame) {
    simulation.advance_frame();
    for (const Stage stage : {Stage::re_evaluation, Stage::damping_at_end}) {
      defect = std::max(defect, world.ledger[stage].linear_defect / start.linear.norm());
      defect = std::max(defect, world.ledger[stage].angular_defect / start.angular.norm());
    }
  }
  test::expect_below(defect, 1e-10, "defect_of_a_stage");
  test::expect_below((momentum(world.bodies).linear - start.linear).norm() / start.linear.norm(), 1e-10,
                     "linear_momentum");
  double off = 0;
  for (const ZeroLengthSpring& tether : world.bodies.forces.zero_length_springs.all())
    off = std::max(off, (world.bodies.particles.x[static_cast<std::size_t>(tether.a)] -
                         world.bodies.particles.x[static_cast<std::size_t>(tether.b)])
                            .norm());
  test::expect_below(off, 1e-2,
                     // The centrifugal acceleration is some (2/s)^2 0.5 m, and the springs have 1e4/s^2.
                     "flesh off its bone, m");
}

// Flesh on a static bone hangs from its springs alone. At rest their force is its weight, whatever their
// stiffness.
TEST(Embedding, SoftBindingsCarryTheWeightOfTheirFlesh) {
  test::Cases cases(2);  // 1 of 2
  for (const double gain : {1e3, 1e4}) {
    if (!cases.takes()) continue;
    scene::Scene scene = block_with_bone(1e6, 50);
    scene.gravity = Vec3(0, -9.8, 0);
    scene.rigid[0].mass.reset();
    scene.rigid[0].is_static = true;
    scene.deformable[0].attach_springs = scene::AttachSprings{gain, 1};
    scene.solver.cg_tolerance = 1e-6;  // the residual of a solve acts as a force for a step
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 96; ++frame) simulation.advance_frame();
    const Bodies& bodies = simulation.world().bodies;
    double weight = 0, pull = 0;
    for (const ZeroLengthSpring& tether : bodies.forces.zero_length_springs.all())
      pull += tether.stiffness * (bodies.particles.x[static_cast<std::size_t>(tether.b)] -
                                  bodies.particles.x[static_cast<std::size_t>(tether.a)])
                                     .y();
    for (const double mass : bodies.particles.mass) weight += 9.8 * mass;
    EXPECT_NEAR(pull / weight, 1, 2e-3);
  }
}

// Every particle of undamped flesh is attached to a static bone, with springs of about the frequency of its
// elements. The frequencies of both add up; steps that followed the larger one alone were unstable in the
// preset `draft`.
TEST(Embedding, SoftBindingsAreStableAtAnyGain) {
  for (const double gain : {0.3, 1.0, 3.0}) {
    scene::Scene scene = block_with_bone(1e5, 50);
    scene.rigid[0].shape = {.kind = scene::ShapeKind::box, .size = Vec3::Constant(1.2)};
    scene.rigid[0].mass.reset();
    scene.rigid[0].is_static = true;
    scene.materials[0].damping = 0;
    scene.solver.cfl = 0.9;
    scene.deformable[0].attach_springs = scene::AttachSprings{1e-3, 0};
    const Simulation loose(scene, test::plan(scene));
    const double of_elements = loose.world().bodies.forces.rest_omega_squared();
    scene.deformable[0].attach_springs->gain = gain * of_elements;
    Simulation simulation(scene, test::plan(scene));
    World& world = simulation.world();
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform(-1e-4, 1e-4);
    for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
      if (!is_held(world.bodies.particles, p))
        for (int k = 0; k < 3; ++k) world.bodies.particles.v[p][k] = uniform(random);
    const double start = test::mechanical_energy(world);
    double most = start;
    for (int i = 0; i < 200; ++i) {
      step(world, 0, choose_time_step(world, 0));
      most = std::max(most, test::mechanical_energy(world));
    }
    test::expect_below(most / start, 3, fmt::format("energy over that at the start, gain {}", gain));
  }
}

// A bone without particles inside it is a mistake of the scene, and building must fail.
TEST(Embedding, ABoneThatHoldsNothingIsReported) {
  scene::Scene scene = block_with_bone(1e5, 50);
  scene.rigid[0].placement.position = Vec3(5, 0, 0);
  EXPECT_THROW(Simulation(scene, test::plan(scene)), Error);
}

// A static bone holds its flesh up, and a kinematic bone moves its flesh at its own velocity.
TEST(Embedding, StaticAndKinematicBonesHoldTheirFlesh) {
  for (const bool moves : {false, true}) {
    scene::Scene scene = block_with_bone(1e5, 50);
    scene.gravity = Vec3(0, -9.8, 0);
    scene::RigidBody& bone = scene.rigid[0];
    bone.mass.reset();
    bone.is_static = !moves;
    bone.is_kinematic = moves;
    if (moves) bone.motion.spin = {{Vec3::UnitY(), 0.25, 0, {}, 0}};
    Simulation simulation(scene, test::plan(scene));
    for (int frame = 0; frame < 24; ++frame) simulation.advance_frame();
    const Bodies& bodies = simulation.world().bodies;
    Vec3 center = Vec3::Zero();
    for (const Vec3& x : bodies.particles.x) center += x / static_cast<double>(bodies.particles.size());
    EXPECT_LT(center.norm(), 0.1);
    // The particle at a corner has gone about with the bone by a quarter of a turn: from (-, -) to (-, +) in
    // x and z.
    const Vec3& corner = bodies.particles.x[0];
    EXPECT_LT(corner.x(), 0);
    EXPECT_EQ(corner.z() > 0, moves);
    EXPECT_GT(simulation.stats().min_det_F, 0.3);
  }
}

// Ratios of mass and moduli range from flesh that hardly feels its bone to a bone that hardly feels its
// flesh. No particle gets faster than four times the speed that the fall can give it.
TEST(Embedding, NothingExplodesWhateverTheMassesAndTheModulus) {
  for (const double youngs_modulus : {1e3, 1e5, 1e7})
    for (const double ratio : {1e-2, 1.0, 1e3}) {
      scene::Scene scene = block_with_bone(youngs_modulus, 1000 * ratio);
      scene.gravity = Vec3(0, -9.8, 0);
      scene.ground = scene::Ground{.height = -0.7, .look = {}};
      scene.rigid[0].placement.velocity = Vec3(0, -5, 0);
      scene.deformable[0].placement.velocity = Vec3(0, -5, 0);
      Simulation simulation(scene, test::plan(scene));
      const double most = 5 + std::sqrt(2 * 9.8);
      double largest = 0;
      for (int frame = 0; frame < (youngs_modulus > 1e6 ? 3 : 12); ++frame) {
        simulation.advance_frame();
        largest = std::max(largest, max_speed(simulation.world()));
      }
      test::expect_below(largest, 4 * most, fmt::format("speed_at_{:.0e}_Pa_{:.0e}", youngs_modulus, ratio));
    }
}

// Two bones with a controlled joint bend the flesh around them. The control acts inside the body, so the
// momentum of the whole stays zero and no stage has a defect.
TEST(Embedding, ControlledBonesBendTheirFlesh) {
  scene::Scene scene = test::free_space();
  add_bones_in_flesh(scene, Vec3(2.4, 0.5, 0.5), test::runs_in_full() ? Vec3i(24, 5, 5) : Vec3i(12, 4, 4),
                     2e5);
  scene::Joint& joint = scene.joints.back();
  joint.has_control = true;
  joint.control.gain = 200;
  joint.control.target.turn = Vec3(0, 0, 40);
  Simulation simulation(scene, test::plan(scene));
  simulation.keep_ledger();
  World& world = simulation.world();
  double defect = 0;
  for (int frame = 0; frame < 24; ++frame) {
    simulation.advance_frame();
    for (const Stage stage : {Stage::advance_velocity, Stage::collided_joints, Stage::control, Stage::contact,
                              Stage::re_evaluation, Stage::control_at_end, Stage::contact_at_end}) {
      defect = std::max(defect, world.ledger[stage].linear_defect);
      defect = std::max(defect, world.ledger[stage].angular_defect);
    }
  }
  const RigidBodies& rigid = world.bodies.rigid;
  const Joint& built = world.bodies.articulation.joints[0];
  const double angle = angle_of(JointFrames(built, rigid.state[0].pose, rigid.state[1].pose));
  const Vec3 turned = logarithm(JointFrames(built, rigid.state[0].pose, rigid.state[1].pose).relative());
  test::expect_below(std::abs(turned.norm() - 40 * EIGEN_PI / 180), 0.01, "error_of_the_angle");
  test::record_margin("twist", angle, "rad");
  test::expect_below(JointSolver::drift(world.bodies.articulation, rigid).gap, 1e-9, "gap");
  // The parts exchanged momenta of some 100 kg m/s, so the bounds are rounding.
  test::expect_below(defect, 1e-8, "defect_of_a_stage");
  test::expect_below(momentum(world.bodies).linear.norm(), 1e-8, "linear_momentum");
}

// Returns the elastic energy (J) that two controlled bones have stored in the flesh that they bend by 40
// degrees.
double bent_energy(scene::Integration integration, double longest_step) {
  scene::Scene scene = test::free_space();
  add_bones_in_flesh(scene, Vec3(2.4, 0.5, 0.5), Vec3i(12, 4, 4), 2e5);
  scene.solver.integration = integration;
  scene.solver.max_time_step = longest_step;
  scene::Joint& joint = scene.joints.back();
  joint.has_control = true;
  joint.control.gain = 200;
  joint.control.target.turn = Vec3(0, 0, 40);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 72; ++frame) simulation.advance_frame();
  return simulation.stats().elastic;
}

// Controls bend flesh as far in implicit steps of any length as in explicit ones. The forces of control were
// unknown to the solve of flesh once, and of 335 J were left 33 J in steps of 20 ms.
TEST(Embedding, ControlledBonesAreAsStrongInImplicitSteps) {
  const double expected = bent_energy(scene::Integration::semi_implicit, 1);
  for (const double longest : {1.0, 5e-3, 1e-3}) {
    if (longest < 2e-3 && !test::runs_in_full()) continue;
    test::expect_below(std::abs(bent_energy(scene::Integration::implicit, longest) / expected - 1), 1e-3,
                       fmt::format("energy, relative to semi-implicit steps, steps of {} s", longest));
  }
}

}  // namespace
}  // namespace duet::embedding_test
