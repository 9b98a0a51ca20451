#include "sim/geometry/level_set/feature_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/base/rotation.h"
#include "sim/geometry/level_set/shape_samples.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

using std::numbers::pi;
// Least number of nodes of a circle.
constexpr int min_circle_edges = 24;
// Distance by which the surface falls off one spacing beside a convex vertex, as a fraction of the spacing.
// On a radius of curvature of ten spacings it falls off by this fraction. A larger value finds only sharper
// vertices.
constexpr double min_bend = 0.05;

// Returns the number of pieces no longer than `spacing` that divide a length. A length that is a whole number
// of them but for rounding gets that number.
int pieces_of(double length, double spacing) {
  return std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
}

// Appends `line`, whose nodes are those from line.begin on. Sets its `end` and `longest`.
void end_line(FeatureEdges::Line line, FeatureEdges& feature_edges) {
  line.end = static_cast<int>(feature_edges.nodes.size());
  const double around = line.around;
  for (int i = line.begin; i < line.end; ++i) {
    if (i + 1 == line.end && !line.is_closed) break;
    const int next = i + 1 < line.end ? i + 1 : line.begin;
    const double chord = (feature_edges.nodes[as_index(next)] - feature_edges.nodes[as_index(i)]).norm();
    const double way =
        around > 0
            ? 2 * around * math::atan2(chord, std::sqrt(std::max(0.0, 4 * around * around - chord * chord)))
            : chord;
    line.longest = std::max(line.longest, way);
  }
  feature_edges.lines.push_back(line);
}

// Appends nodes on the segment from `a` to `b`, with `a` and without `b`.
void add_nodes(const Vec3& a, const Vec3& b, double spacing, FeatureEdges& feature_edges) {
  const int n = pieces_of((b - a).norm(), spacing);
  for (int i = 0; i < n; ++i) feature_edges.nodes.push_back(a + (b - a) * i / n);
}

// Appends a straight line from `a` to `b`.
void add_line(const Vec3& a, const Vec3& b, double radius, double spacing, FeatureEdges& feature_edges) {
  const int begin = static_cast<int>(feature_edges.nodes.size());
  add_nodes(a, b, spacing, feature_edges);
  feature_edges.nodes.push_back(b);
  end_line({.begin = begin, .radius = radius}, feature_edges);
}

// Appends a circle of radius `around` about the axis y at height `y`.
void add_circle(double around, double y, double radius, double spacing, FeatureEdges& feature_edges) {
  const int n = std::max(min_circle_edges, pieces_of(2 * pi * around, spacing));
  const int begin = static_cast<int>(feature_edges.nodes.size());
  for (int i = 0; i < n; ++i)
    feature_edges.nodes.emplace_back(around * math::sin(2 * pi * i / n), y,
                                     around * math::cos(2 * pi * i / n));
  end_line({.begin = begin, .is_closed = true, .radius = radius, .around = around}, feature_edges);
}

void add_box_edges(const Vec3& half, double spacing, FeatureEdges& feature_edges) {
  for (int axis = 0; axis < 3; ++axis)
    for (int edge = 0; edge < 4; ++edge) {
      Vec3 end;
      end[axis] = half[axis];
      end[(axis + 1) % 3] = (edge & 1 ? 1 : -1) * half[(axis + 1) % 3];
      end[(axis + 2) % 3] = (edge & 2 ? 1 : -1) * half[(axis + 2) % 3];
      Vec3 begin = end;
      begin[axis] = -half[axis];
      add_line(begin, end, 0, spacing, feature_edges);
    }
}

// Sets the inward directions of all nodes of sharp edges.
void find_inward(const LevelSet& shape, FeatureEdges& feature_edges) {
  const std::vector<Vec3> inside = points_inside(shape, feature_edges.nodes);
  feature_edges.inward.assign(feature_edges.nodes.size(), Vec3::Zero());
  for (const FeatureEdges::Line& line : feature_edges.lines)
    for (auto i = as_index(line.begin); line.radius == 0 && i < as_index(line.end); ++i)
      feature_edges.inward[i] = (inside[i] - feature_edges.nodes[i]).normalized();
}

// Finds the places where three or more edges end. Ends of edges that meet are at exactly the same place.
void find_corners(FeatureEdges& feature_edges) {
  std::map<std::array<double, 3>, std::vector<int>> ends;
  for (const FeatureEdges::Line& line : feature_edges.lines) {
    if (line.is_closed || line.radius > 0) continue;
    for (const int i : {line.begin, line.end - 1}) {
      const Vec3& x = feature_edges.nodes[as_index(i)];
      ends[{x.x(), x.y(), x.z()}].push_back(i);
    }
  }
  for (const auto& [place, nodes] : ends)
    if (nodes.size() >= 3) feature_edges.corners.push_back(nodes.front());
}

