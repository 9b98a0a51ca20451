/// The user's own mesh files, so that a cache plays on the user's own model: vertex i of the cache is vertex
/// i of the file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// The OBJ file that a body was made of, as it lies in the run's source/.
struct OwnMesh {
  fs::path file;
  /// For each vertex (`v`) of the file, in its order, the index of the position of the body's surface that it
  /// became. Reading a mesh merges vertices at the same place and leaves out those that no face uses; these
  /// follow the nearest position.
  std::vector<int> positions;
};

/// For each exported body its OBJ file, if it was made of one, or has one as its skin. A body has none where
/// it is drawn by another surface, where the run has no copy of the file, or where its places at frame 0, by
/// which the vertices are found again, are not there or are others. Throws FileError where the run is
/// damaged.
std::vector<std::optional<OwnMesh>> own_meshes(const ExportedRun& run);

/// Says which bodies made of OBJ files come in Duet's order of vertices instead; nothing where none does.
std::vector<std::string> notes_on_own_meshes(const ExportedRun& run,
                                             const std::vector<std::optional<OwnMesh>>& meshes);

/// The text of an OBJ file with a line for each statement: lines that end in a backslash go on in the next
/// one, and any kind of line end becomes '\n'.
std::string obj_statements(const std::string& text);

/// The coordinates of the vertices of an OBJ file, in its order; an incomplete line ends them.
std::vector<Vec3> obj_vertices(const std::string& text);

/// For each of `points` the index of the nearest of `positions`, which is no farther than `tolerance` for at
/// least half of them; none otherwise.
std::optional<std::vector<int>> match_points(const std::vector<Vec3>& points,
                                             const std::vector<Vec3>& positions, double tolerance);

}  // namespace duet::io
