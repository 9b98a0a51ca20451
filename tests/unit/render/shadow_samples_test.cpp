#include "render/shadow_samples.h"

#include <numbers>

#include <gtest/gtest.h>

namespace duet::render::shadow_samples_test {
namespace {

scene::Scene lit_scene(int samples) {
  scene::Scene scene;
  scene.lights = {{.name = "lamp", .position = {0, 20, 0}, .target = {0, 0, 0}, .radius = 3, .power = 5000},
                  {.name = "spark", .kind = scene::LightKind::point, .position = {5, 5, 5}, .power = 100}};
  scene.sky = {.zenith = {1, 1, 1}, .horizon = {1, 1, 1}, .intensity = 0.5};
  scene.render.shadow_samples = samples;
  return scene;
}

// The area light and the sky share the samples: with both, the sky gets five eighths. A light without area
// takes none.
TEST(ShadowSamples, AreSharedBetweenLightsAndSky) {
  const ShadowSampleSet set = make_shadow_samples(lit_scene(64));
  EXPECT_EQ(set.samples.size(), 64u);
  EXPECT_EQ(set.lights, 24);

  scene::Scene dark = lit_scene(64);
  dark.sky.intensity = 0;
  EXPECT_EQ(make_shadow_samples(dark).lights, 64);

  scene::Scene overcast = lit_scene(64);
  overcast.lights.erase(overcast.lights.begin());  // The point light casts no shadow.
  EXPECT_EQ(make_shadow_samples(overcast).lights, 0);
}

// The weights of the samples of a light add up to its whole radiant intensity, power / (4 pi).
TEST(ShadowSamples, CarryTheWholeLight) {
  const ShadowSampleSet set = make_shadow_samples(lit_scene(64));
  double light = 0, irradiance = 0;
  for (const ShadowSample& sample : set.samples) {
    if (sample.is_sky) {
      EXPECT_NEAR(sample.place.norm(), 1, 1e-12);
      irradiance += sample.weight * sample.place.y();
    } else {
      EXPECT_NEAR(sample.place.y(), 20, 1e-9);  // The disc faces straight down.
      EXPECT_LE((sample.place - Vec3(0, 20, 0)).norm(), 3);
      light += sample.weight;
    }
  }
  EXPECT_NEAR(light, 5000 / (4 * std::numbers::pi), 1e-9);
  // A white sky of radiance L = 0.5 gives the irradiance pi L on level ground. Midpoints in height integrate
  // a linear function exactly.
  EXPECT_NEAR(irradiance, 0.5 * std::numbers::pi, 1e-9);
}

TEST(ShadowSamples, TheFrustumHoldsItsCastersTightly) {
  const std::vector<Box> casters = {{{-1, 0, -1}, {1, 2, 1}}, {{3, 1, -2}, {4, 5, 0}}};
  for (const ShadowSample& sample :
       {ShadowSample{false, {2, 30, -1}, 1}, ShadowSample{true, Vec3(0.6, 0.8, 0), 1}}) {
    const ShadowFrustum frustum = fit_shadow_frustum(sample, casters, 512);
    Vec3 low = Vec3::Ones(), high = Vec3::Zero();
    for (const Box& b : casters)
      for (const Vec3& corner : b.corners()) {
        const Vec3 m = (frustum.to_map * corner.homogeneous()).hnormalized();
        low = low.cwiseMin(m);
        high = high.cwiseMax(m);
      }
    EXPECT_GE(low.minCoeff(), 0);
    EXPECT_LE(high.maxCoeff(), 1);
    EXPECT_LT(low.head<2>().maxCoeff(), 4.0 / 512);  // a margin of two texels, and no more
    EXPECT_GT(high.head<2>().minCoeff(), 1 - 4.0 / 512);
  }
}

TEST(ShadowSamples, BodiesWhoseShadowFallsOutOfViewAreLeftOut) {
  const View view = make_view({.position = {0, 2, 10}, .target = {0, 0, 0}, .vertical_fov = 30}, 160, 90);
  const ShadowSample from_right = {true, Vec3(1, 1, 0).normalized(), 1};
  const Box far_right = {{30, 30, -1}, {31, 31, 1}};  // Its shadow lands near the origin.
  const Box far_left = {{-31, 0, -1}, {-30, 1, 1}};   // Its shadow falls farther to the left.
  EXPECT_TRUE(shadow_is_seen(from_right, far_right, view, 100, 0));
  EXPECT_FALSE(shadow_is_seen(from_right, far_left, view, 100, 0));
}

}  // namespace
}  // namespace duet::render::shadow_samples_test
