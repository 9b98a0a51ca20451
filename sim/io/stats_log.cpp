#include "sim/io/stats_log.h"

#include <charconv>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/json_text.h"

namespace duet::io {

std::string stats_json(const FrameStats& stats) {
  using Json = nlohmann::ordered_json;
  Json stages = Json::object();
  for (const StageStats& stage : stats.stages)
    stages[stage.name] = {{"seconds", stage.seconds}, {"calls", stage.calls}};
  const auto vector = [](const Vec3& v) { return Json{v.x(), v.y(), v.z()}; };
  Json object = {{"frame", stats.frame},
                 {"time", stats.time},
                 {"substeps", stats.substeps},
                 {"dt_min", stats.dt_min},
                 {"dt_max", stats.dt_max},
                 {"seconds", stats.seconds},
                 {"processor_seconds", stats.processor_seconds},
                 {"stages", std::move(stages)},
                 {"cg_iterations", stats.cg_iterations},
                 {"contacts", stats.contacts},
                 {"max_penetration", stats.max_penetration},
                 {"pressure_iterations", stats.pressure_iterations},
                 {"volume_error", stats.volume_error},
                 {"min_det_F", stats.min_det_F},
                 {"inverted", stats.inverted},
                 {"max_stretch", stats.max_stretch},
                 {"self_repulsions", stats.self_repulsions},
                 {"self_collisions", stats.self_collisions},
                 {"impact_zone_particles", stats.impact_zone_particles},
                 {"kinetic", stats.kinetic},
                 {"potential", stats.potential},
                 {"elastic", stats.elastic},
                 {"momentum", vector(stats.momentum)},
                 {"angular_momentum", vector(stats.angular_momentum)},
                 {"hash", fmt::format("{:016x}", stats.hash)}};
  if (stats.drawn_overlap) {
    const DeepestOverlap& deepest = *stats.drawn_overlap;
    object["drawn_penetration"] = deepest.depth;
    if (deepest.depth > 0)
      object["deepest_drawn"] = {
          {"body", deepest.guest}, {"in", deepest.host}, {"place", vector(deepest.place)}};
  }
  if (!stats.ledger.empty()) {
    Json& ledger = object["ledger"];
    for (const LedgerStats& stage : stats.ledger)
      ledger[stage.name] = {{"momentum", vector(stage.momentum)},
                            {"external_momentum", vector(stage.external_momentum)},
                            {"angular_momentum", vector(stage.angular_momentum)},
                            {"external_angular_momentum", vector(stage.external_angular_momentum)},
                            {"momentum_defect", stage.momentum_defect},
                            {"angular_momentum_defect", stage.angular_momentum_defect},
                            {"kinetic", stage.kinetic},
                            {"stored", stage.stored}};
    object["pushed_mass"] = stats.max_mass_shift;
    object["pushed_moment"] = stats.max_moment_shift;
  }
  for (const PinchStats& pinch : stats.pinched)
    object["pinched"].push_back({{"body", pinch.body},
                                 {"between", {pinch.first, pinch.second}},
                                 {"thickness", pinch.thickness},
                                 {"room", pinch.room},
                                 {"time", pinch.time}});
  if (stats.self_intersections) object["self_intersections"] = *stats.self_intersections;
  return object.dump();
}

std::optional<std::uint64_t> recorded_hash(const RunDirectory& run, int frame) {
  if (!fs::exists(run.stats())) return {};
  const std::string line = line_of_frame(read_file(run.stats()), frame);
  const nlohmann::json object = parse_json(line);
  if (!object.is_object()) return {};
  const auto found = object.find("hash");
  if (found == object.end() || !found->is_string()) return {};
  const std::string digits = found->get<std::string>();
  std::uint64_t hash = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), hash, 16);
  if (error != std::errc() || end != digits.data() + digits.size()) return {};
  return hash;
}

StatsLog::StatsLog(const RunDirectory& run, int last_kept) : lines_(run, run.stats(), last_kept) {}

void StatsLog::append(const FrameStats& stats) {
  lines_.append(stats_json(stats));
  lines_.list();
}

}  // namespace duet::io
