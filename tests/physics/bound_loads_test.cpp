// Flesh that `attach` binds to a bone off its center: bone and load turn, fall and swing as one composite
// body.
#include <cmath>

#include "tests/support/articulated.h"
#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/random_scenes.h"
#include <fmt/format.h>

#include "sim/base/rotation.h"
#include "sim/geometry/level_set/grid_level_set.h"
#include "sim/step/step.h"

namespace duet::bound_loads_test {
namespace {

// Adds a soft box of the given size (m) and 1000 kg/m^3 at `position` (m), attached to `bone`. It is bound as
// a whole if it lies inside the bone.
scene::DeformableBody& add_load(scene::Scene& scene, const std::string& bone, const Vec3& position,
                                double size) {
  scene::DeformableBody& load = test::add_soft_box(scene, fmt::format("load{}", scene.deformable.size()),
                                                   position, Vec3::Constant(size), 2, 1e6);
  load.attach = {bone};
  return load;
}

// Returns mass (kg), center of mass (m) and angular momentum about it (kg m^2/s) of everything that moves.
struct Total {
  double mass = 0;
  Vec3 center = Vec3::Zero(), velocity = Vec3::Zero(), spin = Vec3::Zero();
};
Total total_of(const Bodies& bodies) {
  Total total;
  const auto add = [&](double mass, const Vec3& x) {
    total.mass += mass;
    total.center += mass * x;
  };
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    add(bodies.particles.mass[p], bodies.particles.x[p]);
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    add(bodies.rigid.properties[i].mass, bodies.rigid.state[i].pose.position);
  total.center /= total.mass;
  const Momentum momentum = duet::momentum(bodies);
  total.velocity = momentum.linear / total.mass;
  total.spin = momentum.angular - total.center.cross(momentum.linear);
  return total;
}

// A bar on a hinge in its middle holds loads of 8 and 27 kg, a third of them bound, at 0.7 m on both sides.
// After a short time t from rest the angular momentum about the hinge is (sum m g x) t.
TEST(BoundLoads, ABalanceFeelsTheTorqueOfItsLoads) {
  scene::Scene scene;
  test::add_peg(scene, "peg", Vec3::Zero());
  test::add_box(scene, "bar", Vec3::Zero(), Vec3(2, 0.14, 0.14), 5);
  test::add_joint(scene, scene::JointType::hinge, "peg", "bar", Vec3::Zero(), Vec3::UnitZ());
  add_load(scene, "bar", Vec3(0.7, 0, 0), 0.2);
  add_load(scene, "bar", Vec3(-0.7, 0, 0), 0.3);
  scene.fps = 1000;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  double bound = 0;
  for (const EmbeddedParticle& b : bodies.bound) bound += b.mass;
  ASSERT_GT(bound, 2);
  simulation.advance_frame();
  const double torque = 9.8 * 0.7 * (27 - 8);
  test::expect_below(std::abs(momentum(bodies).angular.z() / (torque * 1e-3) - 1), 1e-3, "torque_error");
}

// A bone that is thrown and spun, with flesh bound to one end: the common center of mass moves on a parabola,
// and the angular momentum about it stays.
TEST(BoundLoads, AThrownBoneFliesAboutTheCommonCenter) {
  for (const double size : {0.2, 0.5}) {  // bound as a whole, and in part
    scene::Scene scene;
    scene::RigidBody& bone = test::add_box(scene, "bone", Vec3::Zero(), Vec3(2, 0.3, 0.3), 5);
    bone.placement.velocity = Vec3(1, 4, 0);
    bone.placement.angular_velocity = Vec3(1, 2, 3);
    scene::DeformableBody& load = add_load(scene, "bone", Vec3(0.7, 0.02, -0.03), size);
    load.placement.velocity =
        bone.placement.velocity + bone.placement.angular_velocity.cross(load.placement.position);
    load.placement.angular_velocity = bone.placement.angular_velocity;
    Simulation simulation(scene, test::plan(scene));
    const Bodies& bodies = simulation.world().bodies;
    const Total start = total_of(bodies);
    EXPECT_GT(start.center.x(), 0.3);
    const Vec3 expected = bone.placement.velocity + bone.placement.angular_velocity.cross(start.center);
    EXPECT_LT((start.velocity - expected).norm(), 1e-12);
    double off = 0, turned = 0;
    for (int frame = 1; frame <= 24; ++frame) {
      simulation.advance_frame();
      const Total now = total_of(bodies);
      const double t = frame / scene.fps;
      const Vec3 there = start.center + t * start.velocity + t * t / 2 * scene.gravity;
      off = std::max(off, (now.center - there).norm());
      turned = std::max(turned, (now.spin - start.spin).norm() / start.spin.norm());
    }
    test::expect_below(off, 1e-11, fmt::format("off_the_parabola_{}", size));
    test::expect_below(turned, 1e-10, fmt::format("angular_momentum_{}", size));
  }
}

// A rod of 5 kg that hangs on a hinge has a load of 8 kg bound at its end:
//     T = 2 pi sqrt(I / (m g d)) (1 + a^2 / 16)
// with the inertia I of rod and particles about the hinge, at the amplitude a = 5 degrees.
TEST(BoundLoads, APendulumSwingsWithTheCompositePeriod) {
  scene::Scene scene;
  scene.fps = 96;
  scene.solver.max_time_step = 1.0 / 96;
  const double a = 5 * EIGEN_PI / 180;
  const Vec3 along(std::sin(a), -std::cos(a), 0);
  test::add_peg(scene, "peg", Vec3::Zero());
  scene::RigidBody& rod = test::add_box(scene, "rod", 0.5 * along, Vec3(0.3, 1, 0.3), 5);
  rod.placement.orientation = Quat(Eigen::AngleAxisd(a, Vec3::UnitZ()));
  test::add_joint(scene, scene::JointType::hinge, "peg", "rod", Vec3::Zero(), Vec3::UnitZ());
  add_load(scene, "rod", 0.8 * along, 0.2).placement.orientation = rod.placement.orientation;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  double inertia = 5 * ((1 + 0.09) / 12 + 0.25), moment = 5 * 0.5, loads = 0;
  for (const EmbeddedParticle& b : bodies.bound) {
    const Vec3& x = bodies.particles.x[b.particle];
    inertia += b.mass * (x.x() * x.x() + x.y() * x.y());
    moment += b.mass * x.dot(along);
    loads += b.mass;
  }
  ASSERT_NEAR(loads, 8, 1e-9);  // all of it
  const double period = 2 * EIGEN_PI * std::sqrt(inertia / (9.8 * moment)) * (1 + a * a / 16);
  std::vector<double> passages;  // s, downward through the vertical
  double before = a;
  while (passages.size() < 4 && simulation.frame() < 96 * 10) {
    simulation.advance_frame();
    const Vec3 at = shape_pose(bodies.rigid, 1).position;
    const double angle = std::atan2(at.x(), -at.y());
    if (before > 0 && angle <= 0) passages.push_back((simulation.frame() - angle / (angle - before)) / 96);
    before = angle;
  }
  ASSERT_EQ(passages.size(), 4u);
  test::expect_below(std::abs((passages.back() - passages.front()) / (3 * period) - 1), 1e-3, "period_error");
}

// A ball of 1 m with a load bound low in it rights itself. Rolling without sliding, at small angles:
//     w^2 = m g h / (I + m (r - h)^2)
// with the mass m, the distance h of the center of mass below the middle, and the inertia I about the former.
TEST(BoundLoads, ALoadedBallRocksOnItsShape) {
  scene::Scene scene = test::on_ground(1, 0);
  scene.fps = 96;
  const double a = 0.1, r = 0.5;  // rad, m
  scene::RigidBody& ball = test::add_ball(scene, "ball", Vec3(0, r, 0), r, 100);
  ball.friction = 1;
  ball.placement.orientation = Quat(Eigen::AngleAxisd(a, Vec3::UnitZ()));
  add_load(scene, "ball", Vec3(0, r, 0) + ball.placement.orientation * Vec3(0, -0.25, 0), 0.3)
      .placement.orientation = ball.placement.orientation;
  Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  const RigidProperties& properties = bodies.rigid.properties[0];
  ASSERT_TRUE(properties.shape_frame.has_value());
  const double h = (shape_pose(bodies.rigid, 0).position - bodies.rigid.state[0].pose.position).norm();
  ASSERT_GT(h, 0.04);
  const Vec3 axis = bodies.rigid.state[0].pose.orientation.conjugate() * Vec3::UnitZ();
  const double inertia = axis.dot(properties.inertia.cwiseProduct(axis));
  const double period =
      2 * EIGEN_PI / std::sqrt(properties.mass * 9.8 * h / (inertia + properties.mass * (r - h) * (r - h)));
  std::vector<double> passages;
  double before = a, depth = 0;
  while (passages.size() < 3 && simulation.frame() < 96 * 12) {
    simulation.advance_frame();
    const Pose pose = shape_pose(bodies.rigid, 0);
    depth = std::max(depth, std::abs(pose.position.y() - r));
    const Vec3 up = pose.orientation * Vec3::UnitY();
    const double angle = std::atan2(-up.x(), up.y());
    if (before > 0 && angle <= 0) passages.push_back((simulation.frame() - angle / (angle - before)) / 96);
    before = angle;
  }
  ASSERT_EQ(passages.size(), 3u);
  test::expect_below(std::abs((passages.back() - passages.front()) / (2 * period) - 1), 1e-2, "period_error");
  test::expect_below(depth, 1e-3, "middle_off_its_height");
}

// The pose that is written is that of the bone as the scene places it, whatever flesh it holds.
TEST(BoundLoads, LeaveThePoseThatIsWritten) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3(1, 2, 3), Vec3(2, 0.3, 0.3), 5);
  bone.placement.orientation = Quat(Eigen::AngleAxisd(0.4, Vec3(1, 2, 2) / 3));
  bone.placement.velocity = Vec3(1, -2, 3);
  bone.placement.angular_velocity = Vec3(3, 2, 1);
  Simulation alone(scene, test::plan(scene));
  add_load(scene, "bone", bone.placement.orientation * Vec3(0.7, 0.03, 0.02) + Vec3(1, 2, 3), 0.4);
  Simulation loaded(scene, test::plan(scene));
  ASSERT_TRUE(loaded.world().bodies.rigid.properties[0].shape_frame.has_value());
  std::vector<RigidMotion> one, other;
  alone.rigid_motion(one);
  loaded.rigid_motion(other);
  EXPECT_LT((one[0].pose.position - other[0].pose.position).norm(), 1e-14);
  EXPECT_LT(one[0].pose.orientation.angularDistance(other[0].pose.orientation), 1e-14);
  EXPECT_LT((one[0].velocity - other[0].velocity).norm(), 1e-13);
  EXPECT_LT((one[0].angular_velocity - other[0].angular_velocity).norm(), 1e-14);
  std::vector<BodySurface> first, second;
  alone.surfaces(first);
  loaded.surfaces(second);
  for (std::size_t i = 0; i < first[0].surface.positions.size(); ++i)
    EXPECT_LT((first[0].surface.positions[i] - second[0].surface.positions[i]).norm(), 1e-14);
}

