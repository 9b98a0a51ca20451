// Forces and pressures of contact that frames report: they are those that moved the bodies, so that they
// explain every change of momentum, and they are known on paper for bodies at rest and sliding ones.
#include <cmath>
#include <functional>

#include "tests/support/margin.h"
#include "tests/support/meshes.h"
#include "tests/support/thin_bodies.h"
#include <fmt/format.h>

#include "sim/step/world.h"

namespace duet::contact_loads_test {
namespace {

// What the bodies of a scene carry at a frame, and where the points of deformable bodies are.
struct Measured {
  ContactLoads loads;
  std::vector<BodySurface> surfaces;
  std::size_t rigid;  // number of rigid bodies

  explicit Measured(const Simulation& simulation) {
    simulation.surfaces(surfaces);
    simulation.contact_loads(surfaces, loads);
    rigid = loads.rigid_force.size();
  }
  // Returns the index of the first point of a deformable body; the bodies count from 0.
  std::size_t first_point(std::size_t body) const {
    std::size_t first = 0;
    for (std::size_t i = 0; i < body; ++i) first += surfaces[rigid + i].surface.positions.size();
    return first;
  }
  // Returns the sum of the forces (N) on the points of a deformable body that `counts` accepts.
  Vec3 force(std::size_t body, const std::function<bool(const Vec3&)>& counts = {}) const {
    Vec3 sum = Vec3::Zero();
    const std::vector<Vec3>& x = surfaces[rigid + body].surface.positions;
    for (std::size_t i = 0; i < x.size(); ++i)
      if (!counts || counts(x[i])) sum += loads.force[first_point(body) + i].cast<double>();
    return sum;
  }
};

// Returns the momentum of the particles of a deformable body, kg m/s.
Vec3 momentum_of(const World& world, std::size_t body) {
  const Particles& particles = world.bodies.particles;
  Vec3 sum = Vec3::Zero();
  for_each_particle(world.bodies.deformable[body],
                    [&](std::size_t p) { sum += particles.mass[p] * particles.v[p]; });
  return sum;
}

// Advances the scene by `frames` frames. Expects that in each the forces on every body times the time of the
// frame make up for its change of momentum less the weight, to `bound` times the weight.
void expect_forces_explain_momentum(const scene::Scene& scene, int frames, double bound,
                                    const std::string& what) {
  Simulation simulation(scene, test::plan(scene));
  const World& world = simulation.world();
  const double time = 1 / scene.fps;
  double worst = 0, most = 0;
  for (int frame = 0; frame < frames; ++frame) {
    std::vector<Vec3> soft, hard;
    for (std::size_t d = 0; d < scene.deformable.size(); ++d) soft.push_back(momentum_of(world, d));
    for (const RigidState& state : world.bodies.rigid.state) hard.push_back(state.velocity);
    simulation.advance_frame();
    const Measured now(simulation);
    const auto take = [&](const Vec3& force, const Vec3& gained, double mass) {
      const Vec3 expected = gained / time - mass * scene.gravity;
      worst = std::max(worst, (force - expected).norm() / (mass * scene.gravity.norm()));
      most = std::max(most, force.norm());
    };
    for (std::size_t d = 0; d < soft.size(); ++d)
      take(now.force(d), momentum_of(world, d) - soft[d], world.bodies.deformable[d].mass);
    for (std::size_t i = 0; i < scene.rigid.size(); ++i) {
      const RigidProperties& properties = world.bodies.rigid.properties[i];
      if (!properties.is_dynamic()) continue;
      take(now.loads.rigid_force[i], properties.mass * (world.bodies.rigid.state[i].velocity - hard[i]),
           properties.mass);
    }
  }
  test::expect_below(worst, bound, what + ": force without effect, over the weight");
  EXPECT_GT(most, 0) << what;
}

// Sums of floats err by 1e-7 of the forces, which impacts raise to some ten times the weight.
constexpr double rounding = 1e-5;

// Returns a soft box of 0.2 m that falls by `gap` (m) onto the ground.
scene::Scene falling_box(double gap = 0.02, double friction = 0.5) {
  scene::Scene scene = test::on_ground(friction);
  test::add_soft_box(scene, "box", Vec3(0, 0.1 + gap, 0), Vec3::Constant(0.2), 4, 1e5);
  scene.deformable[0].placement.velocity = Vec3(0.5, 0, 0.2);
  scene.materials[0].damping = 0.01;
  return scene;
}

TEST(ContactLoads, ExplainMomentumOfFallingSoftBoxes) {
  scene::Scene scene = falling_box();
  expect_forces_explain_momentum(scene, 8, rounding, "semi-implicit");
  scene.solver.velocity_constraints = scene::VelocityConstraints::before_solve;
  expect_forces_explain_momentum(scene, 8, rounding, "constraints before the solve");
  scene.solver.velocity_constraints = scene::VelocityConstraints::after_solve;
  scene.solver.integration = scene::Integration::implicit;
  expect_forces_explain_momentum(scene, 8, 0.01, "implicit");  // to the tolerance of its solves
}

TEST(ContactLoads, ExplainMomentumOfIncompressibleBoxes) {
  for (const auto order :
       {scene::VelocityConstraints::after_solve, scene::VelocityConstraints::before_solve}) {
    scene::Scene scene = falling_box();
    scene.deformable[0].incompressible = true;
    scene.solver.velocity_constraints = order;
    expect_forces_explain_momentum(scene, 6, rounding, "incompressible");
  }
}

TEST(ContactLoads, ExplainMomentumOfOverdampedBoxes) {
  scene::Scene scene = falling_box();
  scene.materials[0].damping = 1;
  expect_forces_explain_momentum(scene, 4, rounding, "overdamped");
}

TEST(ContactLoads, ExplainMomentumOfSkins) {
  for (const bool contact : {false, true}) {
    scene::Scene scene = falling_box(0.005);
    scene.deformable[0].skin.emplace();
    scene.deformable[0].skin->mesh =
        std::make_shared<TriangleMesh>(test::box_mesh(Vec3::Constant(-0.09), Vec3::Constant(0.09)));
    scene.deformable[0].skin->contact = contact;
    expect_forces_explain_momentum(scene, 8, rounding, contact ? "skin in contact" : "drawn skin");
  }
}

TEST(ContactLoads, ExplainMomentumOfClothAndRopes) {
  scene::Scene scene = test::on_ground();
  test::add_ball(scene, "ball", Vec3(0, 0.1, 0), 0.1, 1);
  test::add_material(scene, "cloth").density = 500;
  test::add_panel(scene, "sheet", Vec3(0, 0.25, 0), Vec2(0.6, 0.6), 8, 0.01);
  scene.deformable.back().self_collision = true;
  test::add_rope(scene, "rope", {Vec3(0.6, 0.05, -0.3), Vec3(0.6, 0.05, 0.3)}, 8, 0.02);
  expect_forces_explain_momentum(scene, 12, rounding, "sheet and rope");
}

// The bodies of a pile touch each other: rigid ones with soft ones, and soft ones with each other.
TEST(ContactLoads, ExplainMomentumOfPiles) {
  scene::Scene scene = falling_box(0.002);
  scene.deformable[0].placement.velocity.setZero();
  test::add_soft_box(scene, "second", Vec3(0.02, 0.31, 0), Vec3::Constant(0.2), 3, 1e5);
  for (scene::DeformableBody& body : scene.deformable) body.collision_thickness = 0.004;
  test::add_box(scene, "top", Vec3(0, 0.48, 0), Vec3(0.2, 0.1, 0.2), 1);
  test::add_box(scene, "hat", Vec3(0, 0.58, 0), Vec3(0.1, 0.1, 0.1), 1);
  expect_forces_explain_momentum(scene, 4, rounding, "pile");
}

// A soft box of 0.2 m at rest: F = m g, and in the middle of its lower face p = m g / area. The corners carry
// more, because the sides bulge.
TEST(ContactLoads, OfARestingSoftBoxAreItsWeight) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "box", Vec3(0, 0.1, 0), Vec3::Constant(0.2), 6, 1e6);
  scene.materials[0].damping = 0.02;
  scene.materials[0].poisson_ratio = 0;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 16; ++frame) simulation.advance_frame();
  const Measured now(simulation);
  const double weight = simulation.world().bodies.deformable[0].mass * 9.8;
  test::expect_below((now.force(0) - Vec3(0, weight, 0)).norm() / weight, 1e-3, "force less weight");
  const std::vector<Vec3>& x = now.surfaces[0].surface.positions;
  double worst = 0;
  int inner = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i].y() > 0.1) {
      EXPECT_EQ(now.loads.pressure[i], 0);
    }
    if (x[i].y() > 0.01 || std::max(std::abs(x[i].x()), std::abs(x[i].z())) > 0.05) continue;
    worst = std::max(worst, std::abs(double{now.loads.pressure[i]} * 0.04 / weight - 1));
    ++inner;
  }
  EXPECT_GE(inner, 9);
  test::expect_below(worst, 0.05, "pressure in the middle, over weight / area, less 1");
}

