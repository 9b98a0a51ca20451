// `duet sim` and `duet run`: simulate a scene into a run directory. `run` draws the frames meanwhile.
#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "tools/build_info.h"
#include "tools/commands.h"
#include "tools/frame_drawer.h"
#include "tools/interrupt.h"
#include "tools/overlap_notes.h"
#include "tools/run_difference.h"
#include "tools/run_products.h"
#include "tools/run_totals.h"
#include "tools/scene_files.h"
#include "tools/version.h"
#include "tools/volume_notes.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/numerics.h"
#include "sim/base/parallel.h"
#include "sim/base/stop.h"
#include "sim/base/wording.h"
#include "sim/io/checkpoint.h"
#include "sim/io/level_set_writer.h"
#include "sim/io/run_check.h"
#include "sim/io/run_folder.h"
#include "sim/io/run_journal.h"
#include "sim/io/run_source.h"
#include "sim/io/stage_log.h"
#include "sim/io/stats_log.h"
#include "sim/io/values_file.h"
#include "sim/scene/explain.h"
#include "sim/scene/plan.h"
#include "sim/simulation/simulation.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Returns the time at which a run that may take `seconds` of wall time from now on begins no further frame.
std::chrono::steady_clock::time_point end_of(std::optional<double> seconds) {
  using WallClock = std::chrono::steady_clock;
  constexpr double longest = 1e9;  // s, some 30 years: longer times do not fit the integers of the clock
  if (!seconds || *seconds > longest) return WallClock::time_point::max();
  return WallClock::now() +
         std::chrono::duration_cast<WallClock::duration>(std::chrono::duration<double>(*seconds));
}

// One simulation and its run directory.
class Run {
 public:
  Run(const SimulateOptions& options, Report& report);

  // Checks everything, then makes the folder ready. Throws before it touches anything of an earlier run.
  void prepare();
  // Simulates to the last frame and encodes the video. Throws what stopped it.
  Outcome work();
  // Returns the outcome after a stop. `given_up` is the frame that was being computed; 0: none.
  Outcome stopped(ExitStatus status, int given_up = 0) const;

 private:
  // The manifest of this run.
  io::Manifest describe() const;
  // Throws Error (usage) if the folder holds a run.
  void require_free_folder() const;
  // Loads the newest checkpoint of this scene. Returns its frame, or -1 if the run has to start at frame 0.
  int restore();
  // Throws the reason why the run cannot be continued, and leaves its files as they are.
  void refuse_without_checkpoint(const io::CheckpointSearch& search, const io::HeldRun& held) const;
  // Throws Error (usage) if `checkpoint`, written by the program `earlier`, is of another version of the
  // numerics, because the motion would differ. With --allow-other-build it notes that instead.
  void require_same_numerics(const io::Checkpoint& checkpoint, const io::Origin& earlier);
  // Writes everything of the current frame.
  void record();
  // Writes meshes, values and level sets of the current frame.
  void write_frame(int frame, const FrameStats& stats);
  // Returns whether the wall time of --stop-after is over.
  bool time_is_over() const { return std::chrono::steady_clock::now() >= until_; }
  // Returns whether meshes and pictures of the frame are asked for.
  bool wanted(int frame) const { return !options_.stats_only && frame >= first_ && frame <= last_; }
  // Returns whether the frame has a mesh.
  bool written(int frame) const { return fs::exists(directory_.mesh(frame)); }
  // Returns whether the frame has a whole picture.
  bool drawn(int frame) const;
  // Reports damaged and lost files of the frames up to `resumed`, and keeps them for the outcome.
  void note_faults(int resumed);
  // Queues the frames up to `resumed` whose pictures are missing, and keeps those without a mesh for the
  // outcome. Announces the work.
  void redraw_missing(int resumed);
  // Returns the end of an outcome that names the frames without a mesh; empty if there are none.
  std::string unwritten_text() const;
  // Reports bodies that overlap at the start.
  void note_overlaps();
  // Reports thin bodies that are pinched between others.
  void note_pinches(const FrameStats& stats);

