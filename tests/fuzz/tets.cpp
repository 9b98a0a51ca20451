// Tetrahedra in files of Gmsh (the input begins with `$`) and Medit, and their check.
#include "tests/fuzz/harness.h"

#include "sim/geometry/files/tet_mesh_file.h"
#include "sim/geometry/mesh/tet_mesh_check.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = fuzz::text_of(data, size);
  const auto path = fuzz::write_file(bytes.starts_with('$') ? "tets.msh" : "tets.mesh", bytes);
  fuzz::is_accepted([&] {
    TetMesh mesh = read_tet_mesh(path.string());
    static_cast<void>(repair(mesh));
  });
  return 0;
}
