// `duet overlaps`: measures how deep the bodies at the end of a run overlap, also between the points at which
// they are in contact.
#include "sim/simulation/overlaps.h"

#include <filesystem>

#include "tools/commands.h"
#include "tools/run_difference.h"
#include "tools/scene_files.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/base/files.h"
#include "sim/io/checkpoint.h"
#include "sim/io/run_journal.h"
#include "sim/scene/plan.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

nlohmann::ordered_json object(const DeepestOverlap& overlap) {
  return {{"depth", overlap.depth},
          {"guest", overlap.guest},
          {"host", overlap.host},
          {"place", {overlap.place.x(), overlap.place.y(), overlap.place.z()}}};
}

std::string line(const char* kind, const DeepestOverlap& overlap) {
  if (overlap.depth == 0) return fmt::format("{}: none overlaps\n", kind);
  return fmt::format("{}: at most {:.3g} mm, {} in {} at ({:.4g}, {:.4g}, {:.4g})\n", kind,
                     1000 * overlap.depth, overlap.guest, overlap.host, overlap.place.x(), overlap.place.y(),
                     overlap.place.z());
}

// Throws FileError if a checkpoint of a later frame than `found` is damaged or missing: the overlaps of an
// older state would pass for those of the run's end. Throws it also if the run's journal does not list the
// checkpoint and the statistics, by which its state is checked, as they are.
void require_newest(const io::RunDirectory& run, const io::CheckpointSearch& search) {
  const int frame = search.found->frame;
  if (!search.faults.empty())
    throw FileError(run.root.string(),
                    fmt::format("{}; the checkpoint of frame {} is older", search.faults[0], frame),
                    "remove the damaged file to look at the older one, or continue the run with --resume");
  if (!run.journal) return;
  for (const auto& [name, entry] : run.journal->entries())
    if (entry.state == io::RunJournal::Entry::State::whole && fs::path(name).parent_path() == "checkpoint" &&
        io::frame_of_file(name, ".bin") >= frame)
      run.require_whole(run.root / name);
  run.require_whole(run.stats());
}

}  // namespace

Outcome overlaps(const OverlapOptions& options) {
  const scene::ReadResult read = read_scene(options.scene);
  const EffectSet effects = scene::plan_effects(read.scene, options.scene.without).active();
  const io::RunDirectory run = find_run(run_folder(options.scene, options.out).string());
  const io::CheckpointSearch search = io::find_checkpoint(run, run_identity(options.scene, read, effects));
  if (!search.found && search.other_format && !search.foreign)
    throw Error(
        ExitStatus::usage,
        fmt::format("{}: its checkpoints are of {}, and this program cannot read them (look at it with "
                    "that program, or simulate the scene anew in another folder)",
                    run.root.string(), io::program_text(io::read_manifest(run).origin)));
  if (!search.found) {
    const std::string difference =
        search.foreign ? difference_from_run(run, options.scene, read) : std::string();
    throw Error(ExitStatus::usage,
                fmt::format("{}: no whole checkpoint of this scene{}{} (give the scene, --set and --without "
                            "that the run was simulated with)",
                            run.root.string(), difference.empty() ? "" : ": ", difference));
  }
  require_newest(run, search);
  Simulation simulation(read.scene, effects);
  load_checkpoint(run, *search.found, simulation);
  const Overlaps found = find_overlaps(simulation, options.spacing);
  if (options.json) {
    nlohmann::ordered_json result = {{"frame", search.found->frame},
                                     {"spacing", options.spacing},
                                     {"rigid", object(found.rigid)},
                                     {"deformable", object(found.deformable)}};
    if (found.drawn) result["drawn"] = object(*found.drawn);
    print(json_text(result) + '\n');
  } else {
    print(fmt::format("frame {}, surfaces looked at every {:g} mm\n", search.found->frame,
                      1000 * options.spacing) +
          line("rigid bodies", found.rigid) + line("deformable bodies", found.deformable) +
          (found.drawn ? line("drawn surfaces", *found.drawn) : ""));
  }
  return {};
}

}  // namespace duet::tools
