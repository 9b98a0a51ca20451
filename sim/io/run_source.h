// The source of a run, by which it can be repeated anywhere: the scene as written, what the command line
// changed in it, and copies of the mesh files that it names.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sim/io/run_directory.h"
#include "sim/scene/reader/reader.h"

namespace duet::io {

/// Source of a run: files below source/ of its folder, as source/source.json lists them.
struct RunSource {
  std::string scene;             ///< file name of the scene: "stack.toml"
  std::vector<std::string> set;  ///< overrides "key=value" of --set in their order, those of --accuracy first
  std::vector<std::string> without;  ///< names of effects that --without left out
  scene::FileMap files;  ///< paths of the copies of mesh files, by the names that the scene gives them
};

/// Files of a source in memory: their bytes, by the path relative to source/.
using SourceFiles = std::map<std::string, std::string>;

/// Reads the files that a scene was made of, and sets `source.scene` and `source.files`; the latter has
/// paths relative to source/. Copies of mesh files lie in folders named by their content,
/// mesh/0123456789abcdef/cow.obj. Buffers that a .gltf file names lie beside its copy. Throws FileError.
SourceFiles collect_source(const scene::ReadResult& read, RunSource& source);

/// Writes the folder source/ of the run, and removes files in it that belong to an earlier source only.
/// Throws FileError.
void write_source(const RunDirectory& run, const RunSource& source, const SourceFiles& files);

/// Reads the source of a run, with `files` as paths that can be opened. Returns none if the run has no
/// source (programs before December 2026 wrote none). Throws FileError if source.json is damaged or names
/// files outside its folder.
std::optional<RunSource> read_source(const RunDirectory& run);

/// Returns the path of the run's copy of the scene as written.
fs::path source_scene(const RunDirectory& run, const RunSource& source);

}  // namespace duet::io
