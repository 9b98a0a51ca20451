#include "sim/geometry/level_set/shape_samples.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"
#include "sim/geometry/mesh/sharp_edge.h"

namespace duet {
namespace {

using std::numbers::pi;
// Samples on edges of thin boxes are at most this many times denser than elsewhere. A larger value lets
// thinner plates cross edge to edge without a gap between samples, but adds samples.
constexpr double max_on_edge = 8;
// Least number of samples on the widest ring of a round body, so that it rolls smoothly.
constexpr int min_ring_samples = 24;

// Returns the number of intervals no longer than `spacing` that divide a length. A length that is a whole
// number of them but for rounding gets that number.
int intervals(double length, double spacing) {
  return std::max(1, static_cast<int>(std::ceil(length / spacing - 1e-9)));
}

// Adds points on the edges of a thin box between those of the lattice of `n` intervals along each axis. The
// edges of two such boxes cross over the length of a thickness, so samples no farther apart than the
// thickness do not miss each other.
void add_edge_samples(const Vec3& half, const Vec3i& n, double spacing, std::vector<Vec3>& samples) {
  const double apart = std::max(2 * half.minCoeff(), spacing / max_on_edge);
  for (int axis = 0; axis < 3; ++axis) {
    const int parts = intervals(2 * half[axis] / n[axis], apart), count = n[axis] * parts;
    for (int i = 1; i < count; ++i) {
      if (i % parts == 0) continue;
      for (int edge = 0; edge < 4; ++edge) {
        Vec3 place;
        place[axis] = 2.0 * i / count - 1;
        place[(axis + 1) % 3] = edge & 1 ? 1 : -1;
        place[(axis + 2) % 3] = edge & 2 ? 1 : -1;
        samples.push_back(half.cwiseProduct(place));
      }
    }
  }
}

// Returns the points on the surface of a lattice over the box, and denser ones on the edges of a thin box.
std::vector<Vec3> box_samples(const Vec3& half, double spacing) {
  std::vector<Vec3> samples;
  Vec3i n;
  for (int axis = 0; axis < 3; ++axis) n[axis] = intervals(2 * half[axis], spacing);
  for (int i = 0; i <= n.x(); ++i)
    for (int j = 0; j <= n.y(); ++j)
      for (int k = 0; k <= n.z(); ++k) {
        const bool is_outer = i == 0 || j == 0 || k == 0 || i == n.x() || j == n.y() || k == n.z();
        if (is_outer)
          samples.emplace_back(
              half.cwiseProduct(Vec3(2.0 * i / n.x() - 1, 2.0 * j / n.y() - 1, 2.0 * k / n.z() - 1)));
      }
  add_edge_samples(half, n, spacing, samples);
  return samples;
}

// Collects rings of samples about the axis y, all as dense as the spacing asks for.
class Rings {
 public:
  explicit Rings(double spacing) : spacing_(spacing) {}

  // Adds a ring at height `y`, or a single point if the radius is rounding.
  void add(double radius, double y) {
    if (radius < 1e-9 * spacing_) {
      samples_.emplace_back(0, y, 0);
      return;
    }
    const int n = std::max(3, intervals(2 * pi * radius, spacing_));
    for (int i = 0; i < n; ++i)
      samples_.emplace_back(radius * math::sin(2 * pi * i / n), y, radius * math::cos(2 * pi * i / n));
  }
  std::vector<Vec3> take() { return std::move(samples_); }

 private:
  double spacing_;
  std::vector<Vec3> samples_;
};

std::vector<Vec3> cylinder_samples(double radius, double half_length, double spacing) {
  Rings rings(spacing);
  const int rows = intervals(radius, spacing);
  for (const double end : {-half_length, half_length})
    for (int row = 0; row <= rows; ++row) rings.add(radius * row / rows, end);
  return rings.take();
}

std::vector<Vec3> torus_samples(double radius, double tube, double spacing) {
  Rings rings(spacing);
  // A multiple of 4 includes the rings on which the torus lies.
  const int n = std::max(8, 4 * intervals(pi / 2 * tube, spacing));
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * pi * i / n;
    rings.add(radius + tube * math::cos(angle), tube * math::sin(angle));
  }
  return rings.take();
}

// Returns `spacing`, or less if the widest ring of a round body would get fewer than `min_ring_samples`
// samples.
double round_spacing(double widest_radius, double spacing) {
  return std::min(spacing, 2 * pi * widest_radius / min_ring_samples);
}

// A possible sample of a mesh.
struct Candidate {
  Vec3 position;
  Vec3 normal;  // unit; zero if the normals of the faces cancel
  // 1 - cosine of the largest angle between the normals of the faces that meet there.
  double sharpness = 0;
  std::array<int, 3> corner{-1, -1, -1};  // MeshSample::corner
};

// Keeps the first of every group of candidates that are closer together than `distance` and face the same
// way. The two sides of a thin plate face different ways and keep their own samples.
std::vector<MeshSample> thinned(const std::vector<Candidate>& candidates, double distance) {
  // Cosine of 45 degrees.
  constexpr double same_way = 0.7;
  using Bin = std::array<std::int64_t, 3>;
  std::map<Bin, std::vector<const Candidate*>> cells;
  const auto cell_of = [&](const Vec3& x) {
    Bin cell;
    for (int i = 0; i < 3; ++i)
      cell[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(std::floor(x[i] / distance));
    return cell;
  };
  const auto is_covered = [&](const Candidate& candidate) {
    const Bin middle = cell_of(candidate.position);
    for (std::int64_t n = 0; n < 27; ++n) {
      const auto cell = cells.find({middle[0] + n % 3 - 1, middle[1] + n / 3 % 3 - 1, middle[2] + n / 9 - 1});
      if (cell == cells.end()) continue;
      for (const Candidate* kept : cell->second)
        if ((kept->position - candidate.position).norm() < distance &&
            kept->normal.dot(candidate.normal) > same_way)
          return true;
    }
    return false;
  };
  std::vector<MeshSample> kept;
  for (const Candidate& candidate : candidates) {
    if (is_covered(candidate)) continue;
    cells[cell_of(candidate.position)].push_back(&candidate);
    kept.push_back({candidate.position, candidate.corner});
  }
  return kept;
}

void sort_by_sharpness(std::vector<Candidate>& candidates) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.sharpness > b.sharpness; });
}