// Joints between loaded bones sit where the scene puts them, and stay closed; a resumed run has the same
// bits.
TEST(BoundLoads, JointsStayClosedAndRunsResumeToTheSameBits) {
  scene::Scene scene = test::on_ground();
  test::add_chain(scene, 3, scene::JointType::hinge, true);
  for (scene::RigidBody& body : scene.rigid) {
    body.placement.position.y() += 0.5;
    if (!body.is_static) body.shape.size = Vec3(1, 0.25, 0.25);
  }
  for (scene::Joint& joint : scene.joints) joint.world.position->y() += 0.5;
  for (const int i : {0, 2}) add_load(scene, fmt::format("link{}", i), Vec3(i + 0.75, 0.52, 0.03), 0.3);
  Simulation whole(scene, test::plan(scene)), resumed(scene, test::plan(scene));
  const Bodies& bodies = whole.world().bodies;
  test::expect_below(JointSolver::drift(bodies.articulation, bodies.rigid).gap, 1e-14, "gap_at_the_start");
  for (int i = 0; i < 8; ++i) whole.advance_frame();
  resumed.load_state(whole.save_state());
  for (int i = 0; i < 8; ++i) {
    whole.advance_frame();
    resumed.advance_frame();
    EXPECT_EQ(whole.stats().hash, resumed.stats().hash) << i;
  }
  test::expect_below(JointSolver::drift(bodies.articulation, bodies.rigid).gap, 1e-9, "gap");
  test::expect_below(whole.stats().max_penetration, 1e-3, "penetration");
}

