#include "tools/command_line.h"

#include "tools/manual/examples.h"
#include "tools/option_parts.h"
#include "tools/scene_files.h"
#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "sim/io/run_directory.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {
namespace {

// Returns the formats in which a run is to be exported at its end: those of --formats, or else of the scene.
std::vector<std::string> formats_of(const SimulateOptions& options) {
  if (!options.formats.empty() || options.stats_only) return options.formats;
  const io::RunDirectory run{run_folder(options.scene, options.out)};
  return scene::read(run.scene().string(), {}, scene::Meshes::leave).scene.output.formats;
}

// Exports a run that came to its end, and adds to its outcome. Earlier exports of the run are replaced. Stops
// at the first failure.
void add_exports(const SimulateOptions& options, Outcome& outcome, Report& report) {
  if (outcome.status != ExitStatus::done) return;
  for (const std::string& format : formats_of(options)) {
    if (outcome.status != ExitStatus::done) return;
    ExportOptions how;
    how.run = run_folder(options.scene, options.out).string();
    how.format = format;
    how.overwrite = true;
    try {
      const Outcome exported = export_run(how, report);
      outcome.status = exported.status;
      outcome.text += fmt::format("; {}: {}", format, exported.text);
    } catch (...) {
      outcome.status = report.failure(std::current_exception());
      outcome.text += fmt::format("; {}: not exported", format);
    }
  }
}

// Whether a command draws what it simulates.
enum class Pictures { are_drawn, are_left_out };

// Adds the options that say what becomes of a run that the folder holds already, and when this call ends.
void add_continuation(CLI::App& app, SimulateOptions& options) {
  CLI::Option* resume =
      app.add_flag("--resume", options.resume,
                   "Continue the run in the folder after its last whole frame; removes nothing");
  app.add_option(
         "--stop-after", options.stop_after,
         "Begin no further frame when this wall time is over, and end with status 75; with --resume the "
         "same command goes on until all is there. Each call simulates one frame at least")
      ->check(CLI::PositiveNumber)
      ->type_name("SECONDS");
  app.add_option("--wait", options.wait,
                 "Wait so long if another program writes to the folder; default: do not wait")
      ->check(between(0, 1e9))
      ->type_name("SECONDS");
  app.add_flag("--overwrite", options.overwrite,
               "Replace the run in the folder: its frames, pictures, statistics and checkpoints are removed "
               "first, and exports, page and report that show them. Without it and --resume a folder that "
               "holds a run is refused")
      ->excludes(resume);
  app.add_flag("--allow-other-build", options.allow_other_build,
               "Continue also a run whose frames another version of the numerics computed")
      ->needs(resume);
}

void add_simulate(CLI::App& app, CommandLine& line, Pictures pictures) {
  const bool draw = pictures == Pictures::are_drawn;
  SimulateOptions& options = line.simulate;
  add_scene(app, options.scene)->required();
  app.add_option("--out", options.out,
                 "Folder to write to; default out/<name of a scene that ships, or of the file>")
      ->type_name("DIR");
  app.add_option(
         "--frames", line.frames,
         "N: stop after frame N. A:B: simulate to frame B, write the meshes, level sets and pictures of "
         "frames A to B only")
      ->type_name("N|A:B");
  app.add_option("--threads", options.threads,
                 "Threads of the simulation; default all cores. Results do not depend on it")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  add_without(app, options.scene);
  app.add_flag("--ledger", options.ledger,
               "What every stage does to momentum and energy, in stats.jsonl (tools/plot-ledger draws it); "
               "slower, the same results");
  app.add_flag("--hash-stages", options.hash_stages,
               "Hashes of the state after every stage, in hashes.jsonl (`duet hashes --stages A B` compares "
               "two runs); "
               "slower, the same results");
  CLI::Option* formats =
      app.add_option("--formats", options.formats,
                     "Export the run at its end, as `duet export --to` does: pc2,glb; in place "
                     "of those of [output] formats in the scene")
          ->delimiter(',')
          ->type_name("FORMAT,...");
  if (!draw)
    app.add_flag("--stats-only", options.stats_only,
                 "Write stats.jsonl and checkpoints, no meshes and level sets")
        ->excludes(formats);
  add_continuation(app, options);
  add_report(app, line);
  app.callback([&line, draw] {
    line.command = [&line, draw](Report& report) {
      line.simulate.draw = draw;
      resolve_run(line.simulate.scene, line.simulate.out);
      if (!line.frames.empty()) line.simulate.frames = parse_frames(line.frames);
      for (const std::string& format : line.simulate.formats) require_format(format);
      Outcome outcome = simulate(line.simulate, report);
      add_exports(line.simulate, outcome, report);
      return outcome;
    };
  });
}

void add_new(CLI::App& app, CommandLine& line) {
  NewOptions& options = line.new_scene;
  app.add_option("name", options.name, "Name or path of the scene to write; the ending .toml may be left out")
      ->type_name("NAME")
      ->required();
  CLI::Option* template_name =
      app.add_option("--template", options.template_name,
                     "What the scene begins with: drop (default), stack, cloth, rope, creature or chain")
          ->type_name("TEMPLATE");
  app.add_option("--mesh", options.mesh,
                 "Closed triangle mesh (.obj .ply .stl .gltf .glb) that falls on a step as a soft body")
      ->excludes(template_name)
      ->type_name("FILE");
  app.add_flag("--overwrite", options.overwrite, "Replace the file that is there");
  add_report(app, line);
  app.footer(
      "Exit status: 0 done; 2 bad usage, a mesh that no scene accepts, or a file that is there; 4 a "
      "file cannot be written.");
  app.callback([&line] { line.command = [&line](Report&) { return new_scene(line.new_scene); }; });
}

void add_preview(CLI::App& app, CommandLine& line) {
  PreviewOptions& options = line.preview;
  add_scene(app, options.scene)->required();
  app.add_option(
         "--frame", options.frame,
         "Simulate to frame N and draw it; with --moments the last frame of the sheet. Default: 0, and "
         "the scene's last one")
      ->check(CLI::Range(0, 1'000'000))
      ->type_name("N");
  app.add_option("--moments", options.moments, "Draw N frames, equally far apart, onto one sheet")
      ->check(CLI::Range(2, 16))
      ->type_name("N");
  app.add_option("--out", options.out, "PNG file to write; default out/<scene>-preview.png")
      ->type_name("FILE.png");
  app.add_option("--width", options.width, "Pixels of a picture; default 320, or 16/9 of the height")
      ->check(CLI::Range(16, 16384))
      ->type_name("W");
  app.add_option("--height", options.height, "Pixels of a picture; default 180, or 9/16 of the width")
      ->check(CLI::Range(16, 16384))
      ->type_name("H");
  add_report(app, line);
  app.callback([&line] { line.command = [&line](Report& report) { return preview(line.preview, report); }; });
}

void add_render(CLI::App& app, CommandLine& line) {
  app.add_option("run", line.render.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  app.add_option("--frames", line.frames,
                 "N: draw frame N. A:B: draw frames A to B. Default: all, and the video")
      ->type_name("N|A:B");
  app.add_option("--out", line.render.out,
                 "Folder for pictures (in its image/) and video; default that of the run, whose pictures are "
                 "replaced")
      ->type_name("DIR");
  CLI::Option* skip = app.add_flag("--skip-existing", line.render.skip_existing,
                                   "Leave pictures that are there, whole and of the size asked for");
  CLI::Option* missing =
      app.add_flag("--missing", line.render.missing,
                   "Draw what is not there or not whole of the frames that are simulated so far; no video. "
                   "Several programs may do so at the same time")
          ->excludes(skip);
  app.add_option("--wait", line.render.wait,
                 "With --missing: wait so long for the next frame of a simulation that goes on; status 75 if "
                 "frames are left then")
      ->check(between(0, 1e9))
      ->needs(missing)
      ->type_name("SECONDS");
  add_repeatable(app, "--set", line.render.set, "KEY=VALUE",
                 "Change a key of camera, lights, looks, render or sky; repeatable");
  add_report(app, line);
  app.callback([&line] {
    line.command = [&line](Report& report) {
      if (!line.frames.empty()) line.render.frames = parse_frames(line.frames);
      return render(line.render, report);
    };
  });
}

void add_tetrahedralize(CLI::App& app, CommandLine& line) {
  TetrahedralizeOptions& options = line.tetrahedralize;
  app.add_option("in", options.in, "Closed triangle mesh: .obj .ply .stl .gltf .glb")
      ->type_name("IN")
      ->required();
  app.add_option("out", options.out, "Tetrahedra: .mesh (Medit; scenes read it) or .vtk (ParaView)")
      ->type_name("OUT")
      ->required();
  CLI::Option* spacing =
      app.add_option(
             "--spacing", options.spacing,
             "Edge of the lattice's cells, in the mesh's units; default: four cells across its thickest part")
          ->check(between(1e-6, 1e6))
          ->type_name("M");
  app.add_option("--cells", options.cells, "The same as cells along the longest extent")
      ->check(CLI::Range(2, 512))
      ->excludes(spacing)
      ->type_name("N");
  app.add_flag("--graded", options.graded, "Larger tetrahedra inside");
  app.add_flag("--json", line.json, "The report as JSON");
  app.callback([&line] {
    line.tetrahedralize.json = line.json;
    line.command = [&line](Report& report) { return tetrahedralize(line.tetrahedralize, report); };
  });
}

void add_study(CLI::App& app, CommandLine& line) {
  StudyOptions& options = line.study;
  app.add_option("spec", options.spec, "TOML file: scene, measures, knobs (tests/PROTOCOL.md)")
      ->type_name("SPEC")
      ->required();
  app.add_option("--out", options.out,
                 "Folder of the runs and the report; default out/studies/<name of SPEC>")
      ->type_name("DIR");
  app.add_flag("--untimed", options.untimed, "Every setting once, without seconds: errors against work");
  app.add_option("--point", options.point, "Carry out run N of the study only, and write no report")
      ->check(CLI::Range(1, 1'000'000))
      ->type_name("N");
  app.add_option("--jobs", options.jobs,
                 "Runs at the same time where they are not timed: the reference; with --untimed all")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app.add_option("--program", options.program, "Another build of duet, which simulates; default this one")
      ->check(CLI::ExistingFile)
      ->type_name("FILE");
  add_report(app, line);
  app.callback([&line] {
    line.study.json = line.json;
    line.command = [&line](Report& report) { return study(line.study, report); };
  });
}

void add_report_run(CLI::App& app, CommandLine& line) {
  app.add_option("run", line.report.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  app.callback([&line] { line.command = [&line](Report&) { return report_run(line.report); }; });
}

void add_verify(CLI::App& app, CommandLine& line) {
  app.add_option("run", line.verify.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  add_report(app, line);
  app.footer("Exit status: 0 all files are as written; 4 files are damaged, missing or unknown.");
  app.callback([&line] { line.command = [&line](Report& report) { return verify(line.verify, report); }; });
}

void add_export(CLI::App& app, CommandLine& line) {
  ExportOptions& options = line.export_run;
  app.add_option("run", options.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  app.add_option("--to", options.format, "The format, see below")->type_name("FORMAT")->required();
  app.add_option("--out", options.out,
                 "Folder or file to write to; default RUN/export/FORMAT, or RUN/export/<scene>.<ending> for "
                 "formats of one file")
      ->type_name("PATH");
  add_repeatable(app, "--bodies", options.bodies, "PATTERN",
                 "Only the bodies whose names match, * for any characters; repeatable");
  app.add_option("--frames", line.frames, "N: frame N. A:B: frames A to B. Default: all that are there")
      ->type_name("N|A:B");
  app.add_option("--up", options.up,
                 "Axis that points up: y as in the run, or z; the bodies are turned about x")
      ->check(CLI::IsMember({"y", "z"}))
      ->type_name("y|z");
  app.add_option("--scale", options.scale, "Units of the export in a meter: 100 for centimeters")
      ->check(between(1e-6, 1e6))
      ->type_name("S");
  app.add_flag("--compress", options.compress, "Smaller files: usd and vtk");
  app.add_option("--voxel", options.voxel,
                 "vdb: level sets of deformable bodies, too, with voxels of this width in m")
      ->check(between(1e-6, 1e6))
      ->type_name("WIDTH");
  app.add_option("--max-size", options.max_megabytes,
                 "glb and usd: refuse to write more megabytes; default 2000 for glb")
      ->check(between(1e-3, 1e9))
      ->type_name("MB");
  app.add_flag("--overwrite", options.overwrite, "Replace what is there");
  add_report(app, line);
  app.footer("FORMAT is one of\n" + export_formats() +
             "\nExit status: 0 done; 2 bad usage; 4 a file is missing, damaged or cannot be written; 130 "
             "interrupted.");
  app.callback([&line] {
    line.command = [&line](Report& report) {
      if (!line.frames.empty()) line.export_run.frames = parse_frames(line.frames);
      return export_run(line.export_run, report);
    };
  });
}

void add_view(CLI::App& app, CommandLine& line) {
  ViewOptions& options = line.view;
  app.add_option("run", options.run, "Folder of a run, or the name of one in out/")
      ->type_name("RUN")
      ->required();
  app.add_option("--out", options.out, "HTML file to write; default view.html in the folder of the run")
      ->type_name("PAGE.html");
  add_repeatable(app, "--bodies", options.bodies, "PATTERN",
                 "Only the bodies whose names match, * for any characters; repeatable");
  app.add_option("--frames", line.frames, "N: frame N. A:B: frames A to B. Default: all that are there")
      ->type_name("N|A:B");
  app.add_option("--max-size", options.max_megabytes,
                 "Largest page: where all frames would take more, every second, third ... one is taken, and "
                 "the last one")
      ->check(between(0.1, 400))
      ->type_name("MB")
      ->capture_default_str();
  app.add_flag("--overwrite", options.overwrite, "Replace the page that is there");
  add_report(app, line);
  app.footer(
      "The page needs a browser with WebGL 2 (all since 2021) and no network.\n"
      "Exit status: 0 done; 2 bad usage, or a file that is there; 4 a file is missing, damaged or cannot be "
      "written; 130 interrupted.");
  app.callback([&line] {
    line.command = [&line](Report& report) {
      if (!line.frames.empty()) line.view.frames = parse_frames(line.frames);
      return view(line.view, report);
    };
  });
}

void add_overlaps(CLI::App& app, CommandLine& line) {
  OverlapOptions& options = line.overlaps;
  add_scene(app, options.scene)->required();
  app.add_option("--out", options.out, "Folder of the run; default out/<scene>")->type_name("DIR");
  add_without(app, options.scene);
  app.add_option("--spacing", options.spacing, "How far apart the places are that are looked at, m")
      ->check(between(1e-6, 1e6))
      ->type_name("M")
      ->capture_default_str();
  app.add_flag("--json", options.json, "The same as JSON");
  app.callback([&line] {
    line.command = [&line](Report&) {
      resolve_run(line.overlaps.scene, line.overlaps.out);
      return overlaps(line.overlaps);
    };
  });
}

void add_bounds(CLI::App& app, render::DifferenceBounds& bounds) {
  app.add_option("--tolerance", bounds.tolerance,
                 "A pixel is different when a channel is off by more than N/255")
      ->check(CLI::Range(0, 255))
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--max-rmse", bounds.rmse, "Largest root mean square error, of 1")
      ->check(between(0, 1))
      ->type_name("X")
      ->capture_default_str();
  app.add_option("--max-share", bounds.share, "Largest share of different pixels, of 1")
      ->check(between(0, 1))
      ->type_name("X")
      ->capture_default_str();
  app.add_option("--max-patch", bounds.max_patch, "Largest connected patch of different pixels")
      ->check(CLI::NonNegativeNumber)
      ->type_name("N")
      ->capture_default_str();
  app.add_option("--min-ssim", bounds.min_ssim,
                 "Smallest structural similarity, 1 for equal pictures; default: any")
      ->check(between(-1, 1))
      ->type_name("X");
}

void add_compare(CLI::App& app, CommandLine& line) {
  CompareOptions& options = line.compare;
  app.add_option("a", options.a, "A picture (PNG, JPEG), a folder of pictures, or a run")
      ->type_name("A")
      ->required();
  app.add_option("b", options.b, "What it is compared with: of folders, the pictures of the same names")
      ->type_name("B")
      ->required();
  app.add_option("--frames", line.frames, "N: compare frame N of two folders. A:B: frames A to B")
      ->type_name("N|A:B");
  add_bounds(app, options.bounds);
  app.add_option("--difference", options.picture,
                 "Draw where and how much they differ into this PNG file; of folders, into a folder")
      ->type_name("OUT");
  add_report(app, line);
  app.footer(
      "Exit status: 0 the same within the bounds; 1 different; 2 bad usage, or pictures of different sizes; "
      "4 a file is missing or damaged.");
  app.callback([&line] {
    line.command = [&line](Report&) {
      if (!line.frames.empty()) line.compare.frames = parse_frames(line.frames);
      line.compare.quiet = line.quiet;
      line.compare.json = line.json;
      return compare(line.compare);
    };
  });
}

void add_hashes(CLI::App& app, CommandLine& line) {
  HashesOptions& options = line.hashes;
  CLI::Option* scenes =
      app.add_option("scenes", options.scenes,
                     "Entries of frames.toml in the folder of the expected hashes; default: all")
          ->type_name("SCENE");
  CLI::Option* write = app.add_flag("--write", options.write, "Renew the expected hashes");
  CLI::Option* full = app.add_flag("--full", options.full, "Also the later frame of each scene: minutes");
  CLI::Option* seconds =
      app.add_option(
             "--seconds", options.seconds,
             "End a scene with the frame in which it has taken so much processor time; for slow builds")
          ->check(between(1e-3, 1e9))
          ->excludes(write)
          ->type_name("S");
  CLI::Option* stages = app.add_option("--stages", options.stages,
                                       "Find the first stage in which two runs with --hash-stages differ")
                            ->expected(2)
                            ->type_name("RUN");
  for (CLI::Option* other : {scenes, write, full, seconds}) stages->excludes(other);
  app.add_option("--expected", options.folder, "Folder of the expected hashes; default tests/hashes")
      ->type_name("DIR");
  app.add_option("--threads", options.threads, "Threads of the simulation; default all cores")
      ->check(CLI::Range(1, 1024))
      ->type_name("N");
  app.add_flag("--json", line.json, "One JSON object a line");
  app.footer(
      "Exit status: 0 equal, or written; 1 different; 2 bad usage; 3 a simulation failed; 4 hashes are "
      "missing.");
  app.callback([&line] {
    line.hashes.json = line.json;
    line.bypass_cache = true;
    line.command = [&line](Report&) { return hashes(line.hashes); };
  });
}

}  // namespace

void add_commands(CLI::App& app, CommandLine& line) {
  add_new(*app.add_subcommand("new", "Write a commented scene to begin with"), line);
  add_preview(*app.add_subcommand("preview", "Draw one small picture of a scene, or a sheet of its frames"),
              line);
  add_simulate(
      *app.add_subcommand("run", "Simulate and draw a scene, and encode a video when ffmpeg is there"), line,
      Pictures::are_drawn);
  add_simulate(*app.add_subcommand("sim", "Simulate a scene"), line, Pictures::are_left_out);
  add_render(*app.add_subcommand("render", "Draw the frames of a run"), line);
  add_encode_and_farm(app, line);

  add_scene_commands(app, line);
  add_tetrahedralize(*app.add_subcommand("tetrahedralize", "Fill a closed surface with tetrahedra"), line);

  add_study(*app.add_subcommand("study", "What accuracy costs: a scene under many settings, with charts"),
            line);
  add_report_run(*app.add_subcommand("report", "One run as a page: pictures, energy, contact, work, effects"),
                 line);
  add_verify(*app.add_subcommand("verify", "Whether the files of a run are as it wrote them"), line);
  add_export(*app.add_subcommand("export", "A run for other programs: Blender, Houdini, ParaView, NumPy"),
             line);
  add_view(*app.add_subcommand("view", "A run as one page that plays it in a browser"), line);
  add_overlaps(*app.add_subcommand("overlaps", "How deep bodies lie in each other at the end of a run"),
               line);
  add_compare(*app.add_subcommand("compare", "How much pictures differ, and whether by more than bounds"),
              line);

  add_hashes(*app.add_subcommand("hashes",
                                 "Compare the state's hashes, frame by frame, with those that are committed"),
             line);

  add_cache_and_list(app, line);
  add_manual(app, line);
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; })) add_examples(*command);
}

}  // namespace duet::tools
