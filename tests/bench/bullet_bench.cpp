// Falling boxes in Duet and, from the same start, in Bullet 3: N unit cubes in a loose lattice, each with a
// small random rotation, fall on a plane and pile up for three seconds. The counters of a simulation are:
//
//   s/s           wall seconds per simulated second
//   penetration   m, deepest overlap of any two boxes or of a box and the plane at the end of a frame
//   energy_gain   largest rise of kinetic + potential energy from the end of one frame to that of a later
//                 one, over the energy that the fall has set free; a dissipative simulation gains none
//   speed         m/s, root mean square over the bodies at the end
//
// One function measures the overlaps of both programs, and knows nothing of their collision detection.
// Bullet runs with its own defaults (10 iterations, contact margins, sleeping) at 240 steps per second.
// Duet's largest step is set to the same 1/240 s; its rule takes shorter ones where a body would travel too
// far.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <random>
#include <vector>

#include <benchmark/benchmark.h>
#include <btBulletDynamicsCommon.h>

#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"
#include "sim/step/world.h"

namespace duet {
namespace {

constexpr double seconds = 3, frames_a_second = 24, gravity = 9.8, friction = 0.5;
constexpr int steps_a_second = 240;
const Vec3 half = Vec3::Constant(0.5);  // m, of every box; each has a mass of 1 kg

// Motion of one box, in both programs.
struct Box {
  Pose pose;
  Vec3 velocity = Vec3::Zero(), angular_velocity = Vec3::Zero();
};

std::vector<Box> lattice(int side) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] {
    const double x = uniform(random), y = uniform(random);
    return Vec3(x, y, uniform(random));
  };
  std::vector<Box> boxes;
  for (int i = 0; i < side * side * side; ++i) {
    const Vec3 cell(i % side, i / side / side, i / side % side);
    Box box;
    box.pose.position = 1.4 * (cell - Vec3(side - 1, 0, side - 1) / 2) + Vec3(0, 1, 0) + 0.05 * vector();
    box.pose.orientation = Quat(Eigen::AngleAxisd(0.3 * uniform(random), vector().normalized()));
    boxes.push_back(box);
  }
  return boxes;
}

// Returns the deepest overlap in m. It takes the points of a 5 x 5 grid on every face and their exact
// distance to every other box and to the plane y = 0.
double deepest_overlap(const std::vector<Box>& boxes) {
  std::vector<Vec3> points;
  for (int i = 0; i < 125; ++i) {
    const Vec3 p = Vec3(i % 5, i / 5 % 5, i / 25) / 2 - Vec3::Ones();
    if (p.cwiseAbs().maxCoeff() == 1) points.push_back(p.cwiseProduct(half));
  }
  double deepest = 0;
  for (const Box& guest : boxes)
    for (const Vec3& point : points) {
      const Vec3 x = guest.pose.to_world(point);
      deepest = std::max(deepest, -x.y());
      for (const Box& host : boxes)
        if (&host != &guest && (x - host.pose.position).squaredNorm() < half.squaredNorm())
          deepest = std::max(deepest, (half - host.pose.to_body(x).cwiseAbs()).minCoeff());
    }
  return deepest;
}

double energy(const std::vector<Box>& boxes) {  // J; boxes of 1 kg and 1 m, so that m = 1 and I = 1/6
  double sum = 0;
  for (const Box& box : boxes)
    sum += 0.5 * box.velocity.squaredNorm() + 0.5 / 6 * box.angular_velocity.squaredNorm() +
           gravity * box.pose.position.y();
  return sum;
}

class DuetRun {
 public:
  explicit DuetRun(const std::vector<Box>& boxes) : simulation_(scene_of(boxes)) {}

  void advance_frame() { simulation_->advance_frame(); }
  std::vector<Box> boxes() const {
    std::vector<Box> boxes;
    const RigidBodies& rigid = simulation_->world().bodies.rigid;
    for (std::size_t i = 0; i < rigid.size(); ++i)
      if (rigid.properties[i].is_dynamic())
        boxes.push_back({rigid.state[i].pose, rigid.state[i].velocity, rigid.state[i].angular_velocity});
    return boxes;
  }

