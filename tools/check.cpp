// `duet check`: lists every problem of a scene, or prints the reference of all keys.
#include "tools/commands.h"
#include "tools/estimate.h"
#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/base/wording.h"
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

// Warnings that only building the scene shows, and the reason why it cannot be built.
struct StartCheck {
  std::vector<std::string> warnings;  // overlaps that are parted before the first step; frames of many steps
  std::string problem;                // empty if the scene can be simulated
};

// Builds the scene. Throws SceneError if bodies lack what is attached to them.
StartCheck check_start(const scene::ReadResult& read, const std::string& out) {
  const scene::Scene& scene = read.scene;
  StartCheck check;
  try {
    const Simulation simulation(scene, scene::plan_effects(scene).active());
    for (const InitialOverlap& overlap : simulation.initial_overlaps())
      check.warnings.push_back(describe_separation(overlap));
    for (std::string& warning : scene::material_warnings(scene)) check.warnings.push_back(std::move(warning));
    if (std::string warning = scene::step_warning(scene, simulation.sizes()); !warning.empty())
      check.warnings.push_back(std::move(warning));
    for (std::string& warning :
         resource_warnings(estimate_sizes(read, simulation, out, LevelSets::are_left_out)))
      check.warnings.push_back(std::move(warning));
  } catch (const SceneError&) {
    throw;
  } catch (const Error& error) {
    check.problem = error.what();
  }
  return check;
}

Outcome problems_found(std::size_t count) { return {ExitStatus::usage, counted(count, "problem")}; }

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
    const StartCheck start = check_start(read, run_folder(options.scene, "").string());
    for (const std::string& warning : start.warnings)
      print(fmt::format("{}: warning: {}\n", read.scene.path, warning));
    if (!start.problem.empty()) {
      print(fmt::format("{}: {}\n", read.scene.path, start.problem));
      return problems_found(1);
    }
    // A scene with warnings can be simulated, so that the status is that of success.
    const std::string warned =
        start.warnings.empty() ? "" : ", with " + counted(start.warnings.size(), "warning");
    print(fmt::format("{}: ok{}\n", read.scene.path, warned));
    return {};
  } catch (const SceneError& error) {
    for (const SceneProblem& problem : error.problems()) print(problem.text() + '\n');
    return problems_found(error.problems().size());
  }
}

}  // namespace duet::tools