// Returns the largest difference of position (m) or orientation (rad) between two runs of a random heap of
// bodies with equal principal moments, one with body spaces turned away from the axes of the shapes.
double difference_of_turned_axes(std::uint64_t seed) {
  test::Draw draw(seed);
  scene::Scene scene = test::on_ground(0.4, 0.3);
  scene.fps = 960;
  scene.solver.max_time_step = 1.0 / 960;
  for (int i = 0; i < 12; ++i) {
    scene::Shape shape = test::random_shape(draw, 1);
    while (shape.kind == scene::ShapeKind::sphere) shape = test::random_shape(draw, 1);
    const Vec3 place(0.6 * (i % 3), 0.4 + 0.45 * (i / 3), 0.1 * (i % 2));
    scene::RigidBody& body = test::add_box(scene, fmt::format("body{}", i), place, Vec3::Ones(), 20);
    body.shape = shape;
    body.placement.orientation = exponential(draw(0, 3) * draw.direction());
    body.placement.velocity = Vec3(0, -2, 0);
    body.placement.angular_velocity = 3 * draw.direction();
  }
  test::add_soft_box(scene, "soft", Vec3(0.6, 0.3, -0.5), Vec3(1, 0.4, 0.4), 3, 1e5);
  Simulation plain(scene, test::plan(scene)), turned(scene, test::plan(scene));
  for (Simulation* one : {&plain, &turned}) {
    RigidBodies& rigid = one->world().bodies.rigid;
    for (std::size_t i = 0; i < 12; ++i) {
      RigidProperties& properties = rigid.properties[i];
      properties.inertia = Vec3::Constant(properties.inertia.mean());
      const Vec3 w = rigid.state[i].angular_velocity;
      if (one == &turned)
        move_body_space({Vec3::Zero(), exponential(draw(0.5, 2) * draw.direction())}, rigid.state[i],
                        properties);
      set_angular_velocity(rigid.state[i], properties, w);
    }
  }
  const RigidBodies &first = plain.world().bodies.rigid, &second = turned.world().bodies.rigid;
  std::int64_t contacts = 0;
  double off = 0;
  for (int frame = 0; frame < 240; ++frame) {
    plain.advance_frame();
    turned.advance_frame();
    contacts += plain.stats().contacts;
    for (std::size_t i = 0; i < 12; ++i) {
      const Pose a = shape_pose(first, i), b = shape_pose(second, i);
      off = std::max({off, (a.position - b.position).norm(), a.orientation.angularDistance(b.orientation)});
    }
  }
  EXPECT_GT(contacts, 1000);
  return off;
}

