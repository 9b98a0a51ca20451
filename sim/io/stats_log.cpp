#include "sim/io/stats_log.h"

#include <cerrno>
#include <string_view>

#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "sim/io/files.h"

namespace duet::io {
namespace {

// The frame of a line, or -1 for a line that is torn or no object of ours.
int frame_of_line(std::string_view line) {
  const nlohmann::json object = nlohmann::json::parse(line, nullptr, false);
  if (!object.is_object()) return -1;
  const auto frame = object.find("frame");
  return frame != object.end() && frame->is_number_integer() ? frame->get<int>() : -1;
}

std::string lines_up_to(std::string_view text, int last_kept) {
  std::string kept;
  while (true) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return kept;
    const std::string_view line = text.substr(0, end + 1);
    text.remove_prefix(end + 1);
    const int frame = frame_of_line(line);
    if (frame >= 0 && frame <= last_kept) kept += line;
  }
}

}  // namespace

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
    object["pushed_mass"] = stats.pushed_mass;
    object["pushed_moment"] = stats.pushed_moment;
  }
  if (stats.self_intersections) object["self_intersections"] = *stats.self_intersections;
  return object.dump();
}

StatsLog::StatsLog(const RunDirectory& run, int last_kept) : path_(run.stats()) {
  const bool keep = last_kept >= 0 && fs::exists(path_);
  write_atomically(path_, keep ? lines_up_to(read_file(path_), last_kept) : std::string());
  file_ = ::open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file_ < 0) throw system_error(path_, "cannot write", errno);
}

StatsLog::~StatsLog() { ::close(file_); }

void StatsLog::append(const FrameStats& stats) {
  const std::string line = stats_json(stats) + '\n';
  const off_t before = ::lseek(file_, 0, SEEK_END);
  // One call for the whole line, so that a reader or a kill between two calls never meets half of it.
  const ssize_t written = ::write(file_, line.data(), line.size());
  if (written == static_cast<ssize_t>(line.size())) return;
  // A short write means that the file cannot grow: the second attempt gets the reason from the system.
  int reason = errno;
  if (written >= 0) reason = ::write(file_, line.data() + written, line.size() - written) < 0 ? errno : EIO;
  if (::ftruncate(file_, before) != 0) reason = errno;
  throw system_error(path_, "cannot write", reason);
}

}  // namespace duet::io
