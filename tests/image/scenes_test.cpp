// Tests of a short variant of every figure's scene: its picture equals the one in tests/image/references
// within bounds, and the physics of its frames is sound. The variants are listed in tools/figures.toml.
// `tools/update-references` renews the pictures.
#include "tests/support/scenes.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/places.h"
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <toml++/toml.h>

#include "render/compare.h"
#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/parallel.h"
#include "sim/io/run_directory.h"
#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::image_tests::scenes_test {
namespace {
namespace fs = std::filesystem;

const fs::path source = test::source_folder();

// A scene with the settings and the frame of its short variant.
struct Variant {
  std::string scene;
  int frame = 0;  // the last frame, which is drawn
  std::vector<std::string> set;
  fs::path reference() const { return source / "tests/image/references" / (scene + ".png"); }
  // Returns the file to which the test writes the picture, or with `what` its difference from the reference.
  // A person and tools/update-references look at it.
  fs::path drawn(const std::string& what = {}) const {
    return fs::path(test::duet_program()).parent_path() / "image_tests" / (scene + what + ".png");
  }
};

void PrintTo(const Variant& variant, std::ostream* out) {
  *out << variant.scene;
}  // GoogleTest requires this name.

std::vector<std::string> texts(const toml::node_view<toml::node>& array) {
  std::vector<std::string> result;
  for (const toml::node& text : *array.as_array()) result.push_back(text.value<std::string>().value());
  return result;
}

std::vector<Variant> variants() {
  toml::table file = toml::parse_file((source / "tools/figures.toml").string());
  const std::vector<std::string> common = texts(file["short"]["set"]);
  std::vector<Variant> result;
  for (const auto& [name, figure] : file) {
    const toml::node_view variant = file[name.str()]["short"];
    if (!variant) continue;
    result.push_back({std::string(name.str()), variant["frame"].value<int>().value(), common});
    for (const std::string& text : texts(variant["set"])) result.back().set.push_back(text);
  }
  return result;
}

// The axis-aligned bounding box of some surfaces.
struct Bounding {
  Vec3 low = Vec3::Constant(1e30), high = Vec3::Constant(-1e30);  // m
  void extend(const Surface& surface) {
    for (const Vec3& x : surface.positions) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  }
  // Returns the middle one of the lengths of the sides, in m: for a ring its width, and for cloth one of its
  // edges.
  double size() const {
    std::array<double, 3> sides = {high.x() - low.x(), high.y() - low.y(), high.z() - low.z()};
    std::sort(sides.begin(), sides.end());
    return sides[1];
  }
};

// A simulated variant, with the quantities that its checks need.
class Film {
 public:
  // `more_gravity` is a relative change of gravity.
  explicit Film(const Variant& variant, double more_gravity = 0)
      : scene(read(variant, more_gravity)), simulation_(scene, test::plan(scene)) {
    simulation_.surfaces(surfaces);
    manifest.bodies = io::manifest_bodies(scene, surfaces);
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
      start_.extend(surfaces[i].surface);
      if (!is_dynamic(i)) continue;
      Bounding body;
      body.extend(surfaces[i].surface);
      smallest_ = std::min(smallest_, body.size());
    }
    note_frame();
  }

  void advance_to(int frame) {
    while (simulation_.frame() < frame) {
      simulation_.advance_frame();
      note_frame();
    }
    simulation_.surfaces(surfaces);
  }

  // Checks that no overlap is deeper than 2 % of the smallest body, that no element is inverted, and that all
  // bodies are within the size of the scene from where they were.
  void check_physics() const {
    test::expect_below(penetration_, 0.02 * smallest_, "penetration_m");
    EXPECT_EQ(inverted_, 0);
    Bounding now;
    for (std::size_t i = 0; i < surfaces.size(); ++i) {
      if (is_dynamic(i)) now.extend(surfaces[i].surface);
      for (const Vec3& x : surfaces[i].surface.positions) ASSERT_TRUE(x.allFinite()) << surfaces[i].name;
    }
    const double reach = (start_.high - start_.low).norm();
    EXPECT_TRUE((now.low.array() > start_.low.array() - reach).all()) << now.low.transpose();
    EXPECT_TRUE((now.high.array() < start_.high.array() + reach).all()) << now.high.transpose();
    if (scene.ground)
      test::expect_above(now.low.y(), scene.ground->height - 0.02 * smallest_, "lowest_point_m");
  }