// While a box slides, friction is mu times the weight, against the motion.
TEST(ContactLoads, OfASlidingSoftBoxAreOnTheCone) {
  constexpr double mu = 0.3;
  scene::Scene scene = test::on_ground(mu);
  test::add_soft_box(scene, "box", Vec3(0, 0.05, 0), Vec3(0.3, 0.1, 0.3), 3, 1e6);
  scene.deformable[0].placement.velocity = Vec3(4, 0, 0);
  scene.materials[0].damping = 0.02;
  Simulation simulation(scene, test::plan(scene));
  const double weight = simulation.world().bodies.deformable[0].mass * 9.8;
  Vec3 mean = Vec3::Zero();
  for (int frame = 1; frame <= 12; ++frame) {
    simulation.advance_frame();
    if (frame > 4) mean += Measured(simulation).force(0) / 8;
  }
  test::expect_below(std::abs(mean.y() / weight - 1), 0.01, "vertical force over weight, less 1");
  test::expect_below(std::abs(mean.x() + mu * weight) / weight, 0.01, "friction less mu times weight");
}

// Two soft boxes on each other: what the upper one gets from the lower one, the lower one gets from it.
TEST(ContactLoads, OfSoftBoxesOnEachOtherAreOpposite) {
  scene::Scene scene = test::on_ground();
  for (const double y : {0.1, 0.304}) {
    test::add_soft_box(scene, y < 0.2 ? "lower" : "upper", Vec3(0, y, 0), Vec3::Constant(0.2), 3, 1e6);
    scene.deformable.back().collision_thickness = 0.004;
    scene.materials.back().damping = 0.02;
  }
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 16; ++frame) simulation.advance_frame();
  const Measured now(simulation);
  const double weight = simulation.world().bodies.deformable[0].mass * 9.8;
  const Vec3 on_top = now.force(0, [](const Vec3& x) { return x.y() > 0.1; });
  test::expect_below((now.force(1) + on_top).norm() / weight, 1e-5, "sum of action and reaction");
  test::expect_below((now.force(1) - Vec3(0, weight, 0)).norm() / weight, 2e-2, "force less weight");
  const std::vector<Vec3>& x = now.surfaces[1].surface.positions;
  double sum = 0;
  int inner = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (Vec3(x[i].x(), 0, x[i].z()).norm() > 0.05 || x[i].y() > 0.25) continue;
    sum += double{now.loads.pressure[now.first_point(1) + i]};
    ++inner;
  }
  EXPECT_EQ(inner, 4);
  test::expect_below(std::abs(sum / inner * 0.04 / weight - 1), 0.1, "mean pressure in the middle, less 1");
}

