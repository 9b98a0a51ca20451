// Tests of pictures that show strain: the order of colors along the scale, and red where elements are
// inverted, from the simulation through the files of the frame to the pixels.
#include <tuple>

#include "tests/image/small_scene.h"
#include "tests/support/scenes.h"
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/io/values_file.h"
#include "sim/step/world.h"

namespace duet::image_tests::strain_test {
namespace {

bool is_red(Pixel p) { return p.r > 100 && p.r > 3 * p.g && p.r > 3 * p.b; }
bool is_blue(Pixel p) { return p.b > 1.5 * p.r && p.b > 1.2 * p.g; }
bool is_yellow(Pixel p) { return p.r > 150 && p.g > 0.7 * p.r && p.b < 0.8 * p.g; }

// The small scene with its boxes declared deformable, drawn by strain.
struct StrainedBoxes {
  scene::Scene scene = small_scene();
  io::Manifest manifest = small_manifest();
  std::vector<BodySurface> bodies = small_bodies();
  StrainedBoxes() {
    scene.render.color = scene::ColorBy::strain;
    scene.render.strain_range = 0.4;
    for (std::size_t i : {1U, 2U}) {
      manifest.bodies[i].kind = "deformable";
      set_strain(i, 0);
    }
  }
  void set_strain(std::size_t body, float strain) {
    bodies[body].surface.strain.assign(bodies[body].surface.positions.size(), strain);
  }
  Picture picture() const { return draw(scene, manifest, bodies); }
};

TEST(StrainPicture, GoesFromBlueToYellow) {
  StrainedBoxes boxes;
  boxes.set_strain(2, 0.4F);
  Picture picture = boxes.picture();
  EXPECT_TRUE(is_blue(pixel_of(picture, boxes.scene, orange_center)));
  EXPECT_TRUE(is_yellow(pixel_of(picture, boxes.scene, green_center)));
  EXPECT_TRUE(is_gray(pixel_of(picture, boxes.scene, ball_center))) << "rigid bodies keep their look";
  double before = -1;
  for (const float strain : {0.0F, 0.1F, 0.2F, 0.3F, 0.4F}) {
    boxes.set_strain(1, strain);
    const Pixel pixel = pixel_of(boxes.picture(), boxes.scene, orange_center);
    const double share = linear(pixel.r) / (linear(pixel.r) + linear(pixel.b));
    EXPECT_GT(share, before) << strain;
    before = share;
  }
  const Pixel full = pixel_of(boxes.picture(), boxes.scene, orange_center);
  boxes.set_strain(1, 5);
  const Pixel over = pixel_of(boxes.picture(), boxes.scene, orange_center);
  EXPECT_EQ(std::tie(full.r, full.g, full.b), std::tie(over.r, over.g, over.b)) << "beyond the range";
}

TEST(StrainPicture, InvertedIsRedAndOnlyThat) {
  StrainedBoxes boxes;
  boxes.set_strain(1, FiniteElements::inverted);
  boxes.set_strain(2, 0.4F);
  const Picture picture = boxes.picture();
  EXPECT_TRUE(is_red(pixel_of(picture, boxes.scene, orange_center)));
  EXPECT_FALSE(is_red(pixel_of(picture, boxes.scene, green_center)));
}

TEST(StrainPicture, HasItsScaleInTheCorner) {
  const StrainedBoxes boxes;
  const Picture picture = boxes.picture();
  const int y = picture.height - 7, side = 5;  // A field of the scale is 180 / 36 pixels wide.
  EXPECT_TRUE(is_blue(picture.at(side + 1, y)));
  EXPECT_TRUE(is_yellow(picture.at(9 * side - 2, y)));
  EXPECT_TRUE(is_red(picture.at(10 * side, y)));
}

TEST(StrainPicture, AFrameWithoutStrainIsRefused) {
  StrainedBoxes boxes;
  boxes.bodies[1].surface.strain.clear();
  try {
    boxes.picture();
    FAIL() << "accepted";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("no strain of body `orange`"), std::string::npos)
        << error.what();
  }
}

// The same scale shows stress and contact, without red, and nothing that a frame lacks.
TEST(StrainPicture, ShowsStressAndContactInTheirRange) {
  for (const scene::ColorBy color : {scene::ColorBy::stress, scene::ColorBy::contact}) {
    StrainedBoxes boxes;
    boxes.scene.render.color = color;
    boxes.scene.render.color_range = 2e4;
    EXPECT_THROW(boxes.picture(), FileError);
    for (std::size_t i : {1U, 2U})
      boxes.bodies[i].surface.shown.assign(boxes.bodies[i].surface.positions.size(), i == 1 ? 0 : 2e4F);
    const Picture picture = boxes.picture();
    EXPECT_TRUE(is_blue(pixel_of(picture, boxes.scene, orange_center)));
    EXPECT_TRUE(is_yellow(pixel_of(picture, boxes.scene, green_center)));
    EXPECT_FALSE(is_red(picture.at(50, picture.height - 7))) << "where the scale of strain is red";
  }
}

// One corner of a soft cube is pushed through the opposite face of its tetrahedron. The picture is red there
// and nowhere else.
TEST(StrainPicture, AnInvertedElementOfASimulationShowsRed) {
  scene::Scene scene = test::free_space();
  scene.camera = {.position = {4, 4, 4}, .target = {0, 0, 0}, .vertical_fov = 40};
  scene.sky.intensity = 1.5;
  scene.render = {.width = 160, .height = 160, .supersampling = 1, .shadow_samples = 8};
  scene.render.color = scene::ColorBy::strain;
  test::add_soft_box(scene, "soft", Vec3::Zero(), Vec3(2, 2, 2), 4);
  Simulation simulation(scene, test::plan(scene));
  std::vector<BodySurface> bodies;
  simulation.surfaces(bodies);
  io::Manifest manifest;
  manifest.bodies = {{"soft", "deformable", "", "", static_cast<int>(bodies[0].surface.positions.size()),
                      static_cast<int>(bodies[0].surface.triangles.size())}};
  const ScratchFolder scratch;
  const auto draw_by_file = [&] {
    simulation.surfaces(bodies);
    io::FrameValues values;
    io::measure_values(simulation, bodies, values);
    const io::RunDirectory run{scratch.path()};
    for (const io::fs::path& path : {run.mesh(0), run.values(0)}) io::create_folder(path.parent_path());
    run.write(run.mesh(0), io::obj_text(bodies));
    run.write(run.values(0), io::npy_text(values));
    std::vector<BodySurface> read = io::read_mesh(run, 0);
    io::take_strain(io::read_values(run, manifest.bodies, 0), manifest.bodies, read);
    return draw(scene, manifest, read);
  };
  const auto count_red = [](const Picture& picture) {
    int count = 0;
    for (int y = 0; y < picture.height * 3 / 4; ++y)  // only the pixels above the scale
      for (int x = 0; x < picture.width; ++x) count += is_red(picture.at(x, y)) ? 1 : 0;
    return count;
  };
  EXPECT_EQ(count_red(draw_by_file()), 0);
  for (Vec3& x : simulation.world().bodies.particles.x)
    if (x.minCoeff() > 0.9) x = Vec3::Constant(0.4);  // The only tetrahedron of the corner reaches in to 0.5.
  const Picture picture = draw_by_file();
  EXPECT_GT(count_red(picture), 30);
  EXPECT_TRUE(is_red(pixel_of(picture, scene, Vec3(0.85, 0.85, 0.7)))) << "beside the corner";
  EXPECT_TRUE(is_blue(pixel_of(picture, scene, Vec3(-0.4, 1, -0.4)))) << "far from it";
}

}  // namespace
}  // namespace duet::image_tests::strain_test
