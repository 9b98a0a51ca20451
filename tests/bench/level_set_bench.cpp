// Time of a query of each kind of level set, at points around the surface: `near` points are in the order of
// a body's samples, and `random` points in no order.
#include <random>
#include <string>

#include "tests/support/places.h"
#include <benchmark/benchmark.h>

#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/level_set/solid.h"
#include "sim/geometry/mesh/mesh_check.h"

namespace duet {
namespace {

Solid knot() {
  TriangleMesh mesh = read_mesh(test::source_folder() + "/assets/knot.obj");
  repair(mesh);
  return make_solid(mesh, 1, 64);
}

LevelSet shape_named(const std::string& name) {
  if (name == "sphere") return LevelSet::sphere(0.5);
  if (name == "box") return LevelSet::box(Vec3(1, 0.8, 0.6));
  if (name == "capsule") return LevelSet::capsule(0.3, 0.4);
  if (name == "cylinder") return LevelSet::cylinder(0.4, 1);
  if (name == "torus") return LevelSet::torus(0.35, 0.15);
  return knot().level_set;
}

// Returns points of a box that exceeds the bounds of the shape by a tenth of its size. They are in rows, or
// in no order.
std::vector<Vec3> points_around(const LevelSet& shape, bool in_order) {
  constexpr int n = 40;
  const Vec3 lower = shape.lower(), size = shape.upper() - lower;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Vec3> points;
  for (int i = 0; i < n * n * n; ++i) {
    const Vec3 row = Vec3(i % n, i / n % n, i / n / n) / n;
    const Vec3 place = in_order ? row : Vec3(uniform(random), uniform(random), uniform(random));
    points.emplace_back(lower + size.cwiseProduct(1.2 * place - Vec3::Constant(0.1)));
  }
  return points;
}

void count_queries(benchmark::State& state, std::size_t points) {
  const double queries = static_cast<double>(state.iterations()) * static_cast<double>(points);
  using benchmark::Counter;
  state.counters["s/query"] =
      Counter(queries, static_cast<Counter::Flags>(Counter::kIsRate | Counter::kInvert));
}

void distance(benchmark::State& state, const std::string& name, bool in_order) {
  const LevelSet shape = shape_named(name);
  const std::vector<Vec3> points = points_around(shape, in_order);
  for (auto _ : state) {
    double sum = 0;
    for (const Vec3& x : points) sum += shape.distance(x);
    benchmark::DoNotOptimize(sum);
  }
  count_queries(state, points.size());
}

void distance_and_normal(benchmark::State& state, const std::string& name) {
  const LevelSet shape = shape_named(name);
  const std::vector<Vec3> points = points_around(shape, true);
  for (auto _ : state) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& x : points) sum += shape.distance(x) * shape.normal(x);
    benchmark::DoNotOptimize(sum);
  }
  count_queries(state, points.size());
}

// Far away there is no grid, and the query searches for the nearest triangle.
void distance_beyond_the_grid(benchmark::State& state) {
  const LevelSet shape = knot().level_set;
  std::vector<Vec3> points = points_around(shape, true);
  for (Vec3& x : points) x += 2 * shape.bounding_radius() * x.normalized();
  for (auto _ : state) {
    double sum = 0;
    for (const Vec3& x : points) sum += shape.distance(x);
    benchmark::DoNotOptimize(sum);
  }
  count_queries(state, points.size());
}

void making_a_mesh_body(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(knot().volume);
}

const bool registered = [] {
  for (const char* name : {"sphere", "box", "capsule", "cylinder", "torus", "mesh"}) {
    const std::string title = "level_set/" + std::string(name);
    benchmark::RegisterBenchmark((title + "/distance/near").c_str(), distance, name, true);
    benchmark::RegisterBenchmark((title + "/distance/random").c_str(), distance, name, false);
    benchmark::RegisterBenchmark((title + "/distance+normal").c_str(), distance_and_normal, name);
  }
  benchmark::RegisterBenchmark("level_set/mesh/beyond_the_grid", distance_beyond_the_grid);
  benchmark::RegisterBenchmark("level_set/mesh/make", making_a_mesh_body)->Unit(benchmark::kMillisecond);
  return true;
}();

}  // namespace
}  // namespace duet