// The inertia of a body with equal principal moments is the same in all axes, so that the motion does not
// depend on the axes of body space: turned away from those of the shape, it gives the motion of contact,
// joints and flesh to rounding. The bound is that of solvers that stop an iteration earlier or later, of
// which impacts make up to 4e-6; an impact that rounding puts into one step or the next makes 1e-4 and more.
// Balls are left out; with a turned body space they do not count as balls.
TEST(BoundLoads, ContactDoesNotDependOnTheAxesOfBodySpace) {
  const std::uint64_t last = test::runs_in_full() ? 40 : 14;
  for (std::uint64_t seed = 11; seed <= last; ++seed)
    test::expect_below(difference_of_turned_axes(seed), 1e-5, fmt::format("difference_of_poses_{}", seed));
}

// Gives a mesh body the center of mass `center` (m) in its shape: by a body space that has moved there, or by
// a shape whose coordinates have. Mass and inertia stay.
void move_center(Simulation& simulation, const TriangleMesh& mesh, int cells, double spacing,
                 const Vec3& center, bool by_body_space) {
  RigidProperties& properties = simulation.world().bodies.rigid.properties[0];
  RigidState& state = simulation.world().bodies.rigid.state[0];
  const Vec3 w = state.angular_velocity;
  move_body_space({center, Quat::Identity()}, state, properties);
  set_angular_velocity(state, properties, w);
  if (by_body_space) return;
  properties.shape_frame.reset();
  const TriangleMesh moved = in_frame(mesh, 1, {center, Quat::Identity()});
  properties.shape = LevelSet::mesh(std::make_shared<const GridLevelSet>(moved, cells));
  for (std::vector<Vec3>* points : {&properties.samples, &properties.inside})
    for (Vec3& x : *points) x -= center;
  properties.feature_edges =
      find_feature_edges(moved, properties.shape, properties.samples, properties.inside, spacing);
}

