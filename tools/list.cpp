// `duet list`: lists the scenes that ship, what they show, cost and write.
#include <algorithm>
#include <optional>

#include "tools/commands.h"
#include "tools/scene_costs.h"
#include "tools/scene_files.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/printable.h"

namespace duet::tools {
namespace {

using Json = nlohmann::ordered_json;

// Longest text of what a scene shows, in characters.
constexpr std::size_t max_text = 110;

// A group of scenes: a folder below scenes/.
struct Group {
  const char* folder;  // with a slash at its end; empty: scenes/ itself; null: all other folders
  const char* title;
};
constexpr Group groups[] = {{"", "Figures of the paper"},
                            {"hard/", "Hard scenes: tall stacks, large mass ratios, knots, sharp edges"},
                            {"study/", "Closed forms and studies"},
                            {nullptr, "Other scenes"}};

// Returns the comment at the top of a scene file as one line.
std::string top_comment(const std::string& text) {
  std::string comment;
  std::size_t at = 0;
  while (at < text.size() && text[at] == '#') {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::size_t begin = std::min(text.find_first_not_of("# ", at), end);
    if (begin == end) break;
    if (!comment.empty()) comment += ' ';
    comment += text.substr(begin, end - begin);
    at = end + 1;
  }
  return comment;
}

// Returns what a scene shows: the first sentence of the comment at its top, without the number of a figure,
// which has a column of its own; of a file without a comment its title.
std::string shown_by(const std::string& file, const std::string& title) {
  std::string text = top_comment(file);
  if (text.empty()) return title;
  if (text.starts_with("Figure ") && text.find(": ") < 30) text = text.substr(text.find(": ") + 2);
  text = text.substr(0, text.find(". "));
  if (text.ends_with('.')) text.pop_back();
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 'a' + 'A');
  if (text.size() > max_text) {
    text = text.substr(0, max_text - 3);
    text = text.substr(0, text.find_last_of(' ')) + "...";
  }
  return text;
}

// A scene with what is listed of it.
struct Entry {
  std::string name, shows;
  scene::Scene scene;
  std::optional<SceneCost> cost;
};

std::vector<Entry> entries_of(const std::optional<CostTable>& table) {
  std::vector<Entry> entries;
  for (const ShippedScene& shipped : shipped_scenes()) {
    const scene::ReadResult read = scene::read(shipped.path.string(), {}, scene::Meshes::leave);
    Entry& entry =
        entries.emplace_back(Entry{shipped.name, shown_by(read.written, read.scene.title), read.scene, {}});
    if (!table) continue;
    if (const auto cost = table->scenes.find(shipped.name); cost != table->scenes.end())
      entry.cost = cost->second;
  }
  return entries;
}

// Returns the group of a scene.
const Group& group_of(const Entry& entry) {
  const std::size_t slash = entry.name.rfind('/');
  const std::string folder = entry.name.substr(0, slash == std::string::npos ? 0 : slash + 1);
  return *std::find_if(std::begin(groups), std::end(groups),
                       [&](const Group& group) { return group.folder == nullptr || folder == group.folder; });
}

// Returns the scenes of a group.
std::vector<const Entry*> entries_in(const Group& group, const std::vector<Entry>& entries) {
  std::vector<const Entry*> found;
  for (const Entry& entry : entries)
    if (&group_of(entry) == &group) found.push_back(&entry);
  return found;
}

// Returns the bytes of all frames with pictures.
double total_bytes(const Entry& entry) {
  return (entry.scene.frames + 1.0) * (entry.cost->bytes + entry.cost->picture_bytes) +
         entry.cost->other_bytes;
}

std::string row(const Entry& entry, double speed) {
  const std::string cost =
      entry.cost
          ? fmt::format("{:>9.2g}{} {:>6.1f} {:>7.0f}", entry.cost->seconds * speed,
                        entry.cost->measured_frames < entry.scene.frames ? "*" : " ",
                        (entry.cost->bytes + entry.cost->picture_bytes) / 1e6, total_bytes(entry) / 1e6)
          : fmt::format("{:>9}  {:>6} {:>7}", "-", "-", "-");
  return fmt::format("{:<24} {:<4} {:>6} {}  {}\n", printable_line(entry.name),
                     printable_line(entry.scene.figure), entry.scene.frames, cost,
                     printable_line(entry.shows));
}

std::string text_of(const std::vector<Entry>& entries, const std::optional<CostTable>& table, double speed,
                    bool calibrated) {
  std::string text;
  bool is_partial = false;
  for (const Group& group : groups) {
    const std::vector<const Entry*> members = entries_in(group, entries);
    if (members.empty()) continue;
    text += fmt::format("{}{}\n{:<24} {:<4} {:>6} {:>9}  {:>6} {:>7}  {}\n", text.empty() ? "" : "\n",
                        group.title, "scene", "fig.", "frames", "s/frame", "MB/fr.", "MB", "shows");
    for (const Entry* entry : members) {
      text += row(*entry, speed);
      is_partial |= entry->cost && entry->cost->measured_frames < entry->scene.frames;
    }
  }
  if (!table) return text;
  text += fmt::format(
      "\ns/frame: processor seconds of simulating a frame on one thread{}, measured on {} by {} ({}). MB: "
      "with pictures, as the scene says.\n",
      calibrated ? fmt::format(", times {:.2f} for this machine", speed) : "", table->machine, table->program,
      table->date);
  if (is_partial)
    text += "* of the first frames only; `duet list --json` tells how many. Later frames may cost more.\n";
  return text;
}

Json json_of(const std::vector<Entry>& entries, const std::optional<CostTable>& table, double speed,
             std::optional<double> calibration) {
  Json scenes = Json::array();
  for (const Group& group : groups)
    for (const Entry* member : entries_in(group, entries)) {
      const Entry& entry = *member;
      Json object = {{"name", entry.name},         {"group", group.title}, {"figure", entry.scene.figure},
                     {"title", entry.scene.title}, {"shows", entry.shows}, {"frames", entry.scene.frames},
                     {"fps", entry.scene.fps}};
      if (entry.cost) {
        object["seconds"] = entry.cost->seconds * speed;
        object["measured_frames"] = entry.cost->measured_frames;
        object["substeps"] = entry.cost->substeps;
        object["frame_bytes"] = entry.cost->bytes;
        object["picture_bytes"] = entry.cost->picture_bytes;
        object["bytes"] = total_bytes(entry);
        object["memory"] = entry.cost->memory;
      }
      scenes.push_back(std::move(object));
    }
  Json object;
  if (table)
    object = {
        {"machine", table->machine}, {"program", table->program}, {"date", table->date}, {"speed", speed}};
  if (calibration) object["calibration_seconds"] = *calibration;
  object["scenes"] = std::move(scenes);
  return object;
}

}  // namespace

Outcome list(const ListOptions& options) {
  const std::vector<ShippedScene> shipped = shipped_scenes();
  if (shipped.empty())
    throw Error(
        ExitStatus::files,
        "no folder scenes/ here, beside the program's folder or where it was installed (run it in the source "
        "tree, or install it with cmake --install)");
  if (options.names) {
    std::string names;
    for (const ShippedScene& scene : shipped) names += printable_line(scene.name) + '\n';
    print(names);
    return {};
  }
  const std::optional<CostTable> table = read_costs();
  const std::optional<double> calibration = options.calibrate ? std::optional(calibrate()) : std::nullopt;
  const double speed = table && calibration ? *calibration / table->calibration_seconds : 1;
  const std::vector<Entry> entries = entries_of(table);
  print(options.json ? json_text(json_of(entries, table, speed, calibration), 2) + "\n"
                     : text_of(entries, table, speed, options.calibrate));
  return {};
}

}  // namespace duet::tools