  const SimulateOptions& options_;
  Report& report_;
  const scene::ReadResult read_;
  const EffectSet effects_;
  const std::uint64_t identity_;
  io::RunDirectory directory_;
  const int last_, first_;
  std::chrono::steady_clock::time_point until_;  // no further frame begins then
  Simulation simulation_;
  std::vector<BodySurface> surfaces_;
  std::vector<BodySurface> rest_;  // at rest; emptied once they are written
  io::FrameValues values_;
  io::Manifest manifest_;
  std::unique_ptr<io::RunLock> lock_;
  io::RunSource source_;
  io::SourceFiles source_files_;  // emptied once they are written
  std::unique_ptr<io::LevelSetWriter> level_sets_;
  std::unique_ptr<io::StatsLog> stats_;
  std::unique_ptr<io::StageLog> stages_;
  int recorded_ = -1;                // last frame that is whole in the folder; -1: none
  std::vector<int> unwritten_;       // frames before a --resume whose meshes are asked for and not there
  std::vector<std::string> faults_;  // damaged and lost files of the frames before a --resume
  RunTotals totals_;
  std::vector<PinchStats> pinched_;  // pinches so far, each with the least room of the run
  OverlapNotes overlap_notes_;
  VolumeNotes volume_notes_;
  std::unique_ptr<FrameDrawer> drawer_;
};

Run::Run(const SimulateOptions& options, Report& report)
    : options_(options),
      report_(report),
      read_(read_scene(options.scene)),
      effects_(scene::plan_effects(read_.scene, options.scene.without).active()),
      identity_(run_identity(options.scene, read_, effects_)),
      directory_{run_folder(options.scene, options.out)},
      last_(options.frames ? options.frames->last : read_.scene.frames),
      first_(options.frames ? options.frames->first.value_or(0) : 0),
      until_(end_of(options.stop_after)),
      simulation_(read_.scene, effects_),
      overlap_notes_(simulation_) {
  simulation_.stop_when(&give_up_flag());
  if (options.ledger) simulation_.keep_ledger();
}

io::Manifest Run::describe() const {
  io::Manifest manifest;
  manifest.title = read_.scene.title;
  manifest.scene = read_.scene.path;
  manifest.command = options_.command;
  manifest.origin = {version, git_commit, compiler_text(), variant_text(), numerics_version, machine_text()};
  manifest.fps = read_.scene.fps;
  manifest.bodies = io::manifest_bodies(read_.scene, surfaces_);
  return manifest;
}

void Run::prepare() {
  if (const auto holder = io::RunClaim::holder(directory_.root);
      holder && io::life_of(holder->process) == io::Life::unknown)
    report_.note(fmt::format("{}: looking for up to {:.0f} s whether another program still writes to it: {}",
                             directory_.root.string(), io::ClaimTimes().silence, holder->text()));
  lock_ = std::make_unique<io::RunLock>(directory_, options_.draw ? "duet run" : "duet sim", options_.wait);
  if (!options_.resume && !options_.overwrite) require_free_folder();
  for (const std::string& note : read_.notes) report_.note(note);
  source_.set = all_overrides(options_.scene);
  source_.without = options_.scene.without;
  source_files_ = io::collect_source(read_, source_);
  simulation_.surfaces(surfaces_);
  simulation_.rest_surfaces(rest_);
  manifest_ = describe();
  if (options_.draw) try {
      drawer_ = std::make_unique<FrameDrawer>(read_.scene, manifest_, directory_, report_);
    } catch (const Error& error) {
      throw Error(error.status(), fmt::format("{}; `duet sim` simulates without drawing", error.what()));
    }
  const int resumed = options_.resume ? restore() : -1;
  manifest_.frames = std::max(last_, resumed);
  if (options_.overwrite) replace_run(directory_, report_);
  if (resumed >= 0) note_faults(resumed);
  directory_.journal = io::RunJournal::open(directory_.root, resumed + 1);
  io::continue_run(directory_, manifest_, read_.source);
  io::write_source(directory_, source_, std::exchange(source_files_, {}));
  recorded_ = resumed;
  stats_ = std::make_unique<io::StatsLog>(directory_, resumed);
  if (options_.hash_stages) {
    stages_ = std::make_unique<io::StageLog>(directory_, simulation_.state_hashes(), resumed);
    simulation_.hash_stages([this](const StageRecord& record) { stages_->append(record); });
  }
  if (!options_.stats_only) directory_.write(directory_.body_values(), io::npy_text(rest_));
  rest_ = {};
  if (!options_.stats_only) level_sets_ = std::make_unique<io::LevelSetWriter>(simulation_.level_sets());
  redraw_missing(resumed);
}

