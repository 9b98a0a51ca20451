// The options of the commands that look at scenes without a run: check, explain, list; and of cache.
#include "tools/option_parts.h"
#include "tools/scene_files.h"

namespace duet::tools {
namespace {

void add_check(CLI::App& app, CommandLine& line) {
  CLI::Option* reference = app.add_flag("--reference", line.check.reference,
                                        "Print all keys of a scene: type, unit, default, bounds");
  add_scene(app, line.check.scene)->excludes(reference);
  app.callback([&line] {
    if (!line.check.reference && line.check.scene.name.empty())
      throw CLI::RequiredError("SCENE (or --reference)");
    line.command = [&line](Report&) {
      std::string unused;
      resolve_run(line.check.scene, unused);
      return check(line.check);
    };
  });
}

void add_explain(CLI::App& app, CommandLine& line) {
  ExplainOptions& options = line.explain;
  add_scene(app, options.scene)->required();
  add_without(app, options.scene);
  CLI::Option* estimate =
      app.add_flag("--estimate", options.estimate,
                   "Simulate and draw the first frames, and estimate time, disk space and memory "
                   "of the run from them; writes nothing that stays");
  app.add_option("--samples", options.sample_seconds,
                 "Simulate for so much processor time, and a frame at least")
      ->check(between(1e-3, 1e6))
      ->needs(estimate)
      ->type_name("SECONDS")
      ->capture_default_str();
  app.add_option("--out", options.out, "Folder of the run whose free space is looked at; default out/<scene>")
      ->type_name("DIR");
  app.add_flag("--json", options.json, "The same as JSON");
  app.callback([&line] {
    line.command = [&line](Report&) {
      resolve_run(line.explain.scene, line.explain.out);
      return explain(line.explain);
    };
  });
}

void add_list(CLI::App& app, CommandLine& line) {
  ListOptions& options = line.list;
  CLI::Option* names = app.add_flag("--names", options.names, "Only the names, one a line");
  app.add_flag(
         "--calibrate", options.calibrate,
         "Scale the seconds from the machine of the table to this one, by a simulation of half a second")
      ->excludes(names);
  app.add_flag("--json", options.json, "The same as JSON")->excludes(names);
  app.callback([&line] { line.command = [&line](Report&) { return list(line.list); }; });
}

}  // namespace

void add_scene_commands(CLI::App& app, CommandLine& line) {
  add_check(*app.add_subcommand("check", "Validate a scene: all problems with file, line and column"), line);
  add_explain(*app.add_subcommand("explain", "What would be simulated and why, and what it takes"), line);
}

void add_cache_and_list(CLI::App& app, CommandLine& line) {
  CLI::App& cache_app = *app.add_subcommand(
      "cache", "Where tetrahedra that fill meshes are kept from one command to the next, and how many");
  cache_app.add_flag("--clear", line.cache.clear, "Remove them");
  cache_app.footer("DUET_CACHE in the environment names another folder; DUET_CACHE=off keeps nothing.");
  cache_app.callback([&line] { line.command = [&line](Report&) { return cache(line.cache); }; });

  add_list(*app.add_subcommand("list", "The scenes that ship: what they show, cost and write"), line);
}

}  // namespace duet::tools
