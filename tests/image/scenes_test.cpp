// A short variant of every figure's scene: its picture is that of tests/image/references, and the physics of
// its frames is sound. Variants are listed in tools/figures.toml; `tools/update-references` renews the
// pictures.
#include "tests/support/scenes.h"

#include <algorithm>
#include <cmath>

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

struct Variant {
  std::string scene;
  int frame = 0;  // the last one, which is drawn
  std::vector<std::string> set;
  fs::path reference() const { return source / "tests/image/references" / (scene + ".png"); }
  // Where the picture and its difference from the reference are left, for a person and for
  // tools/update-references.
  fs::path drawn(const std::string& what = {}) const {
    return fs::path(test::duet_program()).parent_path() / "image_tests" / (scene + what + ".png");
  }
};

void PrintTo(const Variant& variant, std::ostream* out) {
  *out << variant.scene;
}  // GoogleTest asks for this name

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

struct Bounding {
  Vec3 low = Vec3::Constant(1e30), high = Vec3::Constant(-1e30);  // m
  void extend(const Surface& surface) {
    for (const Vec3& x : surface.positions) {
      low = low.cwiseMin(x);
      high = high.cwiseMax(x);
    }
  }
  // The middle one of its sides: of a ring its width, of cloth one of its edges.
  double size() const {
    std::array<double, 3> sides = {high.x() - low.x(), high.y() - low.y(), high.z() - low.z()};
    std::sort(sides.begin(), sides.end());
    return sides[1];
  }
};

// A simulated variant with what its checks look at.
class Film {
 public:
  // `more_gravity`: relative.
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

  // No overlap deeper than 2 % of the smallest body, nothing inside out, all bodies about where they were.
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
  std::vector<std::uint64_t> hashes;  // of frame 0 and all that followed

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
  double smallest_ = 1e30;  // m, of the dynamic bodies
  double penetration_ = 0;  // m
  int inverted_ = 0;        // tets
};

// The same picture within the bounds; what is found is left beside the program.
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

// The largest dynamic body: it surely is to be seen.
std::size_t largest_body(const Film& film) {
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

bool passes(const Variant& variant, const render::Picture& picture) {
  return render::broken_bounds(render::compare(picture, render::read_picture(variant.reference())), {})
      .empty();
}

// Shows that the comparison can fail: for a body that is moved by a twentieth of its size, for one of a
// colour darker by a tenth, for lights that throw no shadows.
void expect_changes_to_fail(const Variant& variant, const Film& film) {
  const std::size_t body = largest_body(film);
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

// What tools/figures draws exists: frames within the scene's, further views whose changes the scene accepts.
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

TEST_P(Scenes, AreTheSameOnOneThread) {
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

// Another processor rounds otherwise, which every blow makes more of. A millionth of a millionth of gravity
// is a thousand times that: the variants end before it shows.
TEST_P(Scenes, DoNotHangOnRounding) {
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
