// The options of `encode` and `farm`.
#include "tools/manual/examples.h"
#include "tools/option_parts.h"
#include "tools/scene_files.h"
#include <CLI/CLI.hpp>

namespace duet::tools {
namespace {

void add_encode(CLI::App& app, CommandLine& line) {
  app.add_option("run", line.encode.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  add_report(app, line);
  app.callback([&line] { line.command = [&line](Report&) { return encode(line.encode); }; });
}

void add_farm(CLI::App& app, CommandLine& line) {
  FarmOptions& options = line.farm;
  add_scene(app, options.scene)->required()->type_name("SCENE|RUN|STUDY");
  add_without(app, options.scene);
  app.add_option("--engine", options.engine, "What carries out the tasks: slurm, parallel (GNU) or local")
      ->check(CLI::IsMember({"slurm", "parallel", "local"}))
      ->type_name("ENGINE");
  app.add_option(
         "--out", options.out,
         "Folder of the run or study; scripts and variations go to DIR.farm; default as for `duet run`")
      ->type_name("DIR");
  add_repeatable(app, "--vary", options.vary, "KEY=A,B,C",
                 "A run for each of the values; several --vary: for each combination; repeatable");
  app.add_option("--seeds", options.seeds, "A run for each of the seeds 1 to N of scattered instances")
      ->check(CLI::Range(1, 10'000))
      ->type_name("N");
  app.add_option("--frames", line.frames, "Last frame; default that of the scene")->type_name("N");
  app.add_option("--tasks", options.tasks, "Tasks that draw a run; default 8, and 1 for each variation")
      ->check(CLI::Range(1, 100'000))
      ->type_name("N");
  app.add_option("--threads", options.threads, "Threads, and processors, of a simulation")
      ->check(CLI::Range(1, 1024))
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--time-limit", options.minutes, "slurm: time limit of a job")
      ->check(CLI::Range(1, 1'000'000))
      ->type_name("MINUTES")
      ->capture_default_str();
  app.add_option("--chain", options.chain,
                 "slurm: jobs of a simulation, each of which continues the one before")
      ->check(CLI::Range(1, 1000))
      ->type_name("N")
      ->capture_default_str();
  add_repeatable(app, "--sbatch", options.sbatch, "OPTION",
                 "slurm: a further option of all jobs, such as --sbatch=--partition=long; repeatable");
  app.add_flag("--submit", options.submit, "Submit the tasks; parallel and local: carry them out");
  app.add_flag("--overwrite", options.overwrite,
               "Replace the scripts of an earlier call, and runs of other settings; others stay");
  CLI::Option* status = app.add_flag("--status", options.status, "How far the run or its variations are");
  app.add_flag("--collect", options.collect,
               "Write table, contact sheet and page of the variations; the scripts call it")
      ->excludes(status);
  add_report(app, line);
  app.footer("Exit status: 0 done; with --status 75 tasks are left and 3 some failed.");
  app.callback([&line] {
    line.command = [&line](Report& report) {
      if (!line.frames.empty()) line.farm.frames = parse_frames(line.frames);
      line.farm.json = line.json;
      return farm(line.farm, report);
    };
  });
}

}  // namespace

void add_encode_and_farm(CLI::App& app, CommandLine& line) {
  add_encode(*app.add_subcommand("encode", "Encode the video of a run's pictures"), line);
  add_farm(*app.add_subcommand("farm", "Many machines for a run, its variations or a study"), line);
}

}  // namespace duet::tools
