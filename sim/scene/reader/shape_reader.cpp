#include "sim/scene/reader/shape_reader.h"

#include <array>
#include <filesystem>

#include <fmt/format.h>

#include "sim/base/hash.h"
#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/files/tet_mesh_file.h"
#include "sim/geometry/level_set/shape_samples.h"
#include "sim/geometry/mesh/mesh_check.h"
#include "sim/geometry/mesh/tet_mesh_check.h"
#include "sim/scene/reader/table_reader.h"
#include "sim/scene/solids.h"

namespace duet::scene {
namespace {

// Largest number of contact points on a rigid body that a `sample_spacing` may ask for; more take too much
// memory.
constexpr double max_samples = 1e6;
// Largest number of tetrahedra along the longest extent of a filled surface that a `spacing` may ask for.
constexpr double max_cells = 256;
// Keys of the kinds of shapes, in the order of ShapeKind and of those kinds of DeformableKind that can be
// filled.
constexpr std::array<std::string_view, 6> shape_kinds = {"box",      "sphere", "capsule",
                                                         "cylinder", "torus",  "mesh"};

// Returns `hash` continued by the mesh.
std::uint64_t fingerprint_of(const TriangleMesh& mesh, std::uint64_t hash) {
  hash = hash_bytes(mesh.positions.data(), mesh.positions.size() * sizeof(Vec3), hash);
  return hash_bytes(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle), hash);
}

std::uint64_t fingerprint_of(const TetMesh& mesh, std::uint64_t hash) {
  hash = hash_bytes(mesh.nodes.data(), mesh.nodes.size() * sizeof(Vec3), hash);
  return hash_bytes(mesh.tets.data(), mesh.tets.size() * sizeof(Tet), hash);
}

// Returns whether a shape has an extent. Flaws of it, which have been reported, may leave it without one, and
// a mesh that has not been read has none.
bool has_extent(const Shape& shape) {
  switch (shape.kind) {
    case ShapeKind::sphere:
      return shape.radius > 0;
    case ShapeKind::capsule:
    case ShapeKind::cylinder:
      return shape.radius > 0 && shape.length > 0;
    case ShapeKind::torus:
      return shape.tube > 0 && shape.tube < shape.radius;
    case ShapeKind::box:
      return shape.size.minCoeff() > 0;
    case ShapeKind::mesh:
      break;
  }
  return shape.mesh != nullptr;
}

// Returns the edge lengths (m) of the bounding box of a shape that has an extent.
Vec3 extent(const Shape& shape) {
  if (shape.kind != ShapeKind::mesh) return level_set(shape).upper() - level_set(shape).lower();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : shape.mesh->positions) box.extend(x);
  return shape.scale * box.sizes();
}

// Returns the volume (m^3) of a shape that has an extent.
double volume_of(const Shape& shape) {
  if (shape.kind != ShapeKind::mesh) return volume(level_set(shape));
  return mass_properties(*shape.mesh).volume * shape.scale * shape.scale * shape.scale;
}

// Returns about how many contact points a shape that has an extent gets.
double samples_of(const Shape& shape, double spacing) {
  if (shape.kind != ShapeKind::mesh) return estimated_samples(level_set(shape), spacing);
  double area = 0;
  for (std::size_t t = 0; t < shape.mesh->triangles.size(); ++t) area += area_vector(*shape.mesh, t).norm();
  return estimated_samples(area * shape.scale * shape.scale, spacing);
}

// Returns a spacing (m) by which a shape that has an extent gets about `samples` contact points, or `longest`
// (m) if that is less.
double spacing_for(const Shape& shape, double samples, double longest) {
  double spacing = longest;
  while (samples_of(shape, spacing / 2) <= samples) spacing /= 2;
  return spacing;
}

}  // namespace

void ShapeReader::check(RigidBody& body, const toml::table& body_table, const std::string& path) {
  const toml::table* table = body_table["shape"].as_table();
  const auto kind = table ? only_kind(*table, shape_kinds, path + ".shape", problems_) : std::nullopt;
  if (!kind) return;
  body.shape.kind = static_cast<ShapeKind>(*kind);
  if (body.shape.kind != ShapeKind::mesh)
    reject(*table, path + ".shape", {"scale", "cells"}, shape_kinds[*kind], "it belongs to a mesh");
  finish(body.shape, *table, path + ".shape");
  check_sample_spacing(body, body_table, path);
}

void ShapeReader::check(DeformableShape& shape, const toml::table& table, const std::string& path) {
  const bool is_box = shape.kind == DeformableKind::box, is_file = shape.kind == DeformableKind::tets;
  const std::string_view word = is_box    ? "box"
                                : is_file ? "file of tetrahedra"
                                          : shape_kinds[static_cast<std::size_t>(shape.kind)];
  if (!is_box)
    reject(table, path, {"cells", "pattern"}, word,
           "it belongs to a box; what is filled with tetrahedra has a `spacing`");
  if (shape.kind != DeformableKind::mesh && !is_file)
    reject(table, path, {"scale"}, word, "it belongs to a mesh");
  if (is_box || is_file)
    reject(table, path, {"spacing", "graded"}, word,
           is_box ? "a box is cut into `cells`" : "the file says where its tetrahedra are");
  if (is_file) {
    const toml::node& value = *table.get("tets");
    if (value.is_string() && meshes_ == Meshes::read) load_tets(shape, value, path + ".tets");
  }
  if (!shape.is_filled()) return;
  shape.surface.kind = static_cast<ShapeKind>(shape.kind);
  finish(shape.surface, table, path);
  check_spacing(shape, table, path);
}

