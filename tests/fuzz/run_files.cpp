// Further files of a run. The first byte of the input chooses the file, the rest is its content.
#include <vector>

#include "tests/fuzz/harness.h"

#include "sim/io/expected_hashes.h"
#include "sim/io/run_claim.h"
#include "sim/io/run_source.h"
#include "sim/io/values_file.h"

using namespace duet;

namespace {

// Bodies of the values in the corpus: a rigid box and a deformable one.
std::vector<io::ManifestBody> listed_bodies() {
  io::ManifestBody rigid, soft;
  rigid.name = "ball";
  rigid.kind = "rigid";
  rigid.vertices = 8;
  rigid.triangles = 12;
  rigid.normals = 6;
  rigid.uvs = 4;
  soft = rigid;
  soft.normals = soft.uvs = 24;
  soft.name = "block";
  soft.kind = "deformable";
  return {rigid, soft};
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const std::vector<io::ManifestBody> bodies = listed_bodies();
  const io::RunDirectory run{fuzz::memory_folder(), {}};
  const std::string bytes = fuzz::text_of(data + 1, size - 1);
  switch (data[0] % 7) {
    case 0:
      fuzz::write_file("manifest.json", bytes);
      fuzz::is_accepted([&] { static_cast<void>(io::read_manifest(run)); });
      break;
    case 1:
      fuzz::write_file("source/source.json", bytes);
      fuzz::is_accepted([&] { static_cast<void>(io::read_source(run)); });
      break;
    case 2:
      fuzz::write_file("claim/0001.json", bytes);
      fuzz::is_accepted([&] { static_cast<void>(io::RunClaim::holder(run.root)); });
      break;
    case 3:
      fuzz::write_file("values/0001.npy", bytes);
      fuzz::is_accepted([&] { static_cast<void>(io::read_values(run, bodies, 1)); });
      break;
    case 4:
      fuzz::write_file("values/bodies.npy", bytes);
      fuzz::is_accepted([&] { static_cast<void>(io::read_rest_surfaces(run, bodies)); });
      break;
    case 5:
      fuzz::is_accepted([&] { static_cast<void>(io::read_obj(fuzz::write_file("0001.obj", bytes))); });
      break;
    default:
      fuzz::is_accepted([&] { static_cast<void>(io::read_expected(fuzz::write_file("hashes.txt", bytes))); });
  }
  return 0;
}
