// The rules of a rigid body's shape, and its mesh file. Internal to the reader: includes toml++.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/scene/document.h"
#include "sim/scene/reader.h"

namespace duet::scene {

class ShapeReader {
 public:
  ShapeReader(const std::string& scene_path, Meshes meshes, Problems& problems)
      : scene_path_(scene_path), meshes_(meshes), problems_(problems) {}

  // Finishes the body's shape, whose keys have been read from `body_table`. Reports what is wrong with it.
  void check(RigidBody& body, const toml::table& body_table, const std::string& path);

  const std::vector<std::string>& notes() const { return notes_; }
  std::uint64_t fingerprint() const { return fingerprint_; }

 private:
  bool check_kind(Shape& shape, const toml::table& table, const std::string& path);
  void load_mesh(Shape& shape, const toml::node& at, const std::string& path);
  void check_sample_spacing(const RigidBody& body, const toml::table& body_table, const std::string& path);

  const std::string& scene_path_;
  Meshes meshes_;
  Problems& problems_;
  // Each file is read and complained about once; null for those with flaws.
  std::map<std::string, std::shared_ptr<const TriangleMesh>> loaded_;
  std::vector<std::string> notes_;
  std::uint64_t fingerprint_ = 0;
};

}  // namespace duet::scene
