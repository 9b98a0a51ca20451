/// What a run was made of, so that it can be made again anywhere: the scene as written, what the command line
/// changed in it, and copies of the mesh files that it names.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/scene/reader/reader.h"

namespace duet::io {

/// Files below source/ of a run directory, listed in source/source.json.
struct RunSource {
  std::string scene;                 ///< file name of the scene: "stack.toml"
  std::vector<std::string> set;      ///< "key=value" of --set, in their order, --accuracy first
  std::vector<std::string> without;  ///< effects that were left out
  scene::FileMap files;              ///< by the name as the scene has it: the path of the copy
};

/// The files of a source, in memory: by the path from source/ on, the bytes.
using SourceFiles = std::map<std::string, std::string>;

/// Reads what a scene was made of. Mesh files are named by their content, mesh/0123456789abcdef/cow.obj, with
/// the buffers that a .gltf file names beside them. `source.files` is set to paths from source/ on. Throws
/// FileError.
SourceFiles collect_source(const scene::ReadResult& read, RunSource& source);

/// Writes source/ of the run, and removes what it held before and holds no longer. Throws FileError.
void write_source(const RunDirectory& run, const RunSource& source, const SourceFiles& files);

/// The source of a run, with `files` as paths that can be opened; none where the run has none (programs
/// before December 2026). Throws FileError where it is damaged.
std::optional<RunSource> read_source(const RunDirectory& run);

/// The path of the scene as written.
fs::path source_scene(const RunDirectory& run, const RunSource& source);

}  // namespace duet::io
