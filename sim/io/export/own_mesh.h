// The OBJ files that bodies were made of, so that an export plays on the user's own model: vertex i of a
// cache is vertex i of the file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// The OBJ file that a body was made of.
struct OwnMesh {
  fs::path file;  ///< path of the copy in the run's source/
  /// For each vertex (statement `v`) of the file, in its order, the index of its position in the body's
  /// surface. Reading a mesh merges vertices at the same place, and drops those that no face uses: these
  /// have the index of the nearest position.
  std::vector<int> positions;
};

/// Finds for each exported body the OBJ file that it was made of, or that is its skin. Vertices are matched
/// by their places at frame 0. A body has none if it was made of no OBJ file or is drawn by another
/// surface, if the run has no copy of the file, if the body is rigid and frame 0 is missing, or if its
/// places do not match. Throws FileError if the run is damaged.
std::vector<std::optional<OwnMesh>> own_meshes(const ExportedRun& run);

/// Returns a sentence about the bodies made of OBJ files for which own_meshes() found none, and which
/// therefore come in Duet's order of vertices; empty if there are none. `meshes` is the result of
/// own_meshes().
std::vector<std::string> notes_on_own_meshes(const ExportedRun& run,
                                             const std::vector<std::optional<OwnMesh>>& meshes);

/// Returns the text of an OBJ file with one line for each statement. A line that ends in a backslash is
/// joined with the next one, and line ends of any system become line feeds.
std::string obj_statements(const std::string& text);

/// Returns the coordinates of the vertices in a text that obj_statements() returned, in the unit of the
/// file and in its order. An incomplete line of a vertex ends them.
std::vector<Vec3> obj_vertices(const std::string& text);

/// Returns for each of `points` the index of the nearest of `positions`. Returns none if there are no
/// positions, or if fewer than half of the points have a position within `tolerance`. All arguments have
/// one unit of length.
std::optional<std::vector<int>> match_points(const std::vector<Vec3>& points,
                                             const std::vector<Vec3>& positions, double tolerance);

}  // namespace duet::io