// Returns a candidate at a place where faces with these normals meet. `corner` is MeshSample::corner.
Candidate candidate(const Vec3& position, const std::vector<Vec3>& face_normals,
                    const std::array<int, 3>& corner) {
  Candidate result{position, Vec3::Zero(), 0, corner};
  for (const Vec3& normal : face_normals) {
    result.normal += normal;
    for (const Vec3& other : face_normals)
      result.sharpness = std::max(result.sharpness, 1 - normal.dot(other));
  }
  // Opposite normals, as those at the rim of a sheet, add up to rounding, which has no direction.
  if (const double length = result.normal.norm(); length > 1e-6) result.normal /= length;
  return result;
}

// Adds the points inside a triangle on the barycentric lattice that divides its longest edge by `spacing`.
void add_face_points(const TriangleMesh& mesh, std::size_t t, const Vec3& normal, double spacing,
                     std::vector<Candidate>& candidates) {
  const Vec3 &a = mesh.corner(t, 0), &b = mesh.corner(t, 1), &c = mesh.corner(t, 2);
  const int n = intervals(std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}), spacing);
  for (int i = 1; i < n; ++i)
    for (int j = 1; i + j < n; ++j)
      candidates.push_back({a + static_cast<double>(i) / n * (b - a) + static_cast<double>(j) / n * (c - a),
                            normal, 0, mesh.triangles[t]});
}

// The faces at an edge.
struct EdgeSides {
  std::vector<Vec3> normals,  // the normal of each face
      opposite;               // the corner of each face that is not on the edge
};

// Returns whether the edge that starts at `a` is sharp and goes inward. Other bodies touch such an edge only
// where they touch its faces, so it needs no samples.
bool is_crease(const EdgeSides& sides, const Vec3& a) {
  return sides.normals.size() == 2 && sides.normals[0].dot(sides.normals[1]) < sharp_edge &&
         sides.normals[0].dot(sides.opposite[1] - a) > 0;
}

}  // namespace

double default_sample_spacing(double volume) { return math::cbrt(volume) / 8; }

double estimated_samples(double area, double spacing) { return area / (spacing * spacing); }

// Areas have a sample in each square of the spacing, edges and rings have one in each interval. The side of a
// cylinder or capsule is a feature edge with nodes along the axis.
double estimated_samples(const LevelSet& shape, double spacing) {
  const double r = shape.radius;
  switch (shape.kind) {
    case LevelSet::Kind::box: {
      const Vec3 size = 2 * shape.half;
      const double on_edges = std::clamp(size.minCoeff(), spacing / max_on_edge, spacing);
      return estimated_samples(2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x()),
                               spacing) +
             4 * size.sum() / on_edges;
    }
    case LevelSet::Kind::cylinder: {
      const double apart = round_spacing(r, spacing);
      return estimated_samples(2 * pi * r * r, apart) + 4 * pi * r / apart + 2 * shape.half_length / spacing;
    }
    case LevelSet::Kind::torus: {
      const double apart = round_spacing(r + shape.tube, spacing);
      return estimated_samples(4 * pi * pi * r * shape.tube, apart) + 16 * pi * r / apart;
    }
    case LevelSet::Kind::capsule:
      return 2 * shape.half_length / spacing;
    case LevelSet::Kind::sphere:
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  return 0;
}

