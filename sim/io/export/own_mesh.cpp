#include "sim/io/export/own_mesh.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <string_view>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/run_source.h"
#include "sim/scene/reader/reader.h"

namespace duet::io {
namespace {

// File from which a body's mesh or skin comes according to the scene, and its placement at frame 0.
struct MeshOrigin {
  // Path as the scene has it. Empty: the body was not made of a mesh, or is drawn by another surface.
  std::string file;
  double scale = 1;  // meters for a unit of the file
  Pose placement;    // pose of the scaled mesh in the world
};

// Returns the origins of the meshes of the scene's bodies, by the names of the bodies.
std::map<std::string, MeshOrigin> mesh_origins(const scene::Scene& scene) {
  std::map<std::string, MeshOrigin> origins;
  for (const scene::RigidBody& body : scene.rigid)
    if (body.shape.kind == scene::ShapeKind::mesh)
      origins[body.name] = {
          body.shape.mesh_file, body.shape.scale, {body.placement.position, body.placement.orientation}};
  for (const scene::DeformableBody& body : scene.deformable)
    if (body.skin)
      origins[body.name] = {
          body.skin->mesh_file, body.skin->scale, {body.placement.position, body.placement.orientation}};
  return origins;
}

// A grid of cubic cells with the positions in them. Positions nearer to a point than the width of a cell
// lie in the cell of the point or in one of the 26 around it.
class Cells {
 public:
  // `width` is that of a cell, in the unit of the positions.
  Cells(const std::vector<Vec3>& positions, double width) : width_(width) {
    for (std::size_t i = 0; i < positions.size(); ++i)
      cells_.emplace(cell(positions[i]), static_cast<int>(i));
  }
  // Calls visit(index) for the positions in the cell of `x` and in those around it.
  template <class Visit>
  void near(const Vec3& x, Visit&& visit) const {
    const Cell middle = cell(x);
    for (int i = -1; i <= 1; ++i)
      for (int j = -1; j <= 1; ++j)
        for (int k = -1; k <= 1; ++k) {
          const auto [begin, end] = cells_.equal_range({middle[0] + i, middle[1] + j, middle[2] + k});
          for (auto at = begin; at != end; ++at) visit(at->second);
        }
  }

 private:
  // Indices of a cell: whole numbers, as doubles because they may exceed the range of integers.
  using Cell = std::array<double, 3>;
  Cell cell(const Vec3& x) const {
    return {std::floor(x.x() / width_), std::floor(x.y() / width_), std::floor(x.z() / width_)};
  }
  double width_;
  std::multimap<Cell, int> cells_;
};

// Returns the index of the position nearest to `x`, by looking at all of them.
int nearest_of_all(const Vec3& x, const std::vector<Vec3>& positions) {
  const auto nearer = [&](const Vec3& a, const Vec3& b) {
    return (a - x).squaredNorm() < (b - x).squaredNorm();
  };
  return static_cast<int>(std::min_element(positions.begin(), positions.end(), nearer) - positions.begin());
}

}  // namespace

std::string obj_statements(const std::string& text) {
  std::string statements;
  statements.reserve(text.size() + 1);
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\r' && text[i] != '\n') {
      statements += text[i];
      continue;
    }
    if (text[i] == '\r' && i + 1 < text.size() && text[i + 1] == '\n') ++i;
    const bool goes_on = !statements.empty() && statements.back() == '\\';
    if (goes_on)
      statements.back() = ' ';
    else
      statements += '\n';
  }
  return statements;
}

std::vector<Vec3> obj_vertices(const std::string& text) {
  std::vector<Vec3> vertices;
  for (std::size_t at = 0, end = 0; at < text.size(); at = end + 1) {
    end = std::min(text.find('\n', at), text.size());
    std::string_view line(text.data() + at, end - at);
    const auto skip_blanks = [&] {
      line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size()));
    };
    skip_blanks();
    if (line.size() < 2 || line[0] != 'v' || (line[1] != ' ' && line[1] != '\t')) continue;
    line.remove_prefix(1);
    Vec3 x;
    for (int k = 0; k < 3; ++k) {
      skip_blanks();
      if (line.starts_with('+')) line.remove_prefix(1);
      const auto [after, error] = std::from_chars(line.data(), line.data() + line.size(), x[k]);
      if (error != std::errc()) return vertices;
      line.remove_prefix(static_cast<std::size_t>(after - line.data()));
    }
    vertices.push_back(x);
  }
  return vertices;
}