// Describes what a folder holds: "41 frames (0 to 40)", "1 frame (7)" or "a video".
std::string text_of(const io::HeldRun& held) {
  if (held.frames.empty()) return "a video";
  const int first = *held.frames.begin(), last = *held.frames.rbegin();
  return fmt::format("{} ({})", counted(held.frames.size(), "frame"),
                     first == last ? std::to_string(first) : fmt::format("{} to {}", first, last));
}

void Run::require_free_folder() const {
  const io::HeldRun held = io::held_run(directory_);
  if (held.is_empty()) return;
  throw Error(
      ExitStatus::usage,
      fmt::format("{}: the folder holds {} of an earlier run, which stays untouched (give --resume to "
                  "continue it, --overwrite to replace it, or another folder with --out)",
                  directory_.root.string(), text_of(held)));
}

int Run::restore() {
  const io::CheckpointSearch search = io::find_checkpoint(directory_, identity_);
  if (!search.found) {
    const io::HeldRun held = io::held_run(directory_);
    // A run that was killed while it wrote frame 0, the initial state, holds nothing that the scene lacks.
    const bool only_start = !held.has_video && (held.frames.empty() || *held.frames.rbegin() == 0);
    if (!search.faults.empty() || !only_start) refuse_without_checkpoint(search, held);
    report_.note(fmt::format("no checkpoint in {}: starting at frame 0", directory_.checkpoint().string()));
    return -1;
  }
  for (const std::string& fault : search.faults) report_.note(fault + ": passed over");
  const io::Manifest before = io::read_manifest(directory_);
  require_same_numerics(*search.found, before.origin);
  manifest_.earlier = io::earlier_frames(before, search.found->frame, manifest_.origin);
  load_checkpoint(directory_, *search.found, simulation_);
  report_.note(fmt::format("continuing after frame {}", search.found->frame));
  return search.found->frame;
}

void Run::refuse_without_checkpoint(const io::CheckpointSearch& search, const io::HeldRun& held) const {
  const std::string root = directory_.root.string();
  if (search.foreign) {
    const std::string difference = difference_from_run(directory_, options_.scene, read_);
    throw Error(
        ExitStatus::usage,
        fmt::format("{}: nothing to resume for this scene{}{} (`duet {} {} --resume --frames N` goes on "
                    "with the scene and settings of the earlier run, --overwrite instead of --resume "
                    "replaces its frames)",
                    root, difference.empty() ? "" : ": ", difference, options_.draw ? "run" : "sim",
                    shell_word(root)));
  }
  if (search.other_format)
    throw Error(ExitStatus::usage,
                fmt::format("{}: its checkpoints are of {}, and this program cannot read them (continue with "
                            "that program, or give --overwrite instead of --resume to replace its frames)",
                            root, program_text(io::read_manifest(directory_).origin)));
  std::string faults;
  for (const std::string& fault : search.faults) faults += (faults.empty() ? "" : "; ") + fault;
  if (faults.empty()) faults = directory_.checkpoint().string() + " holds no checkpoint";
  throw Error(
      ExitStatus::files,
      fmt::format("{}: the run cannot be continued: {}; {} of it stay{} untouched (give --overwrite "
                  "instead of --resume to replace what is there, or another folder with --out)",
                  root, faults, held.is_empty() ? "all" : text_of(held), held.frames.size() > 1 ? "" : "s"));
}

void Run::require_same_numerics(const io::Checkpoint& checkpoint, const io::Origin& earlier) {
  if (checkpoint.numerics == numerics_version) return;
  const std::string difference = fmt::format(
      "its frames up to {} are of numerics {} ({}), this program has numerics {} ({})", checkpoint.frame,
      checkpoint.numerics, program_text(earlier), numerics_version, program_text(manifest_.origin));
  if (!options_.allow_other_build)
    throw Error(
        ExitStatus::usage,
        fmt::format(
            "{}: {}: it would go on, but not to the same bits (continue with that program, give "
            "--allow-other-build to go on all the same, or --overwrite instead of --resume to start anew)",
            directory_.root.string(), difference));
  report_.note(fmt::format("{}: going on, not to the same bits (--allow-other-build)", difference));
}