std::vector<Vec3> surface_samples(const LevelSet& shape, double spacing) {
  DUET_ASSERT(spacing > 0);
  switch (shape.kind) {
    case LevelSet::Kind::box:
      return box_samples(shape.half, spacing);
    case LevelSet::Kind::cylinder:
      return cylinder_samples(shape.radius, shape.half_length, round_spacing(shape.radius, spacing));
    case LevelSet::Kind::torus:
      return torus_samples(shape.radius, shape.tube, round_spacing(shape.radius + shape.tube, spacing));
    case LevelSet::Kind::sphere:
    case LevelSet::Kind::capsule:
    case LevelSet::Kind::grid:
    case LevelSet::Kind::half_space:
      break;
  }
  return {};
}

std::vector<Vec3> surface_samples(const TriangleMesh& mesh, double spacing) {
  std::vector<Vec3> samples;
  for (const MeshSample& sample : mesh_samples(mesh, spacing)) samples.push_back(sample.position);
  return samples;
}

std::vector<MeshSample> mesh_samples(const TriangleMesh& mesh, double spacing) {
  DUET_ASSERT(spacing > 0);
  std::vector<std::vector<Vec3>> at_vertex(mesh.positions.size());
  std::vector<char> in_crease(mesh.positions.size(), 0);
  std::map<std::pair<int, int>, EdgeSides> at_edge;
  double longest_edge = 0;
  std::vector<Candidate> faces;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vec3 normal = area_vector(mesh, t).normalized();
    const Triangle& corners = mesh.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      at_vertex[static_cast<std::size_t>(corners[k])].push_back(normal);
      EdgeSides& sides = at_edge[std::minmax(corners[k], corners[(k + 1) % 3])];
      sides.normals.push_back(normal);
      sides.opposite.push_back(mesh.corner(t, (k + 2) % 3));
    }
    add_face_points(mesh, t, normal, spacing, faces);
  }
  std::vector<Candidate> candidates, edges;
  for (const auto& [edge, sides] : at_edge) {
    const Vec3 &a = mesh.positions[as_index(edge.first)], &b = mesh.positions[as_index(edge.second)];
    longest_edge = std::max(longest_edge, (b - a).norm());
    if (is_crease(sides, a)) {
      in_crease[as_index(edge.first)] = in_crease[as_index(edge.second)] = 1;
      continue;
    }
    const int n = intervals((b - a).norm(), spacing);
    for (int i = 1; i < n; ++i)
      edges.push_back(
          candidate(a + static_cast<double>(i) / n * (b - a), sides.normals, {edge.first, edge.second, -1}));
  }
  for (std::size_t v = 0; v < mesh.positions.size(); ++v)
    if (in_crease[v] == 0)
      candidates.push_back(candidate(mesh.positions[v], at_vertex[v], {static_cast<int>(v), -1, -1}));
  sort_by_sharpness(candidates);
  sort_by_sharpness(edges);
  candidates.insert(candidates.end(), edges.begin(), edges.end());
  candidates.insert(candidates.end(), faces.begin(), faces.end());
  // No point is farther than `gap` from a candidate, and thinning adds its distance to that. The other bound,
  // 0.7 spacings, is how far points of a square lattice are from its nodes.
  const double gap = std::min(spacing, longest_edge) / std::numbers::sqrt3;
  return thinned(candidates, std::min(0.7 * spacing, spacing - gap));
}

std::vector<char> on_flat_faces(const LevelSet& shape, const std::vector<Vec3>& samples) {
  constexpr int directions = 8;
  // Radius of the test circle, as a fraction of the smallest size of the shape. Edges nearer than that count
  // as bends.
  constexpr double way = 1e-3;
  // Greatest distance from the tangent plane, as a fraction of the radius of the circle, at which the surface
  // counts as flat. A surface whose radius of curvature is the smallest size falls off by half of 1e-3.
  constexpr double flatness = 1e-5;
  const double size = shape.min_size(), step = way * size;
  std::vector<char> flat;
  flat.reserve(samples.size());
  for (const Vec3& x : samples) {
    const SignedDistance here = shape.exact(x);
    const Vec3 u = here.normal.unitOrthogonal(), w = here.normal.cross(u);
    bool is_flat = true;
    for (int i = 0; i < directions && is_flat; ++i) {
      const double angle = 2 * pi * i / directions;
      const Vec3 beside = x + step * (math::cos(angle) * u + math::sin(angle) * w);
      is_flat = std::abs(shape.exact(beside).distance - here.distance) < flatness * step;
    }
    flat.push_back(is_flat ? 1 : 0);
  }
  return flat;
}

std::vector<Vec3> points_inside(const LevelSet& shape, const std::vector<Vec3>& samples) {
  const double way = shape.min_size() / 4, around = way / 10;
  std::vector<Vec3> inside;
  inside.reserve(samples.size());
  for (const Vec3& x : samples) {
    Vec3 sum = Vec3::Zero();
    for (int i = 0; i < 27; ++i) {
      const Vec3 offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      sum += shape.normal(x + around * offset);
    }
    inside.push_back(x - way * sum.normalized());
  }
  return inside;
}

}  // namespace duet