std::optional<std::vector<int>> match_points(const std::vector<Vec3>& points,
                                             const std::vector<Vec3>& positions, double tolerance) {
  // A mesh matches if at most one in this many points is far from all positions. Vertices that no face uses
  // are such points; a larger value demands that there are fewer.
  constexpr std::size_t max_strangers = 2;
  if (positions.empty()) return std::nullopt;
  const Cells cells(positions, 2 * tolerance);
  std::vector<int> found(points.size(), -1);
  std::size_t strangers = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    double least = tolerance;
    cells.near(points[i], [&](int k) {
      const double distance = (positions[static_cast<std::size_t>(k)] - points[i]).norm();
      if (distance > least || (distance == least && found[i] >= 0 && found[i] < k)) return;
      least = distance;
      found[i] = k;
    });
    if (found[i] < 0) ++strangers;
  }
  if (strangers * max_strangers > points.size()) return std::nullopt;
  for (std::size_t i = 0; i < points.size(); ++i)
    if (found[i] < 0) found[i] = nearest_of_all(points[i], positions);
  return found;
}

std::vector<std::optional<OwnMesh>> own_meshes(const ExportedRun& run) {
  std::vector<std::optional<OwnMesh>> meshes(run.bodies().size());
  const std::optional<RunSource> source = read_source(run.run());
  if (!source) return meshes;
  const scene::Scene scene = scene::read(run.run().scene().string(), {}, scene::Meshes::leave).scene;
  const std::map<std::string, MeshOrigin> origins = mesh_origins(scene);
  const bool has_start = fs::exists(run.run().values(0));
  std::optional<FrameValues> start;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const ExportedBody& body = run.bodies()[i];
    const auto origin = origins.find(body.name);
    if (origin == origins.end() || (body.is_rigid() && !has_start)) continue;
    const auto file = source->files.find(origin->second.file);
    if (file == source->files.end() || fs::path(file->second).extension() != ".obj") continue;

    std::vector<Vec3> points = obj_vertices(obj_statements(run.run().read(file->second)));
    if (points.empty()) continue;
    double largest = 0;  // largest coordinate of the file, in the unit of the export
    for (Vec3& x : points) {
      x *= origin->second.scale * run.scale();
      largest = std::max(largest, x.cwiseAbs().maxCoeff());
      x = run.axes() *
          (origin->second.placement.orientation * x + run.scale() * origin->second.placement.position);
    }
    std::vector<Vec3> positions = body.rest.positions;
    double farthest = 0;
    if (body.is_rigid()) {
      if (!start) start = run.read(0);
      const Pose& pose = start->rigid[static_cast<std::size_t>(body.row)].pose;
      for (Vec3& x : positions) x = pose.to_world(x);
    }
    for (const Vec3& x : positions) farthest = std::max(farthest, x.cwiseAbs().maxCoeff());
    // Meshes are read in single precision, so a coordinate of the file has an error relative to the largest
    // one. Positions of bodies are doubles, with an error relative to the distance from the origin. Both
    // factors leave room for several roundings; much larger ones would let other vertices match.
    const double tolerance = 4 * double{std::numeric_limits<float>::epsilon()} * largest + 1e-14 * farthest;
    if (std::optional<std::vector<int>> found = match_points(points, positions, tolerance))
      meshes[i] = OwnMesh{file->second, std::move(*found)};
  }
  return meshes;
}

std::vector<std::string> notes_on_own_meshes(const ExportedRun& run,
                                             const std::vector<std::optional<OwnMesh>>& meshes) {
  if (!fs::exists(run.run().scene())) return {};
  const scene::Scene scene = scene::read(run.run().scene().string(), {}, scene::Meshes::leave).scene;
  const std::map<std::string, MeshOrigin> origins = mesh_origins(scene);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    const auto origin = origins.find(run.bodies()[i].name);
    if (!meshes[i] && origin != origins.end() && fs::path(origin->second.file).extension() == ".obj")
      names.push_back(run.bodies()[i].name);
  }
  if (names.empty()) return {};
  return {fmt::format(
      "{} made of OBJ files come{} in Duet's order of vertices, as the run has no {} (bodies such as `{}`)",
      names.size() == 1 ? "a body" : std::to_string(names.size()) + " bodies", names.size() == 1 ? "s" : "",
      fs::exists(run.run().values(0)) ? "such copies of them" : "frame 0, by which vertices are found",
      names.front())};
}

}  // namespace duet::io
