// `duet hashes`: compares the hashes of the state with the committed ones or renews these, or finds the first
// stage in which two runs differ.
#include <algorithm>
#include <ctime>
#include <filesystem>
#include <optional>
#include <system_error>

#include "tools/commands.h"
#include "tools/hash_table.h"
#include "tools/scene_files.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/base/parallel.h"
#include "sim/io/expected_hashes.h"
#include "sim/io/stage_log.h"
#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Scenes with at most this many bodies have hashes by body for every short frame. Larger scenes have them at
// the last short frame and later: a larger number makes the committed files longer.
constexpr std::size_t few_bodies = 32;

double processor_seconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// The result of one entry of the table.
struct Result {
  std::string scene;
  std::string status;   // equal, differs or failed; with --write: same, changed or new
  std::string message;  // text of the failure or difference
  std::optional<io::HashDifference> difference;
  ExitStatus exit = ExitStatus::done;
  int last_frame = -1;                    // last frame that was compared or written
  bool ended_early = false;               // --seconds ended it
  double build_seconds = 0, seconds = 0;  // processor time until frame 0 was built, and in all

  void fail(ExitStatus with, const std::string& text) {
    status = with == ExitStatus::differs ? "differs" : "failed";
    exit = with;
    message = text;
  }
};

// Returns the commands that find the stage in which two programs begin to differ.
std::string commands_to_look_further(const HashEntry& entry, int frame) {
  std::string options;
  for (const std::string& set : entry.set) options += fmt::format(" --set '{}'", set);
  return fmt::format(
      "to find the stage, run `duet sim {}{} --frames {} --stats-only --hash-stages --out RUN` with both "
      "programs, then "
      "`duet hashes --stages RUN_A RUN_B`",
      entry.scene, options, frame);
}

// Simulates the scene of one entry and compares or writes the hashes of its frames.
class Pass {
 public:
  Pass(const HashEntry& entry, const HashesOptions& options, const fs::path& folder)
      : entry_(entry), options_(options), file_(folder / (entry.name + ".txt")) {
    result_.scene = entry.name;
  }

  Result run() {
    begin_ = processor_seconds();
    try {
      read();
      simulate();
      if (options_.write)
        write();
      else
        conclude();
    } catch (const Error& error) {
      result_.fail(error.status(), error.what());
    }
    result_.seconds = processor_seconds() - begin_;
    return result_;
  }

 private:
  int last() const { return options_.full && entry_.later ? *entry_.later : entry_.short_frames; }
  // Returns whether the frame has an expected hash that this command looks at.
  bool is_wanted(int frame) const {
    return frame <= entry_.short_frames || (options_.full && entry_.later == frame);
  }
  // Returns the expected hashes of a frame; null: there are none.
  const io::FrameHashes* expected(int frame) const {
    for (const io::FrameHashes& entry : expected_)
      if (entry.frame == frame) return &entry;
    return nullptr;
  }

  // Reads the expected hashes. When they are about to be written, unreadable ones count as none.
  void read() {
    if (options_.write && !fs::exists(file_)) return;
    if (!fs::exists(file_))
      throw FileError(file_.string(), "is missing: the scene has no expected hashes",
                      "`tools/hashes --write " + entry_.name + "` makes it; commit it");
    try {
      expected_ = io::read_expected(file_);
    } catch (const Error&) {
      if (!options_.write) throw;
    }
    if (options_.write) return;
    for (int frame = 0; frame <= last(); ++frame)
      if (is_wanted(frame) && !expected(frame))
        throw FileError(file_.string(), fmt::format("has no hash of frame {}", frame),
                        fmt::format("`tools/hashes --write{} {}` renews it",
                                    frame > entry_.short_frames ? " --full" : "", entry_.name));
  }

  void simulate() {
    SceneChoice choice;
    choice.name = entry_.scene;
    choice.set = entry_.set;
    const scene::ReadResult read = read_scene(choice);
    Simulation simulation(read.scene, scene::plan_effects(read.scene, {}).active());
    result_.build_seconds = processor_seconds() - begin_;
    while (true) {
      if (is_wanted(simulation.frame())) look_at(simulation);
      // If a difference names no body, go on: the next frame that has hashes by body may name one.
      if (result_.difference && !result_.difference->quantity.empty()) return;
      if (simulation.frame() >= last()) return;
      if (options_.seconds > 0 && processor_seconds() - begin_ >= options_.seconds) {
        result_.ended_early = true;
        return;
      }
      simulation.advance_frame();
    }
  }

  // Compares the hashes of the current frame with the expected ones, or keeps them for write().
  void look_at(const Simulation& simulation) {
    io::FrameHashes found;
    found.frame = simulation.frame();
    found.whole = io::whole_hash(simulation.stats().hash);
    const io::FrameHashes* then = expected(found.frame);
    const std::vector<BodyHashes> bodies = simulation.state_hashes();
    const bool by_body = options_.write ? bodies.size() <= few_bodies || found.frame >= entry_.short_frames
                                        : !then->lines.empty();
    if (by_body) found.lines = io::hash_lines(bodies);
    result_.last_frame = found.frame;
    if (options_.write) {
      found_.push_back(std::move(found));
    } else if (const auto difference = io::compare_hashes(*then, found)) {
      if (!first_) first_ = difference;
      result_.difference = difference;
    }
  }