// A mesh with its center of mass off the middle lands on the ground, on a ball and on a soft slab. Where its
// body space has moved there it moves as one whose shape has moved instead.
TEST(BoundLoads, ContactDoesNotDependOnTheOriginOfTheShape) {
  const auto mesh = std::make_shared<TriangleMesh>(test::box_mesh(-Vec3(0.5, 0.3, 0.2), Vec3(0.5, 0.3, 0.2)));
  for (const double soft : {0.0, 1.0}) {
    scene::Scene scene = test::on_ground(0.4, 0.3);
    scene.fps = 240;
    scene.solver.max_time_step = 1.0 / 480;
    scene::RigidBody& body = test::add_mesh(scene, "body", mesh, 1, 20);
    body.shape.cells = 32;
    body.sample_spacing = 0.1;
    body.placement.position = Vec3(0, 1.2, 0);
    body.placement.orientation = exponential(Vec3(0.3, 0.2, 0.5));
    body.placement.angular_velocity = Vec3(1, 2, 3);
    test::add_ball(scene, "ball", Vec3(0.4, 0.3, 0.1), 0.3, 10);
    if (soft > 0) test::add_soft_box(scene, "soft", Vec3(-0.4, 0.2, 0), Vec3(0.8, 0.4, 1), 3, 1e5);
    Simulation one(scene, test::plan(scene)), other(scene, test::plan(scene));
    const Vec3 center(0.3, 0.06, -0.04);
    move_center(one, *mesh, 32, 0.1, center, true);
    move_center(other, *mesh, 32, 0.1, center, false);
    std::int64_t contacts = 0;
    double off = 0;
    for (int frame = 0; frame < 240; ++frame) {
      one.advance_frame();
      other.advance_frame();
      contacts += one.stats().contacts;
      const Pose &a = one.world().bodies.rigid.state[0].pose, &b = other.world().bodies.rigid.state[0].pose;
      off = std::max({off, (a.position - b.position).norm(), a.orientation.angularDistance(b.orientation)});
    }
    EXPECT_GT(contacts, 100);
    test::expect_below(off, 1e-6, fmt::format("difference_of_poses_{}", soft));
  }
}

// A bone whose flesh is released goes on in the same rigid motion: momentum stays.
TEST(BoundLoads, ReleasedFleshLeavesItsBoneWithItsMomentum) {
  scene::Scene scene = test::free_space();
  scene::RigidBody& bone = test::add_box(scene, "bone", Vec3::Zero(), Vec3(2, 0.3, 0.3), 5);
  bone.placement.velocity = Vec3(1, 4, 0);
  bone.placement.angular_velocity = Vec3(1, 2, 3);
  add_load(scene, "bone", Vec3(0.7, 0.02, -0.03), 0.4);
  Simulation simulation(scene, test::plan(scene));
  for (int i = 0; i < 4; ++i) simulation.advance_frame();
  const Momentum before = momentum(simulation.world().bodies);
  std::vector<RigidMotion> one, other;
  simulation.rigid_motion(one);
  simulation.release("load0");
  const Momentum after = momentum(simulation.world().bodies);
  simulation.rigid_motion(other);
  EXPECT_FALSE(simulation.world().bodies.rigid.properties[0].shape_frame.has_value());
  EXPECT_LT((one[0].pose.position - other[0].pose.position).norm(), 1e-13);
  EXPECT_LT((one[0].velocity - other[0].velocity).norm(), 1e-12);
  test::expect_below((after.linear - before.linear).norm() / before.linear.norm(), 1e-12, "linear_momentum");
  test::expect_below((after.angular - before.angular).norm() / before.angular.norm(), 1e-12,
                     "angular_momentum");
}

}  // namespace
}  // namespace duet::bound_loads_test
