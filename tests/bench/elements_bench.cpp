// Cost of finite elements: of their forces, and of an iteration of the conjugate gradients of the
// semi-implicit and of the implicit solve, for 10^3 to 10^6 tetrahedra of neo-Hookean material in healthy
// states. The counters are:
//
//   tets/s           elements whose forces (or products) are evaluated in a second
//   over_stream      time over the time for one reading of the same bytes, measured in the same run; they
//                    are the bytes of the elements, of their forces on the way to the particles, and of the
//                    vectors
//   two_threads      wall seconds on one thread over those on two, the least of rounds that take turns
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>

#include "tests/support/scenes.h"
#include <benchmark/benchmark.h>

#include "sim/base/parallel.h"
#include "sim/solve/velocity_system.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Bytes that a product reads or writes. For an element they are the indices of its particles and the forces
// on them, D_m^-1, volume and omega^2, F, and its fraction of the forces of its block, written and read.
// Implicit elasticity adds the stress differential and a second reading of the rest. For a particle they are
// its velocity in the vectors of an iteration, read or written.
constexpr double block_bytes = 2 * 0.5 * 32;  // A block of 256 elements touches about half as many particles.
constexpr double element_bytes = 16 + 8 + 72 + 2 * 8 + 72 + block_bytes;
constexpr double single_bytes = 8 + 36 + 36 + 4 + block_bytes;
constexpr double differential_bytes = sizeof(StressDifferential<double>) + 16 + 8 + 72 + 2 * 8 + block_bytes;
constexpr double particle_bytes = 24 * 14;

// A cube of cells^3 cells with a wavy deformation.
struct Cube {
  explicit Cube(int cells) {
    scene::Scene scene = test::free_space();
    test::add_soft_box(scene, "cube", Vec3::Zero(), Vec3(1, 1, 1), cells);
    scene.solver.face_samples = 0;
    simulation = std::make_unique<Simulation>(scene, test::plan(scene));
    for (Vec3& x : bodies().particles.x)
      x += Vec3(0.01 * std::sin(9 * x.y()), 0.02 * x.x() * x.z(), 0.01 * std::cos(7 * x.x()));
    force.assign(bodies().particles.size(), Vec3::Zero());
  }
  Bodies& bodies() { return simulation->world().bodies; }
  std::int64_t tets() { return static_cast<std::int64_t>(bodies().forces.elements.size()); }

  std::unique_ptr<Simulation> simulation;
  std::vector<Vec3> force;
};

// Returns the processor time of this process since `start` in s. Other programs may run beside it.
double seconds_since(std::clock_t start) {
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

// Returns how many times as fast `work` is on two threads as on one. Rounds on one and on two threads take
// turns, and are long enough for the caches to fill.
template <class Work>
double two_threads(Work&& work) {
  constexpr double round_seconds = 0.1;
  const auto seconds = [](auto since) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - since).count();
  };
  std::array<double, 2> least{1e9, 1e9};
  for (int round = 0; round < 10; ++round) {
    set_thread_count(1 + round % 2);
    const auto start = std::chrono::steady_clock::now();
    do {
      const auto now = std::chrono::steady_clock::now();
      work();
      double& best = least[static_cast<std::size_t>(round) % 2];
      best = std::min(best, seconds(now));
    } while (seconds(start) < round_seconds);
  }
  set_thread_count(1);
  return least[0] / least[1];
}

// Returns the seconds in which one thread reads so many bytes from memory.
double stream_seconds(double bytes) {
  constexpr std::size_t size = 256 << 20;  // more than caches hold
  std::vector<double8> data(size / sizeof(double8), double8{} + 1.0);
  double best = 1;
  for (int run = 0; run < 10; ++run) {
    const std::clock_t start = std::clock();
    double8 sum[4] = {};
    for (std::size_t i = 0; i + 4 <= data.size(); i += 4)
      for (std::size_t k = 0; k < 4; ++k) sum[k] += data[i + k];
    benchmark::DoNotOptimize(sum);
    best = std::min(best, seconds_since(start));
  }
  return best * bytes / size;
}

