// Checks the rules of a body's shape and reads its mesh file. Internal to the reader: includes toml++.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "sim/scene/reader/document.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene {

/// Checks the shapes of a scene and reads their mesh files, each of them once.
class ShapeReader {
 public:
  /// Mesh files that `files` does not name are searched relative to the folder of `scene_path`. With
  /// Meshes::leave no file is read. The arguments must outlive the object.
  ShapeReader(const std::string& scene_path, Meshes meshes, const FileMap& files, Problems& problems)
      : scene_path_(scene_path), meshes_(meshes), given_(files), problems_(problems) {}

  /// Sets the kind of a rigid body's shape and reads its mesh; reports flaws. The keys of the body have been
  /// read from `body_table`, which is at `path`.
  void check(RigidBody& body, const toml::table& body_table, const std::string& path);
  /// Reads the mesh or the tetrahedra of a volume, whose kind is known; reports flaws. `table` is the table
  /// of the shape and `path` its path.
  void check(DeformableShape& shape, const toml::table& table, const std::string& path);

  /// Reads the mesh of a skin; reports flaws. `table` is the table of the skin and `path` its path.
  void check(Skin& skin, const toml::table& table, const std::string& path);

  /// Returns a text for every repair of a mesh.
  const std::vector<std::string>& notes() const { return notes_; }
  /// Returns a hash of all meshes that were read; 0: none.
  std::uint64_t fingerprint() const { return fingerprint_; }
  /// Returns the paths of the mesh files by their names in the scene; empty with Meshes::leave.
  const FileMap& files() const { return files_; }

 private:
  // Reports each of `keys` that `table` has as one without effect on a shape of this kind.
  void reject(const toml::table& table, const std::string& path, std::initializer_list<std::string_view> keys,
              std::string_view kind, const std::string& hint);
  void finish(Shape& shape, const toml::table& table, const std::string& path);
  void load_mesh(Shape& shape, const toml::node& at, const std::string& path);
  void load_tets(DeformableShape& shape, const toml::node& at, const std::string& path);
  // Returns the mesh of the file `name`, which `load` reads at the first use. Reports flaws of it, then
  // returns null.
  template <class Mesh, class Load>
  std::shared_ptr<const Mesh> loaded(std::map<std::string, std::shared_ptr<const Mesh>>& known,
                                     const std::string& name, const toml::node& at, const std::string& path,
                                     Load&& load);
  void check_spacing(const DeformableShape& shape, const toml::table& table, const std::string& path);
  void check_sample_spacing(const RigidBody& body, const toml::table& body_table, const std::string& path);

  const std::string& scene_path_;
  Meshes meshes_;
  const FileMap& given_;
  FileMap files_;
  Problems& problems_;
  // Meshes by the paths of their files, so that each file is read and reported once; null: it has flaws.
  std::map<std::string, std::shared_ptr<const TriangleMesh>> meshes_loaded_;
  std::map<std::string, std::shared_ptr<const TetMesh>> tets_loaded_;
  std::vector<std::string> notes_;
  std::uint64_t fingerprint_ = 0;
};

}  // namespace duet::scene
