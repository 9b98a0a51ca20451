// The commands of `duet` and their options on the command line.
#pragma once

#include <functional>
#include <string>

#include "tools/commands.h"

namespace CLI {
class App;
}

namespace duet::tools {

// Everything that the command line gave, for all commands. Options of the commands that were not given keep
// their defaults.
struct CommandLine {
  SimulateOptions simulate;
  NewOptions new_scene;
  PreviewOptions preview;
  RenderOptions render;
  EncodeOptions encode;
  FarmOptions farm;
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
  ListOptions list;
  ManualOptions manual;
  bool bypass_cache = false;  // fill meshes with tetrahedra without the cache
  // Text of --frames; empty: not given.
  std::string frames;
  bool quiet = false, json = false;         // print only the outcome and errors; print JSON
  std::function<Outcome(Report&)> command;  // carries out the command that was given
};

// Adds all commands with their options to `app`. Parsing a command line then sets `line`, and `line.command`
// to the command that was given. `line` must outlive `app`.
void add_commands(CLI::App& app, CommandLine& line);

}  // namespace duet::tools