void elastic_forces(benchmark::State& state) {
  set_thread_count(1);
  Cube cube(static_cast<int>(state.range(0)));
  const auto evaluate = [&] {
    cube.bodies().forces.add_elastic_forces(cube.bodies().particles.x, cube.force);
  };
  for (auto unused : state) evaluate();
  state.counters["tets/s"] =
      benchmark::Counter(static_cast<double>(state.iterations() * cube.tets()), benchmark::Counter::kIsRate);
  state.counters["two_threads"] = two_threads(evaluate);
  state.SetComplexityN(cube.tets());
  set_thread_count(0);
}

enum class Solve { semi_implicit, semi_implicit_in_double, implicit };

// Measures one iteration of conjugate_gradient.h: a product, its projection, two inner products, and three
// updates.
void cg_iterations(benchmark::State& state, Solve solve) {
  const bool implicit = solve == Solve::implicit, in_single = solve == Solve::semi_implicit;
  set_thread_count(1);
  Cube cube(static_cast<int>(state.range(0)));
  Bodies& bodies = cube.bodies();
  bodies.forces.add_elastic_forces(bodies.particles.x, cube.force);
  if (implicit) bodies.forces.linearize();
  std::vector<Mat3> inertia;
  VelocitySystem system(bodies, 1e-4,
                        implicit ? ImplicitForces::damping_and_elasticity : ImplicitForces::damping, nullptr,
                        cube.force, inertia);
  for (std::size_t p = 0; p < bodies.particles.size(); ++p)
    bodies.particles.v[p] = Vec3(std::sin(3.0 * static_cast<double>(p)), 1, 0);
  GeneralizedVelocity b, x, r, s, q;
  to_generalized(bodies, b);
  x = b;
  BlockJacobi masses;
  if (!implicit) system.use(masses, AssembleBlocks::all);  // as steps do
  system.apply_preconditioner(b);
  constexpr int most = 6;
  // The tolerance is out of reach of so many iterations, but within that of single precision.
  const double tolerance = in_single ? 1e-3 * conjugate_gradient(system, b, 0, 0, x, r, s, q).residual : 0;
  const GeneralizedVelocity first = x;
  int iterations = 0;
  const std::clock_t start = std::clock();
  const auto iterate = [&] {
    x = first;
    iterations += conjugate_gradient(system, b, tolerance, most, x, r, s, q).iterations + 1;
  };
  for (auto unused : state) iterate();
  const double seconds = seconds_since(start) / iterations;
  const double bytes = static_cast<double>(cube.tets()) *
                           (in_single ? single_bytes : element_bytes + (implicit ? differential_bytes : 0)) +
                       static_cast<double>(bodies.particles.size()) * particle_bytes;
  state.counters["s/iteration"] = seconds;
  state.counters["over_stream"] = seconds / stream_seconds(bytes);
  state.counters["two_threads"] = two_threads(iterate);
  state.SetComplexityN(cube.tets());
  set_thread_count(0);
}

void cg_semi_implicit(benchmark::State& state) { cg_iterations(state, Solve::semi_implicit); }
void cg_in_double(benchmark::State& state) { cg_iterations(state, Solve::semi_implicit_in_double); }
void cg_implicit(benchmark::State& state) { cg_iterations(state, Solve::implicit); }

void sizes(benchmark::internal::Benchmark* bench) {
  for (const int cells : {6, 13, 28, 58}) bench->Arg(cells);  // 1,080 to 975,560 tetrahedra
  bench->Unit(benchmark::kMillisecond)->MinTime(0.3)->Complexity(benchmark::oN);
}

BENCHMARK(elastic_forces)->Apply(sizes);
BENCHMARK(cg_semi_implicit)->Apply(sizes);
BENCHMARK(cg_in_double)->Apply(sizes);
BENCHMARK(cg_implicit)->Apply(sizes);

}  // namespace
}  // namespace duet
