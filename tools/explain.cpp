// `duet explain`: prints the effect plan, sizes and warnings of a scene, and simulates nothing.
#include "sim/scene/explain.h"

#include "tools/commands.h"
#include "tools/scene_files.h"
#include <nlohmann/json.hpp>

#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {

Outcome explain(const ExplainOptions& options) {
  const scene::Scene scene = read_scene(options.scene).scene;
  const scene::EffectPlan plan = scene::plan_effects(scene, options.scene.without);
  const WorldSizes sizes = Simulation(scene, plan.active()).sizes();
  print(options.json ? json_text(scene::explain_json(scene, plan, sizes), 2) + "\n"
                     : scene::explain(scene, plan, sizes));
  return {};
}

}  // namespace duet::tools
