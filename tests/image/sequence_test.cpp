// Tests of frames of a run directory: which picture is drawn, and which message comes if the folder is not as
// it should be.
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/image/small_scene.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/scratch_folder.h"

namespace duet::image_tests::sequence_test {
namespace {

namespace fs = std::filesystem;

class Sequence : public testing::Test {
 protected:
  Sequence() {
    fs::create_directories(run_.root / "mesh");
    io::write_obj(run_.mesh(0), small_bodies());
  }

  // Returns the message of the FileError with which drawing the frame ends.
  std::string failure(const io::Manifest& manifest, int frame) const {
    render::SequenceRenderer renderer(small_scene(), manifest);
    try {
      renderer.render_frame(run_, frame);
    } catch (const FileError& error) {
      return error.what();
    }
    return "no failure";
  }

  const ScratchFolder scratch_;
  const io::RunDirectory run_{scratch_.path()};
};

using test::contains;

std::string bytes_of(const fs::path& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST_F(Sequence, AFrameBecomesThePictureOfItsMesh) {
  render::SequenceRenderer renderer(small_scene(), small_manifest());
  renderer.render_frame(run_, 0);
  const std::vector<unsigned char> drawn = renderer.draw(io::read_obj(run_.mesh(0)));
  render::write_png((run_.root / "expected.png").string(), 320, 180, drawn);
  EXPECT_EQ(bytes_of(run_.image(0)), bytes_of(run_.root / "expected.png"));
}

TEST_F(Sequence, AMovingCameraIsWhereItIsAtTheFramesTime) {
  scene::Scene moving = small_scene(), still = small_scene();
  const Vec3 eye = moving.camera.position + Vec3(1, 0.5, 0), target = moving.camera.target + Vec3(0.3, 0, 0);
  moving.camera.keyframes = {{.time = 0, .position = {}, .target = {}, .vertical_fov = {}},
                             {.time = 3 / moving.fps, .position = eye, .target = target, .vertical_fov = 25}};
  still.camera.position = eye;
  still.camera.target = target;
  still.camera.vertical_fov = 25;
  io::write_obj(run_.mesh(3), small_bodies());
  render::SequenceRenderer renderer(moving, small_manifest());
  renderer.render_frame(run_, 3);
  renderer.render_frame(run_, 0);  // The renderer goes back to an earlier frame.
  const std::vector<unsigned char> at_start =
      render::SequenceRenderer(small_scene(), small_manifest()).draw(small_bodies());
  const std::vector<unsigned char> at_end =
      render::SequenceRenderer(still, small_manifest()).draw(small_bodies());
  render::write_png((run_.root / "start.png").string(), 320, 180, at_start);
  render::write_png((run_.root / "end.png").string(), 320, 180, at_end);
  EXPECT_EQ(bytes_of(run_.image(0)), bytes_of(run_.root / "start.png"));
  EXPECT_EQ(bytes_of(run_.image(3)), bytes_of(run_.root / "end.png"));
  EXPECT_NE(bytes_of(run_.image(0)), bytes_of(run_.image(3)));
}

TEST_F(Sequence, AMissingMeshIsNamed) {
  const std::string message = failure(small_manifest(), 7);
  EXPECT_TRUE(contains(message, "0007.obj")) << message;
  EXPECT_FALSE(fs::exists(run_.image(7)));
}

TEST_F(Sequence, AMeshOfAnotherRunIsRefused) {
  io::Manifest manifest = small_manifest();
  manifest.bodies[1].triangles += 1;
  const std::string wrong_size = failure(manifest, 0);
  EXPECT_TRUE(contains(wrong_size, "body `orange` has 8 vertices and 12 triangles")) << wrong_size;
  EXPECT_TRUE(contains(wrong_size, "0000.obj")) << wrong_size;
  EXPECT_TRUE(contains(wrong_size, "--out")) << wrong_size;

  manifest = small_manifest();
  std::swap(manifest.bodies[1], manifest.bodies[2]);
  EXPECT_TRUE(contains(failure(manifest, 0), "called `orange`"));

  manifest = small_manifest();
  manifest.bodies.pop_back();
  EXPECT_TRUE(contains(failure(manifest, 0), "holds 3 bodies, the manifest 2"));
}

TEST_F(Sequence, AnImageFolderThatCannotBeMadeIsNamed) {
  std::ofstream(run_.root / "image") << "a file where the folder should be";
  const std::string message = failure(small_manifest(), 0);
  EXPECT_TRUE(contains(message, "image")) << message;
  EXPECT_NE(message, "no failure");
}

}  // namespace
}  // namespace duet::image_tests::sequence_test