// Builds the tree over the corners and convex vertices.
void build_tree(FeatureEdges& feature_edges) {
  std::vector<Eigen::AlignedBox3d> boxes;
  std::vector<int> items;
  for (std::size_t i = 0; i < feature_edges.corner_count(); ++i) {
    items.push_back(static_cast<int>(i));
    boxes.emplace_back(feature_edges.corner(items.back()));
  }
  const auto tree = std::make_shared<BoxTree>();
  tree->build(boxes, items);
  feature_edges.corner_tree = tree;
}

// Returns whether the surface falls off on both sides of `x` in some direction along it.
bool bends_outward(const LevelSet& shape, const Vec3& x, const Vec3& inward, double spacing) {
  constexpr int directions = 8;  // over half a turn
  const Mat3 axes = shortest_rotation(Vec3::UnitZ(), inward).toRotationMatrix();
  for (int k = 0; k < directions; ++k) {
    const double angle = pi * k / directions;
    const Vec3 way = spacing * (math::cos(angle) * axes.col(0) + math::sin(angle) * axes.col(1));
    if (std::min(shape.distance(x + way), shape.distance(x - way)) > min_bend * spacing) return true;
  }
  return false;
}

// Adds the samples at which the mesh bends outward as convex vertices.
void add_convex_vertices(const LevelSet& shape, const std::vector<Vec3>& samples,
                         const std::vector<Vec3>& inside, double spacing, FeatureEdges& feature_edges) {
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Vec3 inward = (inside[i] - samples[i]).normalized();
    if (!bends_outward(shape, samples[i], inward, spacing)) continue;
    feature_edges.convex_vertices.push_back(static_cast<int>(feature_edges.nodes.size()));
    feature_edges.nodes.push_back(samples[i]);
    feature_edges.inward.push_back(inward);
  }
}

// An edge of a mesh at which its faces turn outward.
struct SharpEdge {
  int begin = 0, end = 0;  // vertices of the mesh
};

// Returns the edges of a mesh at which its faces turn outward by 30 degrees or more.
std::vector<SharpEdge> sharp_edges(const TriangleMesh& mesh) {
  struct Sides {
    int count = 0;
    std::array<Vec3, 2> normal;
    Vec3 beyond = Vec3::Zero();  // corner of the first face that is not on the edge
  };
  std::map<std::pair<int, int>, Sides> edges;
  std::vector<SharpEdge> found;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = area_vector(mesh, t).normalized();
    const Triangle& corner = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const auto name = std::minmax(corner[k], corner[(k + 1) % 3]);
      Sides& sides = edges[name];
      const Vec3& opposite = mesh.positions[as_index(corner[(k + 2) % 3])];
      if (sides.count < 2) sides.normal[as_index(sides.count)] = normal;
      if (++sides.count == 1) {
        sides.beyond = opposite;
        continue;
      }
      // The edge turns outward if the second face lies behind the plane of the first one.
      const bool outward = sides.normal[0].dot(opposite - mesh.positions[as_index(name.first)]) < 0;
      if (outward && sides.normal[0].dot(normal) < sharp_edge) found.push_back({name.first, name.second});
    }
  }
  return found;
}

// Joins edges to lines of vertices, as along a rim: an edge continues another one if no third one ends at
// their common vertex. A closed line repeats its first vertex at its end.
std::vector<std::vector<int>> lines_of(const std::vector<SharpEdge>& edges) {
  std::map<int, std::vector<std::size_t>> at;
  for (std::size_t e = 0; e < edges.size(); ++e) {
    at[edges[e].begin].push_back(e);
    at[edges[e].end].push_back(e);
  }
  std::vector<char> used(edges.size(), 0);
  std::vector<std::vector<int>> lines;
  const auto follow = [&](std::size_t e, int from) {
    std::vector<int> line{from};
    while (true) {
      used[e] = 1;
      const int to = edges[e].begin == line.back() ? edges[e].end : edges[e].begin;
      line.push_back(to);
      const std::vector<std::size_t>& here = at[to];
      if (here.size() != 2) break;
      e = here[0] == e ? here[1] : here[0];
      if (used[e]) break;
    }
    lines.push_back(line);
  };
  // Open lines are followed from their ends first; loops remain.
  for (const auto& [vertex, here] : at)
    if (here.size() != 2)
      for (const std::size_t e : here)
        if (!used[e]) follow(e, vertex);
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (!used[e]) follow(e, edges[e].begin);
  return lines;
}

}  // namespace

