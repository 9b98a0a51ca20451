// Reads scene files strictly: TOML in, validated Scene out, all problems in one go.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace duet::scene {

/// Paths of the mesh files of a scene, by their names in the scene.
using FileMap = std::map<std::string, std::string>;

/// A scene that was read, and what was read for it.
struct ReadResult {
  Scene scene;          ///< The validated scene.
  std::string written;  ///< Bytes of the file.
  FileMap files;        ///< Mesh files that were read.
  /// The scene exactly as run: the bytes of the file, or the document with the overrides applied.
  std::string source;
  std::vector<std::string> notes;  ///< Repairs of meshes: "rigid.bowl.shape.mesh: 2 triangles ...".
  std::uint64_t meshes = 0;        ///< Hash of all meshes that were read; 0: none.
};

/// Tells a reader to read mesh files or to leave them. Pictures are drawn from the frames of a run, so that
/// drawing needs no mesh files, which may no longer exist.
enum class Meshes {
  read,  ///< Mesh files are read and checked.
  leave  ///< They are not; meshes in the scene are null.
};

/// Reads and validates the scene file `path`, after applying the overrides "key=value" (`solver.cfl=0.5`,
/// `rigid.ball.velocity=[0,0,-9]`; elements of arrays of tables are addressed by their name). Mesh files that
/// `files` does not name are searched relative to the scene's folder. Throws SceneError with every problem
/// found, and FileError if the scene file cannot be read.
ReadResult read(const std::string& path, const std::vector<std::string>& overrides = {},
                Meshes meshes = Meshes::read, const FileMap& files = {});

/// Reads and validates the document `text`, as read() does with that of a file. `path` is used in messages
/// and to find meshes.
ReadResult read_text(const std::string& text, const std::string& path,
                     const std::vector<std::string>& overrides = {}, Meshes meshes = Meshes::read,
                     const FileMap& files = {});

/// Returns the text that `duet check --reference` prints: every key with its type, unit, default, bounds and
/// meaning. It is made from the table that the reader validates with.
std::string reference();

}  // namespace duet::scene
