// Cost of incompressibility in a time step: a soft cube that has fallen on the ground, compressible and
// incompressible, advances from the same state. The counters are:
//
//   tets        number of elements
//   iterations  iterations of the pressure solves per step, which has two solves
#include "tests/support/scenes.h"
#include <benchmark/benchmark.h>

#include "sim/base/parallel.h"
#include "sim/step/step.h"

namespace duet {
namespace {

void step_of_soft_cube(benchmark::State& state) {
  set_thread_count(1);
  scene::Scene scene = test::on_ground(0.4);
  test::add_soft_box(scene, "soft", Vec3(0, 0.6, 0), Vec3(1, 1, 1), static_cast<int>(state.range(0)), 1e5)
      .incompressible = state.range(1) != 0;
  Simulation simulation(scene, test::plan(scene));
  for (int frame = 0; frame < 6; ++frame) simulation.advance_frame();
  World& world = simulation.world();
  world.counters = {};
  for (auto _ : state) {
    restore_step_start(world);
    step(world, 0, choose_time_step(world, 0));
  }
  state.counters["tets"] = static_cast<double>(world.bodies.forces.elements.size());
  state.counters["iterations"] = benchmark::Counter(static_cast<double>(world.counters.pressure_iterations),
                                                    benchmark::Counter::kAvgIterations);
  set_thread_count(0);
}
BENCHMARK(step_of_soft_cube)
    ->ArgNames({"cells", "incompressible"})
    ->ArgsProduct({{4, 8, 16}, {0, 1}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace duet
