// Cost of a time step as piles grow, and with threads. Boxes, balls, rings and capsules have fallen into a
// tray, in eight layers for every number of bodies. Every size is simulated for one and a half seconds, in
// which it heaps up. The same steps from the state reached are then timed again and again. The counters are:
//
//   s/step      wall seconds of a time step
//   contacts    contact points that hold a force at the end
//   kept, found pairs of the broad phase per step that persisted, and that had to be searched for
//
// The fit that the library prints over the sizes is the growth of the time of a step.
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <random>

#include "tests/support/scenes.h"
#include <benchmark/benchmark.h>

#include "sim/base/parallel.h"
#include "sim/step/world.h"

namespace duet {
namespace {

constexpr int layers = 8, frames_to_heap_up = 36, frames_timed = 4;
// Spacing of the lattice from which the bodies fall, in m. No body reaches into the next cell.
constexpr double cell = 0.85;

scene::Shape shape_of(int body) {
  scene::Shape shape;
  switch (body % 4) {
    case 0:
      shape.kind = scene::ShapeKind::box;
      shape.size = Vec3(0.5, 0.4, 0.45);
      break;
    case 1:
      shape.kind = scene::ShapeKind::sphere;
      shape.radius = 0.28;
      break;
    case 2:
      shape.kind = scene::ShapeKind::torus;
      shape.radius = 0.31;
      shape.tube = 0.09;
      break;
    default:
      shape.kind = scene::ShapeKind::capsule;
      shape.radius = 0.16;
      shape.length = 0.4;
  }
  return shape;
}

scene::Scene tray_of(int count) {
  scene::Scene scene = test::on_ground();
  const int side = static_cast<int>(std::ceil(std::sqrt(static_cast<double>(count) / layers)));
  const double half = cell * side / 2, wall = 0.5, height = 6;
  for (const double way : {-1.0, 1.0})
    for (const bool along_x : {false, true}) {
      const Vec3 at(along_x ? way * (half + wall / 2) : 0, height / 2, along_x ? 0 : way * (half + wall / 2));
      const Vec3 size(along_x ? wall : 2 * half, height, along_x ? 2 * half : wall);
      auto& body = test::add_box(scene, "wall" + std::to_string(scene.rigid.size()), at, size, 1);
      body.is_static = true;
      body.mass.reset();
      body.sample_spacing = 1;
    }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int i = 0; i < count; ++i) {
    const int x = i % side, z = i / side % side, layer = i / (side * side);
    const Vec3 at(cell * (x + 0.5) - half, cell * (layer + 0.6), cell * (z + 0.5) - half);
    auto& body = test::add_ball(scene, "body" + std::to_string(i), at, 0.28, 40);
    body.shape = shape_of(i);
    body.placement.orientation = Quat(Eigen::AngleAxisd(
        EIGEN_PI * uniform(random), Vec3(uniform(random), uniform(random), uniform(random)).normalized()));
    body.friction = 0.5;
    body.restitution = 0;
  }
  return scene;
}

// A heap of bodies, which is built when it is first asked for.
struct Heap {
  std::unique_ptr<Simulation> simulation;
  std::vector<unsigned char> state;

  explicit Heap(int count) {
    set_thread_count(0);
    const scene::Scene scene = tray_of(count);
    simulation = std::make_unique<Simulation>(scene, test::plan(scene));
    for (int frame = 0; frame < frames_to_heap_up; ++frame) simulation->advance_frame();
    state = simulation->save_state();
  }
  static Heap& of(int count) {
    static std::map<int, Heap> heaps;
    return heaps.try_emplace(count, count).first->second;
  }
};

void step_of_a_heap(benchmark::State& state) {
  Heap& heap = Heap::of(static_cast<int>(state.range(0)));
  set_thread_count(static_cast<int>(state.range(1)));
  std::int64_t contacts = 0;
  int all_steps = 0;
  const auto pairs = [&] {
    return heap.simulation->world().context.contact.contacts.search.broad_phase.counts();
  };
  const BroadPhase::Counts before = pairs();
  for (auto _ : state) {
    heap.simulation->load_state(heap.state);
    double seconds = 0;
    int steps = 0;
    for (int frame = 0; frame < frames_timed; ++frame) {
      heap.simulation->advance_frame();
      const FrameStats stats = heap.simulation->stats();
      seconds += stats.seconds;
      steps += stats.substeps;
      contacts = stats.contacts;
    }
    state.SetIterationTime(seconds / steps);
    all_steps += steps;
  }
  state.SetComplexityN(state.range(0));
  state.counters["contacts"] = static_cast<double>(contacts);
  state.counters["kept"] = static_cast<double>(pairs().kept - before.kept) / all_steps;
  state.counters["found"] = static_cast<double>(pairs().found - before.found) / all_steps;
  set_thread_count(0);
}

const bool registered = [] {
  for (const int threads : {1, 2})
    benchmark::RegisterBenchmark(("pile_step/threads:" + std::to_string(threads)).c_str(), step_of_a_heap)
        ->ArgsProduct({{27, 125, 500, 1000, 2000, 4000}, {threads}})
        ->ArgNames({"bodies", ""})
        ->UseManualTime()
        ->Iterations(3)
        ->Unit(benchmark::kMillisecond)
        ->Complexity([](benchmark::IterationCount n) { return std::pow(static_cast<double>(n), 1.2); });
  return true;
}();

}  // namespace
}  // namespace duet
