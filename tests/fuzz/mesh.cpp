// Triangle meshes of the format DUET_FORMAT (obj, ply, stl or gltf), and their check, which follows wherever
// a scene names a mesh.
#include "tests/fuzz/harness.h"

#include "sim/geometry/files/mesh_file.h"
#include "sim/geometry/mesh/mesh_check.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = fuzz::text_of(data, size), format = DUET_FORMAT;
  const bool is_binary = format == "gltf" && bytes.starts_with("glTF");
  const std::filesystem::path path = fuzz::write_file("mesh." + (is_binary ? "glb" : format), bytes);
  fuzz::is_accepted([&] {
    TriangleMesh mesh = read_mesh(path.string());
    static_cast<void>(repair(mesh));
  });
  return 0;
}
