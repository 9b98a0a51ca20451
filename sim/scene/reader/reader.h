// The strict scene reader: TOML in, validated Scene out, all problems in one go.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace duet::scene {

/// Where the mesh files are that a scene names: by the name as written, the path to open.
using FileMap = std::map<std::string, std::string>;

struct ReadResult {
  Scene scene;
  std::string written;  ///< the file's own bytes
  FileMap files;        ///< the mesh files that were read
  // The scene exactly as run: the file's own bytes, or the document with the overrides applied.
  std::string source;
  std::vector<std::string> notes;  // what was repaired: "rigid.bowl.shape.mesh: 2 triangles ..."
  std::uint64_t meshes = 0;        // fingerprint of all meshes that were read
};

// Pictures are drawn from the frames of a run: who only draws needs no mesh files, which may be gone by then.
enum class Meshes { read, leave };

// Reads and validates `path`, after applying the overrides "key=value" (`solver.cfl=0.5`,
// `rigid.ball.velocity=[0,0,-9]`; elements of arrays of tables are addressed by their name). Throws
// SceneError with every problem found, FileError if the file cannot be read.
/// Mesh files that `files` does not name are looked for from the scene's folder on.
ReadResult read(const std::string& path, const std::vector<std::string>& overrides = {},
                Meshes meshes = Meshes::read, const FileMap& files = {});

// The same for a document in memory; `path` is used in messages and to find meshes.
ReadResult read_text(const std::string& text, const std::string& path,
                     const std::vector<std::string>& overrides = {}, Meshes meshes = Meshes::read,
                     const FileMap& files = {});

// Every key with its type, unit, default, bounds and meaning: what `duet check --reference` prints. Made from
// the same table that the reader validates with.
std::string reference();

}  // namespace duet::scene
