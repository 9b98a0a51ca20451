// The rules of a body's shape, and its mesh file. Internal to the reader: includes toml++.
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

class ShapeReader {
 public:
  ShapeReader(const std::string& scene_path, Meshes meshes, const FileMap& files, Problems& problems)
      : scene_path_(scene_path), meshes_(meshes), given_(files), problems_(problems) {}

  // Finishes the body's shape, whose keys have been read from `body_table`. Reports what is wrong with it.
  void check(RigidBody& body, const toml::table& body_table, const std::string& path);
  // The same for a volume whose kind is known; `table` is the shape's, at `path`.
  void check(DeformableShape& shape, const toml::table& table, const std::string& path);

  // Reads the mesh of a skin, which `table` describes at `path`.
  void check(Skin& skin, const toml::table& table, const std::string& path);

  const std::vector<std::string>& notes() const { return notes_; }
  std::uint64_t fingerprint() const { return fingerprint_; }
  const FileMap& files() const { return files_; }  // that were read

 private:
  void reject(const toml::table& table, const std::string& path, std::initializer_list<std::string_view> keys,
              std::string_view kind, const std::string& hint);
  void finish(Shape& shape, const toml::table& table, const std::string& path);
  void load_mesh(Shape& shape, const toml::node& at, const std::string& path);
  void load_tets(DeformableShape& shape, const toml::node& at, const std::string& path);
  // What `load` makes of the file at its first use; complains and returns null for one with flaws.
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
  // Each file is read and complained about once; null for those with flaws.
  std::map<std::string, std::shared_ptr<const TriangleMesh>> meshes_loaded_;
  std::map<std::string, std::shared_ptr<const TetMesh>> tets_loaded_;
  std::vector<std::string> notes_;
  std::uint64_t fingerprint_ = 0;
};

}  // namespace duet::scene
