#include "sim/scene/shape_reader.h"

#include <array>
#include <filesystem>

#include <fmt/format.h>

#include "sim/base/hash.h"
#include "sim/geometry/mesh_check.h"
#include "sim/geometry/mesh_file.h"
#include "sim/scene/solids.h"
#include "sim/scene/table_reader.h"

namespace duet::scene {
namespace {

constexpr double most_samples = 1e6;
constexpr std::array<std::string_view, 6> kinds = {"box",      "sphere", "capsule",
                                                   "cylinder", "torus",  "mesh"};  // as ShapeKind

std::uint64_t fingerprint_of(const TriangleMesh& mesh, std::uint64_t hash) {
  hash = hash_bytes(mesh.positions.data(), mesh.positions.size() * sizeof(Vec3), hash);
  return hash_bytes(mesh.triangles.data(), mesh.triangles.size() * sizeof(Triangle), hash);
}

Vec3 extent(const Shape& shape) {
  if (shape.kind != ShapeKind::mesh) return level_set(shape).upper() - level_set(shape).lower();
  Eigen::AlignedBox3d box;
  for (const Vec3& x : shape.mesh->positions) box.extend(x);
  return shape.scale * box.sizes();
}

}  // namespace

void ShapeReader::check(RigidBody& body, const toml::table& body_table, const std::string& path) {
  const toml::table* table = body_table["shape"].as_table();
  if (!table || !check_kind(body.shape, *table, path + ".shape")) return;
  Shape& shape = body.shape;
  const toml::node& value = *table->get(kinds[static_cast<std::size_t>(shape.kind)]);
  if (shape.kind == ShapeKind::mesh && value.is_string() && meshes_ == Meshes::read)
    load_mesh(shape, value, path + ".shape.mesh");
  if (shape.kind == ShapeKind::torus && shape.tube > 0 && shape.radius > 0 && shape.tube >= shape.radius)
    problems_.add(value.source(), path + ".shape.torus",
                  fmt::format("the tube's radius {:.6g} m must be less than the ring's {:.6g} m", shape.tube,
                              shape.radius),
                  "a ring has a hole");
  check_sample_spacing(body, body_table, path);
}

bool ShapeReader::check_kind(Shape& shape, const toml::table& table, const std::string& path) {
  const std::optional<std::size_t> kind = only_kind(table, kinds, path, problems_);
  if (!kind) return false;
  shape.kind = static_cast<ShapeKind>(*kind);
  if (shape.kind != ShapeKind::mesh)
    for (const std::string_view key : {"scale", "cells"})
      if (const toml::node* node = table.get(key))
        problems_.add(node->source(), fmt::format("{}.{}", path, key),
                      fmt::format("has no effect on a {}", kinds[*kind]), "it belongs to a mesh");
  return true;
}

void ShapeReader::load_mesh(Shape& shape, const toml::node& at, const std::string& path) {
  const std::string file =
      (std::filesystem::path(scene_path_).parent_path() / shape.mesh_file).lexically_normal().string();
  const auto [entry, is_new] = loaded_.try_emplace(file);
  if (is_new) try {
      auto mesh = std::make_shared<TriangleMesh>(read_mesh(file));
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
  shape.mesh = entry->second;
}

// A spacing far below the body's size would ask for more contact points than there is memory.
void ShapeReader::check_sample_spacing(const RigidBody& body, const toml::table& body_table,
                                       const std::string& path) {
  const toml::node* node = body_table.get("sample_spacing");
  if (!node || !body.sample_spacing) return;
  if (body.shape.kind == ShapeKind::sphere) {
    problems_.add(node->source(), path + ".sample_spacing", "has no effect on a sphere",
                  "remove it: the deepest point of a sphere is known");
    return;
  }
  if (body.shape.kind == ShapeKind::mesh && !body.shape.mesh) return;
  const Vec3 size = extent(body.shape);
  const double area = 2 * (size.x() * size.y() + size.y() * size.z() + size.z() * size.x());
  const double count = area / (*body.sample_spacing * *body.sample_spacing);
  if (count > most_samples)
    problems_.add(node->source(), path + ".sample_spacing",
                  fmt::format("asks for about {:.2g} contact points, must be <= {:.0g}", count, most_samples),
                  fmt::format("{:.3g} m gives a thousand", std::sqrt(area / 1000)));
}

}  // namespace duet::scene
