// `duet check`: lists every problem of a scene, or prints the reference of all keys.
#include "tools/commands.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/scene/build/initial_overlaps.h"
#include "sim/scene/build/tet_meshes.h"
#include "sim/scene/explain.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {
namespace {

// Prints the deformable bodies that cannot be filled with tetrahedra, which only filling them shows. Returns
// how many there are.
std::size_t check_filling(const scene::Scene& scene) {
  scene::TetMeshes meshes;
  std::size_t count = 0;
  for (const scene::DeformableBody& body : scene.deformable) {
    if (!body.shape.is_volume()) continue;
    try {
      meshes.of(body);
    } catch (const Error& error) {
      ++count;
      print(fmt::format("{}:{}:{}: {}\n", scene.path, body.at.line, body.at.column, error.what()));
    }
  }
  return count;
}

// Builds the scene and prints the problems that only this shows: bodies without any of the particles attached
// to them, bodies that overlap, and frames of thousands of steps. Returns 1 if the scene cannot be built,
// else 0: overlaps and long frames are warnings.
std::size_t check_start(const scene::Scene& scene) {
  try {
    const Simulation simulation(scene, scene::plan_effects(scene).active());
    for (const InitialOverlap& overlap : simulation.initial_overlaps())
      print(fmt::format("{}: {}\n", scene.path, describe_separation(overlap)));
    if (const std::string warning = scene::step_warning(scene, simulation.sizes()); !warning.empty())
      print(fmt::format("{}: {}\n", scene.path, warning));
    return 0;
  } catch (const SceneError&) {
    throw;
  } catch (const Error& error) {
    print(fmt::format("{}: {}\n", scene.path, error.what()));
    return 1;
  }
}

Outcome problems_found(std::size_t count) {
  return {ExitStatus::usage, fmt::format("{} problem{}", count, count == 1 ? "" : "s")};
}

}  // namespace

Outcome check(const CheckOptions& options) {
  if (options.reference) {
    print(scene::reference());
    return {};
  }
  try {
    const scene::ReadResult read = read_scene(options.scene);
    for (const std::string& note : read.notes) print(note + '\n');
    if (const std::size_t count = check_filling(read.scene); count > 0) return problems_found(count);
    if (const std::size_t count = check_start(read.scene); count > 0) return problems_found(count);
    print(fmt::format("{}: ok\n", read.scene.path));
    return {};
  } catch (const SceneError& error) {
    for (const SceneProblem& problem : error.problems()) print(problem.text() + '\n');
    return problems_found(error.problems().size());
  }
}

}  // namespace duet::tools
