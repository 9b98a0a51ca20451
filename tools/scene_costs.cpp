#include "tools/scene_costs.h"

#include <algorithm>
#include <filesystem>

#include "tools/scene_files.h"
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/parallel.h"
#include "sim/scene/plan.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// A scene with rigid and deformable bodies in contact, whose frames take a tenth of a second.
constexpr const char* calibration_scene = "study/stack_at_rest";

SceneCost cost_of(const nlohmann::json& json) {
  return {json.at("measured_frames"), json.at("substeps"),    json.at("seconds"), json.at("bytes"),
          json.at("picture_bytes"),   json.at("other_bytes"), json.at("memory"),  json.at("drawing_memory")};
}

}  // namespace

std::optional<CostTable> read_costs() {
  const std::vector<ShippedScene> shipped = shipped_scenes();
  const auto top = std::find_if(shipped.begin(), shipped.end(), [](const ShippedScene& scene) {
    return scene.name.find('/') == std::string::npos;
  });
  if (top == shipped.end()) return {};
  const fs::path path = top->path.parent_path() / "costs.json";
  if (std::error_code unknown; !fs::exists(path, unknown)) return {};
  try {
    const nlohmann::json json = nlohmann::json::parse(io::read_file(path));
    CostTable table{
        json.at("machine"), json.at("program"), json.at("date"), json.at("calibration_seconds"), {}};
    for (const auto& [name, cost] : json.at("scenes").items()) table.scenes[name] = cost_of(cost);
    return table;
  } catch (const nlohmann::json::exception& error) {
    throw FileError(path, std::string("is no table of costs: ") + error.what(),
                    "`tools/scene-costs` writes it anew");
  }
}

double calibrate() {
  const scene::Scene scene = scene::read(find_scene(calibration_scene).string()).scene;
  const EffectSet effects = scene::plan_effects(scene).active();
  set_thread_count(1);
  double least = 0;
  for (int i = 0; i < 3; ++i) {
    Simulation simulation(scene, effects);
    simulation.advance_frame();
    const double seconds = simulation.stats().processor_seconds;
    least = i == 0 ? seconds : std::min(least, seconds);
  }
  set_thread_count(0);
  return least;
}

}  // namespace duet::tools