// A rigid box rests on a soft slab, off its middle: force and moment are those of its weight.
TEST(ContactLoads, OfARigidBoxOnASoftSlabAreItsWeight) {
  scene::Scene scene = test::on_ground();
  test::add_soft_box(scene, "slab", Vec3(0, 0.05, 0), Vec3(0.6, 0.1, 0.6), 4, 1e6);
  scene.materials.back().damping = 0.02;
  test::add_box(scene, "box", Vec3(0.05, 0.151, 0), Vec3(0.2, 0.1, 0.2), 4);
  test::add_box(scene, "wall", Vec3(3, 1, 0), Vec3(1, 1, 1), 4);
  scene.rigid.back().mass.reset();
  scene.rigid.back().is_static = true;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 14; ++frame) simulation.advance_frame();
  const Measured now(simulation);
  const double weight = 4 * 9.8;
  test::expect_below((now.loads.rigid_force[0] - Vec3(0, weight, 0)).norm() / weight, 1e-3,
                     "force less weight");
  test::expect_below(now.loads.rigid_torque[0].norm() / (0.1 * weight), 1e-3, "torque over weight by width");
  EXPECT_EQ(now.loads.rigid_force[1], Vec3::Zero());
  const Vec3 on_top = now.force(0, [](const Vec3& x) { return x.y() > 0.05; });
  test::expect_below((on_top + now.loads.rigid_force[0]).norm() / weight, 1e-5, "action and reaction");
}

// A static body gets what rests on it, and a body between two others gets both.
TEST(ContactLoads, OfRigidBodiesAddUp) {
  scene::Scene scene = test::on_ground();
  test::add_box(scene, "plate", Vec3(0, -0.05, 0), Vec3(1, 0.1, 1), 1);
  scene.rigid.back().mass.reset();
  scene.rigid.back().is_static = true;
  scene.ground.reset();
  test::add_box(scene, "lower", Vec3(0, 0.1, 0), Vec3::Constant(0.2), 2);
  test::add_box(scene, "upper", Vec3(0, 0.3, 0), Vec3::Constant(0.2), 3);
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 4; ++frame) simulation.advance_frame();
  const Measured now(simulation);
  EXPECT_NEAR(now.loads.rigid_force[0].y(), -5 * 9.8, 1e-3);
  EXPECT_NEAR(now.loads.rigid_force[1].y(), 2 * 9.8, 1e-3);
  EXPECT_NEAR(now.loads.rigid_force[2].y(), 3 * 9.8, 1e-3);
}

// A run that continues from a saved state reports the forces of the run that went on.
TEST(ContactLoads, AreThoseOfTheRunAfterARestart) {
  const scene::Scene scene = falling_box();
  Simulation simulation(scene, test::plan(scene)), resumed(scene, test::plan(scene));
  EXPECT_EQ(Measured(simulation).force(0), Vec3::Zero());
  for (int frame = 0; frame < 5; ++frame) simulation.advance_frame();
  resumed.load_state(simulation.save_state());
  EXPECT_EQ(Measured(resumed).force(0), Vec3::Zero());
  EXPECT_GT(Measured(simulation).force(0).norm(), 0);
  simulation.advance_frame();
  resumed.advance_frame();
  const ContactLoads a = Measured(simulation).loads, b = Measured(resumed).loads;
  EXPECT_EQ(a.force, b.force);
  EXPECT_EQ(a.pressure, b.pressure);
}

}  // namespace
}  // namespace duet::contact_loads_test