FeatureEdges find_feature_edges(const LevelSet& shape, double spacing) {
  DUET_ASSERT(spacing > 0);
  FeatureEdges feature_edges;
  switch (shape.kind) {
    case LevelSet::Kind::box:
      add_box_edges(shape.half, spacing, feature_edges);
      break;
    case LevelSet::Kind::cylinder:
      for (const double y : {-shape.half_length, shape.half_length})
        add_circle(shape.radius, y, 0, spacing, feature_edges);
      [[fallthrough]];
    case LevelSet::Kind::capsule:
      add_line(Vec3(0, -shape.half_length, 0), Vec3(0, shape.half_length, 0), shape.radius, spacing,
               feature_edges);
      break;
    case LevelSet::Kind::torus:
      add_circle(shape.radius, 0, shape.tube, spacing, feature_edges);
      break;
    case LevelSet::Kind::sphere:
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  find_inward(shape, feature_edges);
  find_corners(feature_edges);
  build_tree(feature_edges);
  return feature_edges;
}

FeatureEdges find_feature_edges(const TriangleMesh& mesh, const LevelSet& shape,
                                const std::vector<Vec3>& samples, const std::vector<Vec3>& inside,
                                double spacing) {
  DUET_ASSERT(spacing > 0);
  DUET_ASSERT(samples.size() == inside.size());
  FeatureEdges feature_edges;
  for (const std::vector<int>& line : lines_of(sharp_edges(mesh))) {
    const int begin = static_cast<int>(feature_edges.nodes.size());
    const auto vertex = [&](std::size_t i) { return mesh.positions[as_index(line[i])]; };
    for (std::size_t i = 0; i + 1 < line.size(); ++i)
      add_nodes(vertex(i), vertex(i + 1), spacing, feature_edges);
    const bool is_closed = line.front() == line.back();
    if (!is_closed) feature_edges.nodes.push_back(vertex(line.size() - 1));
    end_line({.begin = begin, .is_closed = is_closed}, feature_edges);
  }
  find_inward(shape, feature_edges);
  add_convex_vertices(shape, samples, inside, spacing, feature_edges);
  find_corners(feature_edges);
  build_tree(feature_edges);
  return feature_edges;
}

void keep_nodes(const std::vector<char>& stays, FeatureEdges& feature_edges) {
  DUET_ASSERT(stays.size() == feature_edges.nodes.size());
  if (std::find(stays.begin(), stays.end(), 0) == stays.end()) return;
  FeatureEdges kept;
  // The new numbers of the nodes that are kept; -1 for others.
  std::vector<int> number(stays.size(), -1);
  for (const FeatureEdges::Line& line : feature_edges.lines) {
    const int count = line.end - line.begin;
    const auto node = [&](int i) { return as_index(line.begin + i % count); };
    // A closed line is opened at a node that goes.
    int first = 0;
    while (line.is_closed && first < count && stays[node(first)] != 0) ++first;
    const bool is_closed = line.is_closed && first == count;
    int begin = static_cast<int>(kept.nodes.size());
    const auto end = [&] {
      if (static_cast<int>(kept.nodes.size()) > begin + 1)
        end_line({.begin = begin, .is_closed = is_closed, .radius = line.radius, .around = line.around},
                 kept);
      begin = static_cast<int>(kept.nodes.size());
    };
    for (int i = first; i < first + count; ++i) {
      if (stays[node(i)] == 0) {
        end();
        continue;
      }
      number[node(i)] = static_cast<int>(kept.nodes.size());
      kept.nodes.push_back(feature_edges.nodes[node(i)]);
      kept.inward.push_back(feature_edges.inward[node(i)]);
    }
    end();
  }
  for (const int corner : feature_edges.corners)
    if (stays[as_index(corner)] != 0) kept.corners.push_back(number[as_index(corner)]);
  for (const int vertex : feature_edges.convex_vertices) {
    if (stays[as_index(vertex)] == 0) continue;
    kept.convex_vertices.push_back(static_cast<int>(kept.nodes.size()));
    kept.nodes.push_back(feature_edges.nodes[as_index(vertex)]);
    kept.inward.push_back(feature_edges.inward[as_index(vertex)]);
  }
  build_tree(kept);
  feature_edges = std::move(kept);
}

Vec3 place_between(const FeatureEdges::Line& line, const Vec3& first, const Vec3& second, double t) {
  Vec3 place = first + t * (second - first);
  if (line.around > 0) {
    const double scale = line.around / math::hypot(place.x(), place.z());
    place.x() *= scale;
    place.z() *= scale;
  }
  return place;
}

}  // namespace duet
