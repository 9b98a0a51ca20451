// The round parts of a mesh, and the search for the vertex of them that is lowest above another body.
//
// A few samples stand for a round part that has many vertices. Between the samples it would sink in, and what
// rolls would roll as a polygon with few corners. So each sample on a round part stands for a patch of
// vertices, and touches with that one of them which is lowest. As the body rolls, the contact goes from
// vertex to vertex, as the support point of a wheel does.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "sim/geometry/level_set/level_set.h"
#include "sim/geometry/level_set/shape_samples.h"
#include "sim/geometry/mesh/triangle_mesh.h"

namespace duet {

/// What a sample is on the round parts of its mesh.
struct RoundSample {
  int patch = -1;  ///< The vertex at which its patch begins; -1: the sample is no vertex of a round part.
  /// The vertices between which it lies, if all of them are on round parts: itself, the ends of its edge, or
  /// the corners of its face. -1 after the last.
  std::array<int, 3> corner{-1, -1, -1};
  /// Returns whether round parts have all of its corners.
  bool is_between_vertices() const { return corner[0] >= 0; }
};

/// The vertices of a mesh around which it is round, and the patches into which they are divided. These are
/// vertices without a sharp edge, and those on rims, where one sharp edge goes on as another one with a blunt
/// turn. Vertices on rims neighbor others of their rim only, so that a drum touches with both of its rims.
struct RoundSurface {
  std::vector<Vec3> vertices;  ///< m, shape space.
  std::vector<Vec3> inside;    ///< m: per vertex, a point deeper inside the body, see points_inside().
  std::vector<int> first;      ///< The neighbors of vertex v are those from first[v] up to first[v + 1].
  std::vector<int> neighbors;  ///< Vertices at the other ends of the edges, and the corners of flat facets.
  std::vector<int> patch;      ///< Per vertex, the vertex at which its patch begins, which is a sample.
  std::vector<double> reach;   ///< m: per vertex at which a patch begins, the radius of the patch about it.
  std::vector<RoundSample> at_sample;  ///< Per sample, what it is on the round parts.
};

/// Returns the round parts of a closed mesh with the given samples (m). Their edges turn by less than
/// `sharp_edge`. A part without a sample, and vertices in flat faces, are left out. RoundSurface::inside
/// stays empty.
RoundSurface find_round_surface(const TriangleMesh& mesh, const std::vector<MeshSample>& samples);

/// A vertex above a host.
struct RoundPlace {
  int vertex = -1;      ///< Index of RoundSurface::vertices.
  Vec3 position;        ///< m, shape space of the host.
  double distance = 0;  ///< m, from the host.
};

/// Returns the lowest vertex above a host on the way down from the vertex `start`, to the steepest neighbor
/// of each vertex, with the surface at `pose` in the host's shape space. Neighbors that are lower by less
/// than a ten-thousandth of their distance count as level, and end the way.
RoundPlace lowest_vertex(const RoundSurface& surface, int start, const Pose& pose, const LevelSet& host);

/// Returns the lowest vertex as lowest_vertex() does, for a way that begins at the vertex `start` of a patch,
/// or nothing if the way leaves that patch.
std::optional<RoundPlace> lowest_in_patch(const RoundSurface& surface, int start, const Pose& pose,
                                          const LevelSet& host);

/// Greatest slope of what is level with a vertex. With larger values a body that rolls touches ahead of
/// itself.
inline constexpr double level_slope = 1e-3;

/// Calls visit(place) for the vertices around `lowest` that are almost level with it, without that vertex
/// itself: those that such vertices connect to it as neighbors, and that are higher by no more than
/// `level_slope` times their distance from it. At most 63 are visited. They are the other corners of a facet
/// that lies flat.
template <class Visit>
void visit_level_vertices(const RoundSurface& surface, const RoundPlace& lowest, const Pose& pose,
                          const LevelSet& host, Visit&& visit) {
  constexpr std::size_t most = 64;
  std::array<int, most> found{lowest.vertex};
  std::size_t count = 1;
  for (std::size_t next = 0; next < count; ++next) {
    const auto v = static_cast<std::size_t>(found[next]);
    for (int i = surface.first[v]; i < surface.first[v + 1] && count < most; ++i) {
      const int other = surface.neighbors[static_cast<std::size_t>(i)];
      if (std::find(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(count), other) !=
          found.begin() + static_cast<std::ptrdiff_t>(count))
        continue;
      RoundPlace place{other, pose.to_world(surface.vertices[static_cast<std::size_t>(other)])};
      place.distance = host.distance(place.position);
      if (place.distance - lowest.distance > level_slope * (place.position - lowest.position).norm())
        continue;
      found[count++] = other;
      visit(place);
    }
  }
}

}  // namespace duet
