// Time of filling a surface with tetrahedra, by resolution, and with a level set that is a formula or has to
// be made from a mesh first.
#include <cmath>
#include <string>

#include "tests/support/places.h"
#include <benchmark/benchmark.h>

#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/meshing/tetrahedralizer.h"

namespace duet {
namespace {

void count_tets(benchmark::State& state, std::size_t tets) {
  state.counters["tets"] = static_cast<double>(tets);
  state.counters["tets/s"] =
      benchmark::Counter(static_cast<double>(tets), benchmark::Counter::kIsIterationInvariantRate);
}

void torus(benchmark::State& state, bool graded) {
  const LevelSet shape = LevelSet::torus(1, 0.4);
  const double spacing = 2.8 / static_cast<double>(state.range(0));  // cells along the longest extent
  std::size_t tets = 0;
  for (auto _ : state)
    tets = tetrahedralize(shape, spacing, graded ? CellSizes::graded : CellSizes::uniform).tets.size();
  count_tets(state, tets);
}

void knot(benchmark::State& state) {
  TriangleMesh mesh = read_mesh(test::source_folder() + "/assets/knot.obj");
  repair(mesh);
  std::size_t tets = 0;
  for (auto _ : state) {
    const LevelSet inside = fine_level_set(mesh, {});
    tets = tetrahedralize(inside, default_spacing(inside)).tets.size();
  }
  count_tets(state, tets);
}

const bool registered = [] {
  for (const bool graded : {false, true})
    benchmark::RegisterBenchmark(graded ? "tetrahedralizer/torus/graded" : "tetrahedralizer/torus", torus,
                                 graded)
        ->Arg(25)
        ->Arg(50)
        ->Arg(100)
        ->Unit(benchmark::kMillisecond);
  benchmark::RegisterBenchmark("tetrahedralizer/mesh", knot)->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace duet