  // Makes a text of the first difference.
  void conclude() {
    result_.status = "equal";
    if (!result_.difference) return;
    std::string text = first_->text();
    if (first_->frame != result_.difference->frame)
      text = fmt::format("frame {} is the first to differ; in the next that has hashes by body, {}",
                         first_->frame, result_.difference->text());
    result_.difference->frame = first_->frame;
    result_.fail(ExitStatus::differs,
                 fmt::format("{}; {}", text, commands_to_look_further(entry_, first_->frame)));
  }

  void write() {
    // The later frame stays as it is unless it was simulated now.
    if (const io::FrameHashes* later = entry_.later ? expected(*entry_.later) : nullptr;
        later && !options_.full)
      found_.push_back(*later);
    std::string about = fmt::format("Expected hashes of `{}`", entry_.name);
    for (const std::string& set : entry_.set) about += fmt::format(", {}", set);
    about += "; tests/hashes/README.md says how to read them";
    const std::string text = io::expected_text(about, found_);
    const bool is_new = !fs::exists(file_);
    result_.status = is_new ? "new" : io::read_file(file_) == text ? "same" : "changed";
    if (result_.status == "same") return;
    io::create_folder(file_.parent_path());
    io::write_atomically(file_, text);
  }

  const HashEntry& entry_;
  const HashesOptions& options_;
  const fs::path file_;
  std::vector<io::FrameHashes> expected_, found_;
  std::optional<io::HashDifference> first_;
  double begin_ = 0;
  Result result_;
};

void print_result(const HashesOptions& options, const Result& result) {
  if (options.json) {
    nlohmann::ordered_json object = {{"event", "scene"},
                                     {"scene", result.scene},
                                     {"status", result.status},
                                     {"last_frame", result.last_frame},
                                     {"ended_early", result.ended_early},
                                     {"build_seconds", result.build_seconds},
                                     {"seconds", result.seconds}};
    if (result.difference) {
      object["frame"] = result.difference->frame;
      object["body"] = result.difference->body;
      object["quantity"] = result.difference->quantity;
      object["bodies"] = result.difference->bodies;
    }
    if (!result.message.empty()) object["message"] = result.message;
    return print(json_text(object) + "\n");
  }
  std::string text = fmt::format("{:<8} {}: ", result.status, result.scene);
  if (!result.message.empty())
    text += result.message;
  else
    text +=
        fmt::format("to frame {}{}, {:.1f} s of processor time ({:.1f} before frame 0)", result.last_frame,
                    result.ended_early ? " (--seconds)" : "", result.seconds, result.build_seconds);
  print(text + "\n");
}

// Returns the folder of the expected hashes: `given`, or tests/hashes of the current folder, or that of the
// source tree to whose build the program belongs. The program is build/duet, or
// build/libexec/duet/duet-x86-64 in a portable build.
fs::path expected_folder(const std::string& given) {
  if (!given.empty()) return given;
  const fs::path name = fs::path("tests") / "hashes";
  if (fs::exists(name)) return name;
  std::error_code unknown;
  const fs::path program = fs::read_symlink("/proc/self/exe", unknown).parent_path();
  for (const char* top : {"..", "../../.."})
    if (const fs::path folder = (program / top / name).lexically_normal(); fs::exists(folder)) return folder;
  throw FileError(name.string(), "is neither here nor in the source tree of the program",
                  "run it in the source tree, or give the folder with --expected");
}

std::vector<HashEntry> chosen_entries(const HashesOptions& options, const fs::path& folder) {
  std::vector<HashEntry> table = read_hash_table(folder / "frames.toml");
  if (options.scenes.empty()) return table;
  std::vector<HashEntry> chosen;
  for (const std::string& name : options.scenes)
    chosen.push_back(find_entry(table, name, folder / "frames.toml"));
  return chosen;
}

}  // namespace

Outcome hashes(const HashesOptions& options) {
  if (!options.stages.empty()) {
    const io::StageComparison comparison =
        io::compare_stages(find_run(options.stages.at(0)), find_run(options.stages.at(1)));
    return {comparison.difference ? ExitStatus::differs : ExitStatus::done, comparison.text()};
  }
  set_thread_count(options.threads);
  const fs::path folder = expected_folder(options.folder);
  const std::vector<HashEntry> entries = chosen_entries(options, folder);
  int good = 0;
  ExitStatus status = ExitStatus::done;
  for (const HashEntry& entry : entries) {
    const Result result = Pass(entry, options, folder).run();
    if (result.exit == ExitStatus::interrupted)
      return {ExitStatus::interrupted, fmt::format("before {} was through", entry.name)};
    print_result(options, result);
    if (result.exit == ExitStatus::done) ++good;
    // A scene that could not be compared has a greater exit status than one that differs.
    if (static_cast<int>(result.exit) > static_cast<int>(status)) status = result.exit;
  }
  return {status, fmt::format("{} of {} scenes {}", good, entries.size(),
                              options.write ? "written or as they were" : "have the expected hashes")};
}

}  // namespace duet::tools