  render::Picture draw() const { return draw(scene, surfaces); }
  render::Picture draw(const scene::Scene& changed, const std::vector<BodySurface>& bodies) const {
    return {scene.render.width, scene.render.height,
            render::SequenceRenderer(changed, manifest).draw(bodies)};
  }
  bool is_dynamic(std::size_t body) const {
    return manifest.bodies[body].kind == "rigid" || manifest.bodies[body].kind == "deformable";
  }

  const scene::Scene scene;
  io::Manifest manifest;
  std::vector<BodySurface> surfaces;
  std::vector<std::uint64_t> hashes;  // of frame 0 and all frames that followed

 private:
  static scene::Scene read(const Variant& variant, double more_gravity) {
    scene::Scene scene =
        scene::read((source / "scenes" / (variant.scene + ".toml")).string(), variant.set).scene;
    scene.gravity *= 1 + more_gravity;
    return scene;
  }
  void note_frame() {
    const FrameStats stats = simulation_.stats();
    hashes.push_back(stats.hash);
    penetration_ = std::max(penetration_, stats.max_penetration);
    inverted_ = std::max(inverted_, stats.inverted);
  }

  Simulation simulation_;
  Bounding start_;
  double smallest_ = 1e30;  // m, of the smallest dynamic body
  double penetration_ = 0;  // m, largest of all frames
  int inverted_ = 0;        // tetrahedra, most of all frames
};

// Checks that the picture equals the reference within the bounds, and leaves the picture and a difference
// that is found beside the program.
void expect_reference(const Variant& variant, const render::Picture& picture) {
  io::create_folder(variant.drawn().parent_path());
  io::remove_file(variant.drawn("-difference"));
  render::write_png(variant.drawn().string(), picture.width, picture.height, picture.rgb);
  ASSERT_TRUE(fs::exists(variant.reference()))
      << variant.reference() << " is missing: look at " << variant.drawn()
      << ", then `tools/update-references " << variant.scene << "`";
  const render::Picture reference = render::read_picture(variant.reference());
  const render::Difference difference = render::compare(picture, reference);
  test::record_margin("RMSE", difference.rmse, fmt::format("at most {}", render::DifferenceBounds().rmse));
  const std::string broken = render::broken_bounds(difference, {});
  if (broken.empty()) return;
  render::write_png(variant.drawn("-difference").string(), picture.width, picture.height,
                    render::difference_picture(picture, reference).rgb);
  ADD_FAILURE() << variant.drawn() << " differs from " << variant.reference() << ": " << broken << "; see "
                << variant.drawn("-difference") << "; if the change is meant: `tools/update-references "
                << variant.scene << "`";
}

// Returns the largest dynamic body, which is surely in view.
std::size_t max_body(const Film& film) {
  std::size_t largest = 0;
  double most = -1;
  for (std::size_t i = 0; i < film.surfaces.size(); ++i) {
    Bounding box;
    box.extend(film.surfaces[i].surface);
    if (film.is_dynamic(i) && box.size() > most) {
      most = box.size();
      largest = i;
    }
  }
  return largest;
}

// Returns whether the picture equals the reference of the variant within the bounds.
bool passes(const Variant& variant, const render::Picture& picture) {
  return render::broken_bounds(render::compare(picture, render::read_picture(variant.reference())), {})
      .empty();
}

// Checks that the comparison can fail: for a body that is moved by a twentieth of its size, for one with a
// color that is a tenth darker, and for lights without shadows.
void expect_changes_to_fail(const Variant& variant, const Film& film) {
  const std::size_t body = max_body(film);
  std::vector<BodySurface> moved = film.surfaces;
  Bounding box;
  box.extend(moved[body].surface);
  for (Vec3& x : moved[body].surface.positions) x.array() += 0.05 * box.size();
  EXPECT_FALSE(passes(variant, film.draw(film.scene, moved))) << film.surfaces[body].name << " is moved";

  scene::Scene darker = film.scene;
  for (scene::Look& look : darker.looks)
    if (look.name == film.manifest.bodies[body].look) look.color *= 0.9;
  EXPECT_FALSE(passes(variant, film.draw(darker, film.surfaces))) << film.surfaces[body].name << " is darker";

  scene::Scene unshadowed = film.scene;
  for (scene::Light& light : unshadowed.lights) light.shadow = false;
  EXPECT_FALSE(passes(variant, film.draw(unshadowed, film.surfaces))) << "no shadows";
}