// A file that grows by lines is marked as damaged in the journal, because its new lines would hide the
// damage.
void Run::note_faults(int resumed) {
  constexpr std::size_t most = 10;
  const io::RunDirectory before = io::open_run(directory_.root);
  if (!before.journal)
    report_.note(fmt::format("{} is missing: the files of frames up to {} are not checked",
                             io::journal_path(directory_.root).string(), resumed));
  faults_ = io::faults_of_kept(before, resumed);
  for (std::size_t i = 0; i < std::min(most, faults_.size()); ++i) report_.note(faults_[i]);
  if (faults_.size() > most)
    report_.note(fmt::format("{} more files are damaged or missing: `duet verify {}` names them all",
                             faults_.size() - most, directory_.root.string()));
  if (!before.journal) return;
  for (const fs::path& path : {directory_.stats(), directory_.stage_hashes()})
    if (const auto entry = before.journal->entry(path);
        entry && !entry->is_flawed && !before.journal->fault(path).empty())
      before.journal->flaw(path);
}

bool Run::drawn(int frame) const {
  // A run with a journal lists every picture.
  const fs::path image = directory_.image(frame);
  if (!io::holds_bytes(image)) return false;
  if (frame < directory_.journal->first_frame()) return true;
  const auto entry = directory_.journal->entry(image);
  return entry && entry->state == io::RunJournal::Entry::State::whole &&
         directory_.journal->fault(image).empty();
}

// Frames that an earlier run simulated are drawn if their pictures are missing. Frames that it did not write
// cannot be drawn: the outcome names them.
void Run::redraw_missing(int resumed) {
  std::vector<int> to_draw_again;
  for (int frame = first_; frame <= std::min(resumed, last_); ++frame) {
    // A mesh that the journal lists was lost, which is a fault.
    if (!written(frame) && !options_.stats_only && !directory_.journal->entry(directory_.mesh(frame)))
      unwritten_.push_back(frame);
    if (drawer_ && written(frame) && !drawn(frame) &&
        directory_.journal->fault(directory_.mesh(frame)).empty())
      to_draw_again.push_back(frame);
  }
  int to_draw = static_cast<int>(to_draw_again.size());
  if (drawer_) to_draw += std::max(0, last_ - std::max(first_, resumed + 1) + 1);
  report_.start(read_.scene.title.empty() ? read_.scene.path : read_.scene.title, directory_.root.string(),
                std::max(resumed, 0), last_, to_draw);
  if (!drawer_) return;
  for (const int frame : to_draw_again) drawer_->add(frame);
}

std::string Run::unwritten_text() const {
  if (unwritten_.empty()) return {};
  return fmt::format(
      "; {} {} no meshes, because the earlier run wrote none (--overwrite instead of --resume "
      "simulates all frames anew)",
      io::frames_text(unwritten_), unwritten_.size() == 1 ? "has" : "have");
}

// Reports at most ten pairs: a pile may have hundreds of them, which `duet check` lists.
void Run::note_overlaps() {
  constexpr std::size_t most = 10;
  const std::vector<InitialOverlap>& overlaps = simulation_.initial_overlaps();
  for (std::size_t i = 0; i < std::min(most, overlaps.size()); ++i)
    report_.note(describe_separation(overlaps[i]));
  if (overlaps.size() > most)
    report_.note(fmt::format("{} more pairs of bodies overlap: `duet check {}` names them all",
                             overlaps.size() - most, options_.scene.name));
}

// Reports each body once for the two that pinch it; the outcome states the least room that these left it.
void Run::note_pinches(const FrameStats& stats) {
  for (const PinchStats& pinch : stats.pinched) {
    const auto known = std::find_if(pinched_.begin(), pinched_.end(), [&](const PinchStats& one) {
      return one.body == pinch.body && one.first == pinch.first && one.second == pinch.second;
    });
    if (known == pinched_.end()) {
      pinched_.push_back(pinch);
      report_.note(fmt::format(
          "`{}`, {:.3g} m thick, is pinched between `{}` and `{}` from {:.4g} s on (frame {}): they leave it "
          "{:.3g} m, which no contact can; it yields and stays halfway between them",
          pinch.body, pinch.thickness, pinch.first, pinch.second, pinch.time, stats.frame, pinch.room));
    } else if (pinch.room < known->room) {
      known->room = pinch.room;
      known->time = stats.time;
    }
  }
}

void Run::write_frame(int frame, const FrameStats& stats) {
  simulation_.surfaces(surfaces_);
  directory_.write(directory_.mesh(frame), io::obj_text(surfaces_));
  io::measure_values(simulation_, surfaces_, values_);
  directory_.write(directory_.values(frame), io::npy_text(values_));
  if (const auto bodies = simulation_.level_sets(); !bodies.empty())
    level_sets_->write(directory_, frame, stats.time, bodies);
}

