#include "sim/geometry/files/mesh_file.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <new>
#include <string_view>

#include <assimp/DefaultIOSystem.h>
#include <assimp/Importer.hpp>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/geometry/files/gltf_check.h"
#include "sim/geometry/files/gltf_uri.h"
#include "sim/geometry/files/obj_check.h"
#include "sim/geometry/files/ply_reader.h"

namespace duet {
namespace {

constexpr std::array<std::string_view, 5> endings = {".obj", ".ply", ".stl", ".gltf", ".glb"};

// Returns the extension of a path in lower case.
std::string lower_ending(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return ending;
}

// Throws FileError unless the path is that of a file that can be opened.
void require_readable(const std::string& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored))
    throw FileError(path, "there is no such file", "check the path");
  if (!std::filesystem::is_regular_file(path, ignored) || !std::ifstream(path, std::ios::binary))
    throw FileError(path, "the file cannot be read", "check that it is a file and who may read it");
}

Vec3f vector(const aiVector3D& v) { return {v.x, v.y, v.z}; }

// Appends a part of the scene. Faces that are no triangles or have bad indices are skipped.
void add(const aiMesh& part, TriangleMesh& mesh) {
  const int base = static_cast<int>(mesh.positions.size());
  for (unsigned v = 0; v < part.mNumVertices; ++v)
    mesh.positions.push_back(vector(part.mVertices[v]).cast<double>());
  for (unsigned f = 0; f < part.mNumFaces; ++f) {
    const unsigned* v = part.mFaces[f].mIndices;
    if (part.mFaces[f].mNumIndices != 3 || std::max({v[0], v[1], v[2]}) >= part.mNumVertices) continue;
    mesh.triangles.push_back(
        {base + static_cast<int>(v[0]), base + static_cast<int>(v[1]), base + static_cast<int>(v[2])});
    if (part.HasNormals())
      mesh.normals.push_back(
          {vector(part.mNormals[v[0]]), vector(part.mNormals[v[1]]), vector(part.mNormals[v[2]])});
    if (part.HasTextureCoords(0)) {
      const aiVector3D* uv = part.mTextureCoords[0];
      mesh.uvs.push_back(
          {vector(uv[v[0]]).head<2>(), vector(uv[v[1]]).head<2>(), vector(uv[v[2]]).head<2>()});
    }
  }
}

// Clears an attribute unless every triangle has it and all its values are good.
template <class Corners>
void keep_if_complete(std::vector<Corners>& attribute, std::size_t triangles, auto&& is_good) {
  const auto all_good = [&](const Corners& corners) {
    return std::all_of(corners.begin(), corners.end(), is_good);
  };
  if (attribute.size() != triangles || !std::all_of(attribute.begin(), attribute.end(), all_good))
    attribute.clear();
}

// Returns the text of an OBJ file as Assimp understands it. Without a byte order mark at its start, which
// hides the first line, and with a zero before each decimal point that begins a number, as in "-.5": Assimp
// passes over vertices with such numbers. The result is empty if the text needs no change.
std::string obj_for_assimp(std::string_view text) {
  constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
  std::string result;
  std::size_t copied = text.starts_with(byte_order_mark) ? byte_order_mark.size() : 0;
  bool is_changed = copied > 0;
  for (std::size_t point = text.find('.', 1); point < text.size(); point = text.find('.', point + 1)) {
    const bool is_signed = text[point - 1] == '-' || text[point - 1] == '+';
    const char before = is_signed && point > 1 ? text[point - 2] : text[point - 1];
    const char after = point + 1 < text.size() ? text[point + 1] : ' ';
    if ((before != ' ' && before != '\t') || after < '0' || after > '9') continue;
    result.append(text.substr(copied, point - copied)).push_back('0');
    copied = point;
    is_changed = true;
  }
  if (is_changed) result.append(text.substr(copied));
  return result;
}

// Opens the files that Assimp asks for. Assimp 5.2 passes on the names in glTF files as they are written,
// percent-encoded; here they name the files that they stand for. Assimp 6 does not let one derive from its
// own class of files, so that this one has a member of it.
class GltfFiles : public Assimp::IOSystem {
 public:
  explicit GltfFiles(const std::string& gltf) : folder_(gltf.substr(0, gltf.find_last_of('/') + 1)) {}
  bool Exists(const char* file) const override { return files_.Exists(file); }
  char getOsSeparator() const override { return files_.getOsSeparator(); }
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    const std::string path(file);
    if (!path.starts_with(folder_)) return files_.Open(file, mode);
    const std::string found = folder_ + path_of_uri(folder_, path.substr(folder_.size()));
    return files_.Open(found.c_str(), mode);
  }
  void Close(Assimp::IOStream* stream) override { files_.Close(stream); }

 private:
  Assimp::DefaultIOSystem files_;
  std::string folder_;  // of the .gltf file, with the slash at its end; empty if its path has none
};

// Reads a file by Assimp and joins all its objects. Throws FileError.
TriangleMesh import(const std::string& path) {
  Assimp::Importer importer;
  if (lower_ending(path) == ".gltf") importer.SetIOHandler(new GltfFiles(path));  // the importer deletes it
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE, aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  constexpr unsigned steps = aiProcess_ValidateDataStructure | aiProcess_Triangulate | aiProcess_SortByPType |
                             aiProcess_PreTransformVertices;
  const bool is_obj = lower_ending(path) == ".obj";
  const std::string text = is_obj ? obj_for_assimp(io::read_file(path)) : std::string();
  const aiScene* scene = text.empty() ? importer.ReadFile(path, steps)
                                      : importer.ReadFileFromMemory(text.data(), text.size(), steps, "obj");
  if (!scene) {
    const std::string reason = importer.GetErrorString();
    // Assimp catches all exceptions; too little memory is no fault of the file.
    if (reason.find("std::bad_alloc") != std::string::npos) throw std::bad_alloc();
    if (is_obj) check_obj_faces(path, io::read_file(path));
    throw FileError(path, reason, "export the mesh again");
  }
  TriangleMesh mesh;
  for (unsigned i = 0; i < scene->mNumMeshes; ++i) add(*scene->mMeshes[i], mesh);
  return mesh;
}

}  // namespace

TriangleMesh read_mesh(const std::string& path) {
  require_readable(path);
  const std::string ending = lower_ending(path);
  if (std::find(endings.begin(), endings.end(), ending) == endings.end())
    throw FileError(path, "is no mesh file that is known by its ending",
                    fmt::format("use one of {}", fmt::join(endings, " ")));
  if (ending == ".gltf" || ending == ".glb") check_gltf(path);
  TriangleMesh mesh = ending == ".ply" ? read_ply(path) : import(path);
  const std::size_t count = mesh.triangles.size();
  // The normals of an STL file are those of its triangles and say nothing about smoothness.
  if (ending == ".stl") mesh.normals.clear();
  keep_if_complete(mesh.normals, count, [](const Vec3f& n) { return std::abs(n.norm() - 1) < 0.01F; });
  keep_if_complete(mesh.uvs, count, [](const Vec2f& uv) { return uv.allFinite(); });
  return mesh;
}

}  // namespace duet
