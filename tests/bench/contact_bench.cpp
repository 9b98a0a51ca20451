// The search for contacts in piles: its cost per body and pair, and how that grows. The layouts are a heap
// of boxes as wide as it is high, and tall columns; both loose (falling) or touching (resting). The counters
// are:
//
//   kept, found   pairs per call that persisted, and that had to be searched for
#include <cmath>
#include <random>

#include <benchmark/benchmark.h>

#include "sim/base/parallel.h"
#include "sim/contact/detection/contact_candidates.h"
#include "sim/geometry/level_set/solid.h"

namespace duet {
namespace {

constexpr double dt = 1.0 / 240;  // s

enum class Layout { heap, columns };

// Returns cubes of 1 m on the ground. If they fall, they have random rotations and velocities.
Bodies boxes(int count, Layout layout, bool falling) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const auto vector = [&] { return Vec3(uniform(random), uniform(random), uniform(random)); };
  const Solid solid = make_solid(LevelSet::box(Vec3::Ones()));
  const int wide =
      static_cast<int>(std::lround(layout == Layout::heap ? std::cbrt(count) : std::sqrt(count / 40.0)));
  const double apart = falling ? 1.3 : 1.0;
  RigidProperties box;
  box.shape = solid.level_set;
  box.samples = solid.samples;
  box.inside = solid.inside;
  box.mass = 1000;
  box.inverse_mass = 1 / box.mass;
  box.inertia = box.mass * solid.unit_inertia;
  Bodies bodies;
  for (int i = 0; i < count; ++i) {
    RigidState state;
    state.pose.position = apart * Vec3(i % wide, 0.5 + i / (wide * wide), i / wide % wide);
    if (falling) {
      state.pose.orientation = Quat(Eigen::AngleAxisd(uniform(random), vector().normalized()));
      state.velocity = Vec3(0, -5, 0) + vector();
    }
    set_angular_velocity(state, box, falling ? vector() : Vec3::Zero());
    bodies.rigid.state.push_back(state);
    bodies.rigid.properties.push_back(box);
  }
  RigidProperties ground;
  ground.shape = LevelSet::half_space();
  bodies.rigid.state.emplace_back();
  bodies.rigid.properties.push_back(ground);
  return bodies;
}

VelocityState no_change(const Bodies& bodies) {
  VelocityState now, change;
  store_velocities(bodies, now);
  velocity_difference(bodies, now, change);
  return change;
}

// Sets the counters of pairs and of the time for each.
void count(benchmark::State& state, std::size_t pairs) {
  using benchmark::Counter;
  state.SetComplexityN(state.range(0));
  state.counters["pairs"] = static_cast<double>(pairs);
  state.counters["s/pair"] = Counter(static_cast<double>(state.iterations()) * static_cast<double>(pairs),
                                     static_cast<Counter::Flags>(Counter::kIsRate | Counter::kInvert));
}

void pairs_of_bodies(benchmark::State& state, Layout layout, bool falling, int threads) {
  set_thread_count(threads);
  Bodies bodies = boxes(static_cast<int>(state.range(0)), layout, falling);
  BroadPhase broad_phase;
  std::size_t pairs = 0;
  int call = 0;
  for (auto _ : state) {
    // The boxes move to and fro, so that they stay together.
    const double way = call++ % 100 < 50 ? dt : -dt;
    for (RigidState& body : bodies.rigid.state) body.pose.position += way * body.velocity;
    bound_bodies(bodies, broad_phase.bounds);
    broad_phase.margin.assign(broad_phase.bounds.size(), 0.025);
    pairs = broad_phase.find({}).size();
  }
  count(state, pairs);
  const auto a_call = [&](std::int64_t total) { return static_cast<double>(total) / call; };
  state.counters["kept"] = a_call(broad_phase.counts().kept);
  state.counters["found"] = a_call(broad_phase.counts().found);
  set_thread_count(0);
}

void candidates(benchmark::State& state, Layout layout, bool falling, int threads) {
  set_thread_count(threads);
  const Bodies bodies = boxes(static_cast<int>(state.range(0)), layout, falling);
  const VelocityState change = no_change(bodies);
  ContactSet contacts;
  for (auto _ : state) find_candidates(bodies, {}, dt, change, contacts);
  count(state, contacts.pairs.size());
  state.counters["points"] = static_cast<double>(contacts.points.size());
  set_thread_count(0);
}

const bool registered = [] {
  const auto sizes = [](benchmark::internal::Benchmark* benchmark) {
    benchmark->Arg(125)->Arg(343)->Arg(1000)->Arg(2197)->Arg(4096)->Unit(benchmark::kMicrosecond);
    benchmark->Complexity();
  };
  for (const int threads : {1, 2})
    for (const auto& [name, layout] :
         {std::pair("heap", Layout::heap), std::pair("columns", Layout::columns)})
      for (const bool falling : {false, true}) {
        const std::string title = std::string("/") + name + (falling ? "/falling" : "/resting") +
                                  "/threads:" + std::to_string(threads);
        sizes(benchmark::RegisterBenchmark(("broad_phase" + title).c_str(), pairs_of_bodies, layout, falling,
                                           threads));
        sizes(benchmark::RegisterBenchmark(("candidates" + title).c_str(), candidates, layout, falling,
                                           threads));
      }
  return true;
}();

}  // namespace
}  // namespace duet