 private:
  static std::unique_ptr<Simulation> scene_of(const std::vector<Box>& boxes) {
    scene::Scene scene;
    scene.fps = frames_a_second;
    scene.gravity = Vec3(0, -gravity, 0);
    scene.ground = scene::Ground{.height = 0, .friction = friction, .restitution = 0, .look = {}};
    scene.solver.max_time_step = 1.0 / steps_a_second;
    for (const Box& box : boxes) {
      scene::RigidBody body;
      body.name = "box" + std::to_string(scene.rigid.size());
      body.shape.size = 2 * half;
      body.placement.position = box.pose.position;
      body.placement.orientation = box.pose.orientation;
      body.mass = 1;
      body.friction = friction;
      body.restitution = 0;
      scene.rigid.push_back(body);
    }
    return std::make_unique<Simulation>(scene, scene::plan_effects(scene).active());
  }

  std::unique_ptr<Simulation> simulation_;
};

btScalar single(double value) { return static_cast<btScalar>(value); }
btVector3 single(const Vec3& v) { return {single(v.x()), single(v.y()), single(v.z())}; }
Vec3 vector(const btVector3& v) { return Vec3(v.x(), v.y(), v.z()); }

class BulletRun {
 public:
  explicit BulletRun(const std::vector<Box>& boxes) {
    world_.setGravity(single(Vec3(0, -gravity, 0)));
    add(plane_, 0, {});
    for (const Box& box : boxes) add(cube_, 1, box.pose);
  }
  ~BulletRun() {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }
  BulletRun(const BulletRun&) = delete;
  BulletRun& operator=(const BulletRun&) = delete;

  void advance_frame() {
    for (int i = 0; i < steps_a_second / frames_a_second; ++i)
      world_.stepSimulation(single(1.0 / steps_a_second), 0);
  }
  std::vector<Box> boxes() const {
    std::vector<Box> boxes;
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      const btTransform& at = bodies_[i]->getWorldTransform();
      const btQuaternion q = at.getRotation();
      Box box;
      box.pose.position = vector(at.getOrigin());
      box.pose.orientation = Quat(q.w(), q.x(), q.y(), q.z()).normalized();
      box.velocity = vector(bodies_[i]->getLinearVelocity());
      box.angular_velocity = vector(bodies_[i]->getAngularVelocity());
      boxes.push_back(box);
    }
    return boxes;
  }

 private:
  void add(btCollisionShape& shape, double mass, const Pose& pose) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape.calculateLocalInertia(single(mass), inertia);
    btRigidBody::btRigidBodyConstructionInfo info(single(mass), nullptr, &shape, inertia);
    const Quat& q = pose.orientation;
    info.m_startWorldTransform = btTransform(
        btQuaternion(single(q.x()), single(q.y()), single(q.z()), single(q.w())), single(pose.position));
    // Bullet multiplies the coefficients of two bodies, so that a pair has `friction`.
    info.m_friction = single(std::sqrt(friction));
    bodies_.push_back(std::make_unique<btRigidBody>(info));
    world_.addRigidBody(bodies_.back().get());
  }

  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broad_phase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broad_phase_, &solver_, &configuration_};
  btStaticPlaneShape plane_{btVector3(0, 1, 0), 0};
  btBoxShape cube_{single(half)};
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

template <class Run>
void falling_boxes(benchmark::State& state) {
  const std::vector<Box> start = lattice(static_cast<int>(state.range(0)));
  double wall = 0, deepest = 0, gain = 0, speed = 0;
  for (auto _ : state) {
    Run run(start);
    double least = energy(start);
    const double first = least;
    for (int frame = 0; frame < seconds * frames_a_second; ++frame) {
      const auto before = std::chrono::steady_clock::now();
      run.advance_frame();
      wall += std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
      const std::vector<Box> boxes = run.boxes();
      deepest = std::max(deepest, deepest_overlap(boxes));
      gain = std::max(gain, energy(boxes) - least);
      least = std::min(least, energy(boxes));
    }
    gain /= first - least;
    for (const Box& box : run.boxes()) speed += box.velocity.squaredNorm();
    state.SetIterationTime(wall);
  }
  const auto count = static_cast<double>(start.size());
  state.counters["boxes"] = count;
  state.counters["s/s"] = wall / seconds;
  state.counters["penetration"] = deepest;
  state.counters["energy_gain"] = gain;
  state.counters["speed"] = std::sqrt(speed / count);
}

BENCHMARK_TEMPLATE(falling_boxes, DuetRun)
    ->Name("falling_boxes/duet")
    ->Arg(3)
    ->Arg(5)
    ->Arg(8)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kSecond);
BENCHMARK_TEMPLATE(falling_boxes, BulletRun)
    ->Name("falling_boxes/bullet")
    ->Arg(3)
    ->Arg(5)
    ->Arg(8)
    ->Iterations(1)
    ->UseManualTime()
    ->Unit(benchmark::kSecond);

}  // namespace
}  // namespace duet