void ShapeReader::reject(const toml::table& table, const std::string& path,
                         std::initializer_list<std::string_view> keys, std::string_view kind,
                         const std::string& hint) {
  for (const std::string_view key : keys)
    if (const toml::node* node = table.get(key))
      problems_.add(node->source(), fmt::format("{}.{}", path, key),
                    fmt::format("has no effect on a {}", kind), hint);
}

// Reads the mesh of a shape and checks the rules that tie its numbers together.
void ShapeReader::finish(Shape& shape, const toml::table& table, const std::string& path) {
  const toml::node& value = *table.get(shape_kinds[static_cast<std::size_t>(shape.kind)]);
  if (shape.kind == ShapeKind::mesh && value.is_string() && meshes_ == Meshes::read)
    load_mesh(shape, value, path + ".mesh");
  if (shape.kind == ShapeKind::torus && shape.tube > 0 && shape.radius > 0 && shape.tube >= shape.radius)
    problems_.add(value.source(), path + ".torus",
                  fmt::format("the tube's radius {:.6g} m must be less than the ring's {:.6g} m", shape.tube,
                              shape.radius),
                  "a ring has a hole");
}

void ShapeReader::check(Skin& skin, const toml::table& table, const std::string& path) {
  const toml::node* file = table.get("mesh");
  if (file && file->is_string() && meshes_ == Meshes::read)
    skin.mesh = loaded(meshes_loaded_, skin.mesh_file, *file, path + ".mesh", read_mesh);
}

void ShapeReader::load_mesh(Shape& shape, const toml::node& at, const std::string& path) {
  shape.mesh = loaded(meshes_loaded_, shape.mesh_file, at, path, read_mesh);
}

void ShapeReader::load_tets(DeformableShape& shape, const toml::node& at, const std::string& path) {
  shape.tets = loaded(tets_loaded_, shape.tet_file, at, path, read_tet_mesh);
}

template <class Mesh, class Load>
std::shared_ptr<const Mesh> ShapeReader::loaded(std::map<std::string, std::shared_ptr<const Mesh>>& known,
                                                const std::string& name, const toml::node& at,
                                                const std::string& path, Load&& load) {
  const auto given = given_.find(name);
  const std::string file =
      given != given_.end()
          ? given->second
          : (std::filesystem::path(scene_path_).parent_path() / name).lexically_normal().string();
  files_[name] = file;
  const auto [entry, is_new] = known.try_emplace(file);
  if (is_new) try {
      auto mesh = std::make_shared<Mesh>(load(file));
      const MeshReport report = repair(*mesh);
      for (const MeshFlaw& flaw : report.flaws)
        problems_.add(at.source(), path, fmt::format("{} {}", file, flaw.message), flaw.remedy);
      for (const std::string& done : report.repairs)
        notes_.push_back(fmt::format("{}: {}: {}", path, file, done));
      fingerprint_ = fingerprint_of(*mesh, fingerprint_);
      if (report.flaws.empty()) entry->second = std::move(mesh);
    } catch (const FileError& error) {
      problems_.add(at.source(), path, error.what());
    }
  return entry->second;
}

// Reports a spacing of tetrahedra that is too wide to leave anything of the shape, or so narrow that memory
// would not suffice.
void ShapeReader::check_spacing(const DeformableShape& shape, const toml::table& table,
                                const std::string& path) {
  const toml::node* node = table.get("spacing");
  const Shape& surface = shape.surface;
  if (!node || !shape.spacing || !has_extent(surface)) return;
  const Vec3 size = extent(surface);
  const double thickness = surface.kind == ShapeKind::mesh ? size.minCoeff() : level_set(surface).min_size();
  const double least = size.maxCoeff() / max_cells, largest = thickness / 2;
  if (!(largest > 0) || (*shape.spacing >= least && *shape.spacing <= largest)) return;
  problems_.add(node->source(), path + ".spacing",
                fmt::format("must be in [{:.4g}, {:.4g}] m for this shape, is {:.4g} m", least, largest,
                            *shape.spacing),
                fmt::format("{:.3g} m gives four cells across it", thickness / 4));
}

// Reports a spacing of contact points that is so narrow that memory would not suffice, or that has no effect.
// The default spacing follows from the volume, so that a body that is very thin for its size has too many.
void ShapeReader::check_sample_spacing(const RigidBody& body, const toml::table& body_table,
                                       const std::string& path) {
  const toml::node* node = body_table.get("sample_spacing");
  if (node && body.sample_spacing && body.shape.kind == ShapeKind::sphere) {
    problems_.add(node->source(), path + ".sample_spacing", "has no effect on a sphere",
                  "remove it: the deepest point of a sphere is known");
    return;
  }
  if ((node && !body.sample_spacing) || !has_extent(body.shape)) return;
  const double spacing = body.sample_spacing.value_or(default_sample_spacing(volume_of(body.shape)));
  const double count = samples_of(body.shape, spacing);
  if (count <= max_samples) return;
  const Vec3 size = extent(body.shape);
  const std::string number =
      fmt::format("about {:.2g} contact points, must be <= {:.0g}", count, max_samples);
  if (node)
    problems_.add(node->source(), path + ".sample_spacing", "asks for " + number,
                  fmt::format("{:.3g} m gives a thousand", spacing * std::sqrt(count / 1000)));
  else
    problems_.add(place_of(body_table, "shape"), path + ".shape",
                  fmt::format("is so thin for its size, {:.3g} m by {:.3g} m, that it gets {}",
                              size.minCoeff(), size.maxCoeff(), number),
                  fmt::format("make it thicker, or give `sample_spacing = {:.1g}` for fewer points",
                              spacing_for(body.shape, 1000, size.maxCoeff())));
}

}  // namespace duet::scene