// Everything that tools/figures draws exists: its frames are within those of the scenes, and the scenes
// accept the changes of its views.
TEST(Figures, AreOfFramesAndViewsThatTheScenesHave) {
  toml::table file = toml::parse_file((source / "tools/figures.toml").string());
  for (const Variant& variant : variants()) {
    const std::string path = (source / "scenes" / (variant.scene + ".toml")).string();
    const scene::Scene scene = scene::read(path, {}, scene::Meshes::leave).scene;
    const toml::node_view figure = file[variant.scene];
    EXPECT_EQ(figure["figure"].value<std::string>(), scene.figure) << variant.scene;
    const auto check_frames = [&](const toml::node_view<toml::node>& frames) {
      for (const toml::node& frame : *frames.as_array())
        EXPECT_LE(frame.value<int>().value(), scene.frames) << variant.scene;
    };
    check_frames(figure["frames"]);
    if (!figure["views"]) continue;
    for (toml::node& view : *figure["views"].as_array()) {
      toml::table& table = *view.as_table();
      check_frames(toml::node_view(table["frames"]));
      EXPECT_NO_THROW(scene::read(path, texts(toml::node_view(table["set"])), scene::Meshes::leave))
          << variant.scene;
    }
  }
}

class Scenes : public testing::TestWithParam<Variant> {
 protected:
  ~Scenes() override { set_thread_count(0); }
};

TEST_P(Scenes, LookLikeTheirReferences) {
  set_thread_count(2);
  Film film(GetParam());
  film.advance_to(GetParam().frame);
  film.check_physics();
  const render::Picture picture = film.draw();
  expect_reference(GetParam(), picture);
  if (!HasFailure()) expect_changes_to_fail(GetParam(), film);
}

// Returns whether the scene takes long, so that its pictures are compared, and the rest belongs to long
// tests: ctest compares the hashes of its first frames on two threads with the committed ones
// (tests/CMakeLists.txt).
bool takes_long(const std::string& scene) {
  const std::set<std::string> all{"pile",  "snake", "fish",  "bowl",       "bowl_rings",
                                  "chain", "row",   "stack", "maggot_ring"};
  return all.contains(scene);
}

// The states of all frames have the same hashes on one and on two threads.
TEST_P(Scenes, AreTheSameOnOneThread) {
  if (takes_long(GetParam().scene) && !test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  const int frames = std::max(2, GetParam().frame / 4);
  std::vector<std::vector<std::uint64_t>> hashes;
  for (const int threads : {1, 2}) {
    set_thread_count(threads);
    Film film(GetParam());
    film.advance_to(frames);
    hashes.push_back(film.hashes);
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

// Another processor rounds differently, and every impact amplifies the difference. A relative change of
// gravity by 1e-12 is a thousand times as large as rounding, so that a variant whose picture survives it ends
// before rounding shows.
TEST_P(Scenes, SurviveAChangeOfGravityBy1e12) {
  if (takes_long(GetParam().scene) && !test::runs_in_full()) GTEST_SKIP() << "part of tools/test --full";
  Film film(GetParam(), 1e-12);
  film.advance_to(GetParam().frame);
  const render::Difference difference =
      render::compare(film.draw(), render::read_picture(GetParam().reference()));
  test::record_margin("RMSE", difference.rmse, fmt::format("at most {}", render::DifferenceBounds().rmse));
  EXPECT_EQ(render::broken_bounds(difference, {}), "") << "end the variant at an earlier frame";
}

INSTANTIATE_TEST_SUITE_P(Short, Scenes, testing::ValuesIn(variants()),
                         [](const auto& variant) { return variant.param.scene; });

}  // namespace
}  // namespace duet::image_tests::scenes_test
