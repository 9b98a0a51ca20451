// `duet explain`: prints the effect plan, sizes, warnings and costs of a scene. It simulates nothing without
// --estimate.
#include "sim/scene/explain.h"

#include "tools/commands.h"
#include "tools/estimate.h"
#include "tools/scene_files.h"
#include <nlohmann/json.hpp>

#include "sim/base/stop.h"
#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {

Outcome explain(const ExplainOptions& options) {
  const scene::ReadResult read = read_scene(options.scene);
  const scene::EffectPlan plan = scene::plan_effects(read.scene, options.scene.without);
  const std::optional<CostTable> table = read_costs();
  Simulation simulation(read.scene, plan.active());
  const WorldSizes sizes = simulation.sizes();
  RunEstimate estimate = estimate_sizes(read, simulation, run_folder(options.scene, options.out).string(),
                                        LevelSets::are_measured);
  try {
    if (options.estimate) sample_frames(read, simulation, options.sample_seconds, estimate);
  } catch (const Stopped&) {
    return {ExitStatus::interrupted, "the estimate was given up; nothing was written"};
  }
  use_table(options.scene, table, estimate);
  if (options.estimate && estimate.measured) estimate.speed = calibrate() / table->calibration_seconds;
  const std::vector<std::string> further = resource_warnings(estimate);
  if (options.json) {
    nlohmann::json json = scene::explain_json(read.scene, plan, sizes, further);
    json["estimate"] = json_of(estimate);
    print(json_text(json, 2) + "\n");
  } else {
    print(scene::explain(read.scene, plan, sizes, further) + text_of(estimate, table));
  }
  return {};
}

}  // namespace duet::tools