// The checkpoint is written last: a frame that has one is whole.
void Run::record() {
  lock_->require_held();
  const int frame = simulation_.frame();
  const FrameStats stats = simulation_.stats();
  if (wanted(frame)) write_frame(frame, stats);
  note_pinches(stats);
  if (const std::optional<std::string> note = overlap_notes_.look(simulation_, stats)) report_.note(*note);
  for (const std::string& note : volume_notes_.look(simulation_, read_.scene, stats)) report_.note(note);
  stats_->append(stats);
  if (stages_) stages_->list();
  io::write_checkpoint(directory_, identity_, {frame, simulation_.save_state()});
  recorded_ = frame;
  report_.simulated(stats);
  if (drawer_ && wanted(frame)) drawer_->add(frame);
}

Outcome Run::work() {
  const auto begin = std::chrono::steady_clock::now();
  totals_.start_with(simulation_.stats());
  if (recorded_ < 0) {
    note_overlaps();
    const WorldSizes sizes = simulation_.sizes();
    if (const std::string warning = scene::step_warning(read_.scene, sizes); !warning.empty())
      report_.note(warning);
    for (const std::string& warning : scene::skin_warnings(sizes)) report_.note(warning);
    record();
  }
  for (bool advanced = false; recorded_ < last_; advanced = true) {
    if (interrupted()) return stopped(ExitStatus::interrupted);
    if (advanced && time_is_over()) return stopped(ExitStatus::unfinished);
    try {
      const FrameInHand frame(recorded_ + 1,
                              advanced ? std::optional(simulation_.stats().seconds) : std::nullopt);
      simulation_.advance_frame();
    } catch (const Stopped&) {
      return stopped(ExitStatus::interrupted, simulation_.frame() + 1);
    }
    record();
    totals_.add(simulation_.stats());
  }
  std::string video;
  if (drawer_) {
    const bool all_drawn = drawer_->finish(until_);
    if (interrupted()) return stopped(ExitStatus::interrupted);
    if (!all_drawn) return stopped(ExitStatus::unfinished);
    const std::string name = io::video_path(directory_, manifest_).stem().string();
    video = "; " + render::encode_video(directory_, name, manifest_.fps, "ffmpeg", &stop_flag());
    if (interrupted()) return stopped(ExitStatus::interrupted);
  }
  std::string pinched;
  for (const PinchStats& pinch : pinched_)
    pinched += fmt::format("; `{}` ({:.3g} m) pinched between `{}` and `{}`, at least {:.3g} m apart",
                           pinch.body, pinch.thickness, pinch.first, pinch.second, pinch.room);
  pinched += overlap_notes_.outcome() + volume_notes_.outcome();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  std::string drawing;
  if (drawer_ && drawer_->seconds_per_frame() > 0)
    drawing = fmt::format("; {:.2g} s of drawing a picture", drawer_->seconds_per_frame());
  const std::string text =
      fmt::format("frames {} to {} in {}, {:.1f} s{}{}{}{}{}", first_, last_, directory_.root.string(),
                  seconds, totals_.text(), drawing, pinched, video, unwritten_text());
  if (faults_.empty()) return {ExitStatus::done, text};
  return {
      ExitStatus::files,
      fmt::format("{}; but of the frames before {} file{} damaged or missing, such as {} (`duet verify {}` "
                  "names all)",
                  text, faults_.size() == 1 ? "a" : std::to_string(faults_.size()),
                  faults_.size() == 1 ? " is" : "s are", faults_.front(), directory_.root.string())};
}

Outcome Run::stopped(ExitStatus status, int given_up) const {
  if (recorded_ < 0)
    return {status, fmt::format("before frame 0 was written to {}", directory_.root.string())};
  std::string text = given_up > 0 ? fmt::format("frame {} was given up", given_up)
                                  : fmt::format("after frame {}", recorded_);
  text += fmt::format("; frames up to {} are whole in {}, whose state is {}", recorded_,
                      directory_.root.string(), io::checkpoint_path(directory_, recorded_).string());
  // A failed simulation fails again at the same place. A second attempt makes sense for other reasons only.
  if (status != ExitStatus::simulation) text += fmt::format("; continue with `{}`", options_.resume_command);
  return {status, text};
}

}  // namespace

Outcome simulate(const SimulateOptions& options, Report& report) {
  set_thread_count(options.threads);
  Run run(options, report);
  run.prepare();
  const OrderlyStop orderly;
  try {
    return run.work();
  } catch (...) {
    return run.stopped(report.failure(std::current_exception()));
  }
}

}  // namespace duet::tools
