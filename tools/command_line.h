// The commands of `duet` and their options.
#pragma once

#include <functional>
#include <string>

#include "tools/commands.h"

namespace CLI {
class App;
}

namespace duet::tools {

// What is given on the command line, of whichever command.
struct CommandLine {
  SimulateOptions simulate;
  NewOptions new_scene;
  PreviewOptions preview;
  RenderOptions render;
  CheckOptions check;
  ExplainOptions explain;
  TetrahedralizeOptions tetrahedralize;
  StudyOptions study;
  ReportOptions report;
  VerifyOptions verify;
  ExportOptions export_run;
  ViewOptions view;
  OverlapOptions overlaps;
  CompareOptions compare;
  HashesOptions hashes;
  CacheOptions cache;
  bool fills_anew = false;  // meshes with tetrahedra, though the cache has them
  std::string frames;
  bool quiet = false, json = false;
  std::function<Outcome(Report&)> command;
};

/// Adds all commands with their options to the program. Reading a command line sets `line`, also its
/// `command`, which carries out the one that is given; `line` has to outlive `app`.
void add_commands(CLI::App& app, CommandLine& line);

}  // namespace duet::tools
