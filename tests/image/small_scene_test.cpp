// Tests of what must hold for any picture of the small scene: bodies are where the camera formula puts them,
// shadows are on the side away from the light, edges are smooth, and every drawing gives the same bits. The
// tests also show that most of their predicates fail when they should.
#include "tests/image/small_scene.h"

#include "tests/support/osmesa.h"
#include <gtest/gtest.h>

#include "render/compare.h"
#include "sim/base/error.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet::image_tests::small_scene_test {
namespace {

TEST(SmallScene, EveryBodyIsWhereTheCameraFormulaPutsIt) {
  const scene::Scene scene = small_scene();
  const Picture picture = draw(scene);
  EXPECT_TRUE(is_orange(pixel_of(picture, scene, orange_center)));
  EXPECT_TRUE(is_green(pixel_of(picture, scene, green_center)));
  EXPECT_TRUE(is_gray(pixel_of(picture, scene, ball_center)));
}

TEST(SmallScene, ColorsFollowTheLooks) {
  const scene::Scene scene = small_scene();
  io::Manifest swapped = small_manifest();
  std::swap(swapped.bodies[1].look, swapped.bodies[2].look);
  const Picture picture = draw(scene, swapped);
  EXPECT_FALSE(is_orange(pixel_of(picture, scene, orange_center)));
  EXPECT_TRUE(is_green(pixel_of(picture, scene, orange_center)));
}

TEST(SmallScene, BackgroundWhereNothingProjects) {
  const scene::Scene scene = small_scene();
  std::vector<BodySurface> away = small_bodies();
  for (BodySurface& body : away)
    for (Vec3& x : body.surface.positions) x.z() += 100;  // behind the camera
  const Picture full = draw(scene), empty = draw(scene, small_manifest(), away);
  for (const int x : {0, 100, 319}) {
    EXPECT_TRUE(is_gray(full.at(x, 0)));
    EXPECT_EQ(luminance(full.at(x, 0)), luminance(empty.at(x, 0)));
  }
  EXPECT_NE(luminance(pixel_of(full, scene, orange_center)),
            luminance(pixel_of(empty, scene, orange_center)));
}

// The light comes from the right, so that the ground just left of the orange box is in shadow.
TEST(SmallScene, TheGroundIsDarkerOnTheShadowSide) {
  scene::Scene scene = small_scene();
  const Vec3 left(-1.5, 0, 0.2), front(0, 0, 3.6);
  const Picture shadowed = draw(scene);
  EXPECT_LT(luminance(pixel_of(shadowed, scene, left)), 0.6 * luminance(pixel_of(shadowed, scene, front)));

  scene.lights[0].shadow = false;
  const Picture unshadowed = draw(scene);
  EXPECT_GT(luminance(pixel_of(unshadowed, scene, left)),
            0.6 * luminance(pixel_of(unshadowed, scene, front)));
}

// The foot of a wall is darker, because the wall hides nearly half of the sky from it, even without a lamp.
TEST(SmallScene, TheSkyThrowsSoftShadowsAtContacts) {
  scene::Scene scene = small_scene();
  scene.lights.clear();
  scene.looks[0].roughness = 1;
  scene.render.exposure = 3;  // for finer steps of the bytes
  scene.render.shadow_samples = 128;
  scene.sky = {.zenith = {0.5, 0.5, 0.5}, .horizon = {0.5, 0.5, 0.5}, .intensity = 1};
  io::Manifest manifest = small_manifest();
  manifest.bodies = {manifest.bodies[1]};
  const std::vector<BodySurface> wall = {
      placed("orange", shape_surface(LevelSet::box(Vec3(16, 4, 2))), {{0, 2, 0}, Quat::Identity()})};
  const Picture with = draw(scene, manifest, wall);
  scene.render.shadow_samples = 0;
  const Picture without = draw(scene, manifest, wall);
  const auto share = [&](const Vec3& point) {
    return luminance(pixel_of(with, scene, point)) / luminance(pixel_of(without, scene, point));
  };
  // A long wall, seen from the ground up to the angle a, hides the fraction (1 - cos a) / 2 of a uniform sky.
  // Sampling in 128 directions is accurate to a few hundredths. The sheen of the ground, a twentieth of its
  // light, is shaded less. Together they give the bound of 0.08.
  EXPECT_NEAR(share({0.2, 0, 1.15}), 1 - 0.5 * (1 - std::cos(std::atan(4 / 0.15))), 0.08);
  EXPECT_NEAR(share({0.2, 0, 3.6}), 1 - 0.5 * (1 - std::cos(std::atan(4 / 2.6))), 0.08);
}

// Irradiance falls with the square of the distance: E = P / (4 pi d^2).
TEST(SmallScene, LightFallsWithTheSquareOfTheDistance) {
  scene::Scene scene = small_scene();
  scene.ground.reset();
  scene.sky = {.zenith = Vec3::Zero(), .horizon = Vec3::Zero(), .intensity = 0};
  scene.camera = {.position = {0, 10, 0}, .target = {0, 1, 0}, .up = {0, 0, -1}, .vertical_fov = 20};
  scene.looks[1].roughness = 1;
  scene.lights = {{.name = "lamp", .kind = scene::LightKind::point, .position = {0, 12, 0}, .power = 400}};
  io::Manifest manifest = small_manifest();
  manifest.bodies = {manifest.bodies[1]};
  const std::vector<BodySurface> box = {
      placed("orange", shape_surface(LevelSet::box(Vec3(2, 2, 2))), {{0, 1, 0}, Quat::Identity()})};
  const double near = linear(pixel_of(draw(scene, manifest, box), scene, {0, 2, 0}).r);
  scene.lights[0].position.y() = 22;  // twice as far from the top face
  const double far = linear(pixel_of(draw(scene, manifest, box), scene, {0, 2, 0}).r);
  EXPECT_NEAR(near / far, 4, 0.12);  // A step of the darker byte is 2.5 %.
  // E = 400 / (4 pi 10^2) = 0.318 on a matte surface of color 0.9 gives the radiance 0.9 E / pi. The surface
  // reflects 4 % of the light at once, which come back as a highlight.
  EXPECT_NEAR(near, 0.318 * 0.9 / 3.1416, 0.006);
}

// A matte surface has the same radiance in all directions: under a lamp as far as the sun, the floor is as
// bright at a grazing view as from above.
TEST(SmallScene, AChalkFloorIsAsBrightAtAGrazingView) {
  scene::Scene scene = small_scene();
  scene.sky = {.zenith = Vec3::Zero(), .horizon = Vec3::Zero(), .intensity = 0};
  scene.looks[0].roughness = 1;
  scene.looks[0].pattern = "checker";  // of one color
  scene.looks[0].color2 = scene.looks[0].color;
  const double height = 1e4, irradiance = 2;
  scene.lights = {{.name = "lamp",
                   .kind = scene::LightKind::point,
                   .position = {0, height, 0},
                   .power = irradiance * 4 * 3.14159265 * height * height}};
  for (const Vec3& eye : {Vec3(0, 12, 1), Vec3(0, 1.2, 12)}) {  // 85 and 6 degrees above the floor
    scene.camera.target = {6, 0, 0};                            // beside the bodies
    scene.camera.position = scene.camera.target + eye;
    // The bound of 5 % is for 4 % of the light that the surface reflects at once, which come back as a
    // highlight from above, and for the fade to the black horizon, which takes 1 - exp(-1/64) at the camera's
    // target.
    EXPECT_NEAR(luminance(pixel_of(draw(scene), scene, scene.camera.target)), 0.5 * irradiance / 3.14159,
                0.05 * 0.5 * irradiance / 3.14159)
        << eye.transpose();
  }
}

// Returns the number of pixels on outlines whose blue is clearly between that of the bright side on the left
// and that of the dark side on the right.
int intermediate_pixels(const Picture& picture) {
  int count = 0;
  for (int y = 0; y < picture.height; ++y)
    for (int x = 2; x + 2 < picture.width; ++x) {
      const int left = picture.at(x - 2, y).b, right = picture.at(x + 2, y).b, here = picture.at(x, y).b;
      if (left - right > 90 && here < left - 25 && here > right + 25) ++count;
    }
  return count;
}

TEST(SmallScene, SupersamplingSmoothsTheEdges) {
  scene::Scene scene = small_scene();
  scene.ground.reset();
  scene.lights.clear();
  scene.sky.horizon = scene.sky.zenith = Vec3(0.6, 0.6, 0.6);
  io::Manifest manifest = small_manifest();
  manifest.bodies[0].look = "orange";  // The blue of this look is far below that of the sky,
  scene.looks[1].roughness = 1;        // and a rough surface keeps it so toward the outline.
  manifest.bodies.resize(1);
  std::vector<BodySurface> ball = small_bodies();
  ball.resize(1);
  const Picture smooth = draw(scene, manifest, ball);
  scene.render.supersampling = 1;
  const Picture jagged = draw(scene, manifest, ball);
  EXPECT_GT(intermediate_pixels(smooth), 20);  // The outline crosses about 35 rows.
  EXPECT_LT(intermediate_pixels(jagged), 3);
}

TEST(SmallScene, PatternsShowOnBodies) {
  scene::Scene scene = small_scene();
  const Picture plain = draw(scene);
  scene.looks[1].pattern = "stripes";
  scene.looks[1].color2 = {0.05, 0.1, 0.8};
  scene.looks[1].pattern_size = 0.5;
  const Picture striped = draw(scene);
  int orange = 0, other = 0;
  const render::View view = render::make_view(scene.camera, striped.width, striped.height);
  const Vec2 center = view.to_pixel(orange_center, striped.width, striped.height);
  for (int x = -20; x <= 20; ++x) {
    const Pixel p = striped.at(static_cast<int>(center.x()) + x, static_cast<int>(center.y()));
    (is_orange(p) ? orange : other) += 1;
    EXPECT_TRUE(is_orange(plain.at(static_cast<int>(center.x()) + x, static_cast<int>(center.y()))));
  }
  EXPECT_GT(orange, 8);
  EXPECT_GT(other, 8);
}

// The front of a silver box is a mirror in the plane z = 0. The orange box in front of it appears again
// behind that plane.
TEST(SmallScene, MetalShowsTheMirrorImageOfABody) {
  scene::Scene scene = small_scene();
  scene.camera.position = {0, 2, 12};
  const Vec3 before(2.2, 1, 4),
      image(1.7, 1, -3);  // This point is on the mirror image of the far side of the orange box.
  io::Manifest manifest = small_manifest();
  manifest.bodies.erase(manifest.bodies.begin());
  manifest.bodies[1].look = "silver";
  const std::vector<BodySurface> bodies = {
      placed("orange", shape_surface(LevelSet::box(Vec3(2, 2, 2))), {before, Quat::Identity()}),
      placed("green", shape_surface(LevelSet::box(Vec3(6, 6, 6))), {{0, 3, -3}, Quat::Identity()})};
  EXPECT_TRUE(is_orange(pixel_of(draw(scene, manifest, bodies), scene, image)));
  scene.looks[3].metallic = 0;
  EXPECT_FALSE(is_orange(pixel_of(draw(scene, manifest, bodies), scene, image)));
}

// In front of a bare sky, half of the light comes from a body of opacity 0.5 and half from behind it.
TEST(SmallScene, ABodyThatIsNotSolidLetsTheBackgroundThrough) {
  scene::Scene scene = small_scene();
  scene.ground.reset();
  scene.lights.clear();
  scene.sky = {.zenith = {0.2, 0.3, 0.6}, .horizon = {0.2, 0.3, 0.6}, .intensity = 1};
  const auto red = [&](double opacity) {
    scene.looks[1].opacity = opacity;
    return linear(pixel_of(draw(scene), scene, orange_center).r);
  };
  const double solid = red(1), none = red(0), half = red(0.5);
  EXPECT_NEAR(none, 0.2, 0.005);
  EXPECT_LT(solid, none - 0.05);
  EXPECT_NEAR(half, 0.5 * (solid + none), 0.005);  // A step of a byte is 0.004.
  EXPECT_EQ(red(0.6), half) << "2 of the 4 samples of a pixel";
}

// Texture coordinates of a deformable box are meters across its faces. A spot lies where the scene says, and
// only there.
TEST(SmallScene, SpotsShowWhereTheyLie) {
  scene::Scene scene = small_scene();
  scene.camera = {.position = {0, 1, 12}, .target = {0, 1, 0}, .vertical_fov = 30};
  scene.looks[1].color2 = {0.05, 0.1, 0.8};
  scene.looks[1].spots = {{0.5, -0.4, 0.2}};  // x, y of the front
  const TetMesh tets = box_lattice(Vec3(2, 2, 2), Vec3i(2, 2, 2), LatticePattern::five);
  io::Manifest manifest = small_manifest();
  manifest.bodies = {manifest.bodies[1]};
  const Surface surface = boundary_surface(tets, boundary(tets), 30).surface;
  manifest.bodies[0].vertices = static_cast<int>(surface.positions.size());
  manifest.bodies[0].triangles = static_cast<int>(surface.triangles.size());
  const Picture picture = draw(scene, manifest, {placed("orange", surface, {{0, 1, 0}, Quat::Identity()})});
  const auto on_front = [&](double x, double y) { return pixel_of(picture, scene, {x, 1 + y, 1}); };
  EXPECT_GT(on_front(0.5, -0.4).b, 2 * on_front(0.5, -0.4).r);
  for (const auto& [x, y] : {std::pair(0.5, -0.15), {0.5, -0.65}, {0.25, -0.4}, {0.75, -0.4}, {-0.4, 0.5}})
    EXPECT_TRUE(is_orange(on_front(x, y))) << x << ", " << y;
}

TEST(SmallScene, TwoDrawsAreIdentical) {
  const scene::Scene scene = small_scene();
  render::SequenceRenderer renderer(scene, small_manifest());
  const std::vector<unsigned char> first = renderer.draw(small_bodies());
  std::vector<BodySurface> moved = small_bodies();
  for (Vec3& x : moved[0].surface.positions) x.x() -= 0.01;  // Half a pixel, which the comparison must see.
  EXPECT_NE(renderer.draw(moved), first);
  EXPECT_EQ(renderer.draw(small_bodies()), first);
  EXPECT_EQ(draw(scene).rgb, first);  // This drawing has its own context.
}

render::Difference difference(const Picture& a, const Picture& b) {
  return render::compare({a.width, a.height, a.rgb}, {b.width, b.height, b.rgb});
}

// Ten kilometers from the origin, floats are 1 mm apart. The picture is the same there, because it is drawn
// relative to the camera and not to the origin.
TEST(SmallScene, FarFromTheOriginThePictureIsTheSame) {
  const Vec3 away(12000, 40, -8000);  // whole periods of the pattern of the ground, 4 m
  const scene::Scene scene = small_scene();
  scene::Scene moved = scene;
  moved.camera.position += away;
  moved.camera.target += away;
  moved.ground->height = away.y();
  for (scene::Light& light : moved.lights) {
    light.position += away;
    light.target += away;
  }
  std::vector<BodySurface> bodies = small_bodies();
  for (BodySurface& body : bodies)
    for (Vec3& x : body.surface.positions) x += away;
  const Picture here = draw(scene);
  const auto broken = [&] {
    return render::broken_bounds(difference(here, draw(moved, small_manifest(), bodies)), {});
  };
  EXPECT_EQ(broken(), "");
  for (Vec3& x : bodies[1].surface.positions) x.x() += 0.01;  // half a pixel
  EXPECT_NE(broken(), "");
}

// A grain seen from a centimeter and a mountain seen from 30 km look like the same scene in meters.
TEST(SmallScene, ThePictureDoesNotDependOnTheUnit) {
  scene::Scene scene = small_scene();
  scene.looks[0].pattern = "checker";  // of one color
  scene.looks[0].color2 = scene.looks[0].color;
  const Picture here = draw(scene);
  for (const double scale : {1e-3, 3e3}) {
    scene::Scene scaled = scene;
    scaled.camera.position *= scale;
    scaled.camera.target *= scale;
    for (scene::Light& light : scaled.lights) {
      light.position *= scale;
      light.target *= scale;
      light.radius *= scale;
      light.power *= scale * scale;
    }
    std::vector<BodySurface> bodies = small_bodies();
    for (BodySurface& body : bodies)
      for (Vec3& x : body.surface.positions) x *= scale;
    EXPECT_LT(difference(here, draw(scaled, small_manifest(), bodies)).rmse, 0.01) << scale;
  }
}

// EGL and OSMesa are two ways to the same rasterizer, and must give the same picture.
TEST(SmallScene, EveryLibraryOfTheSystemDrawsTheSameBits) {
  const scene::Scene scene = small_scene();
  const auto by = [&](render::Backend backend) {
    return draw(scene, small_manifest(), small_bodies(), backend);
  };
  const Picture egl = by(render::Backend::egl);
  EXPECT_TRUE(by(render::Backend::automatic) == egl);
  if (test::has_osmesa())
    EXPECT_TRUE(by(render::Backend::osmesa) == egl);
  else
    EXPECT_THROW(by(render::Backend::osmesa), FileError);
}

TEST(SmallScene, MoreThanTheRendererHoldsIsRefused) {
  scene::Scene scene = small_scene();
  scene.render.width = 9000;
  EXPECT_THROW(draw(scene), Error);
  scene = small_scene();
  scene.lights.resize(33, scene.lights[0]);
  EXPECT_THROW(draw(scene), Error);
  scene = small_scene();
  scene.render.shadow_samples = 257;
  EXPECT_THROW(draw(scene), Error);
}

}  // namespace
}  // namespace duet::image_tests::small_scene_test
