#include "render/shadow_samples.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/base/assert.h"

namespace duet::render {
namespace {

const double golden_angle = std::numbers::pi * (3 - std::sqrt(5.0));

double luminance(const Vec3& color) { return color.dot(Vec3(0.2126, 0.7152, 0.0722)); }

bool casts_shadow(const scene::Light& light) {
  return light.kind == scene::LightKind::area && light.shadow && light.power > 0;
}

// Appends `count` points of the light's disc on a sunflower spiral, so that all points stand for equal areas.
void sample_disc(const scene::Light& light, int count, std::vector<ShadowSample>& samples) {
  const Vec3 axis = (light.target - light.position).normalized();
  const Vec3 u = axis.unitOrthogonal(), v = axis.cross(u);
  for (int i = 0; i < count; ++i) {
    const double radius = light.radius * std::sqrt((i + 0.5) / count), angle = i * golden_angle;
    samples.push_back({.is_sky = false,
                       .place = light.position + radius * (std::cos(angle) * u + std::sin(angle) * v),
                       .weight = luminance(light.color) * light.power / (4 * std::numbers::pi * count)});
  }
}

// Appends `count` directions of the sky on a spiral over the upper half of the sphere, so that all directions
// stand for equal solid angles.
void sample_sky(const scene::Sky& sky, int count, std::vector<ShadowSample>& samples) {
  for (int i = 0; i < count; ++i) {
    const double height = (i + 0.5) / count, radius = std::sqrt(1 - height * height),
                 angle = i * golden_angle;
    const Vec3 radiance = sky.zenith + std::pow(1 - height, 4) * (sky.horizon - sky.zenith);
    samples.push_back({.is_sky = true,
                       .place = Vec3(radius * std::cos(angle), height, radius * std::sin(angle)),
                       .weight = sky.intensity * luminance(radiance) * 2 * std::numbers::pi / count});
  }
}

// Unit direction from the sample to a point: the direction of its shadow.
Vec3 direction_away(const ShadowSample& sample, const Vec3& point) {
  return sample.is_sky ? -sample.place : (point - sample.place).normalized();
}

// Limits of a light's map: the smallest distance along its axis as a fraction of the largest one, and the
// steepest slope to the axis. They keep the projection bounded when a body reaches beside or behind the
// light. A larger fraction cuts off nearer casters; steeper slopes leave fewer texels for the others.
constexpr double nearest_fraction = 0.01, steepest_slope = 4;

}  // namespace

std::array<Vec3, 8> Box::corners() const {
  std::array<Vec3, 8> points;
  for (unsigned i = 0; i < 8; ++i)
    points[i] = {i & 1 ? high.x() : low.x(), i & 2 ? high.y() : low.y(), i & 4 ? high.z() : low.z()};
  return points;
}

ShadowSampleSet make_shadow_samples(const scene::Scene& scene) {
  std::vector<const scene::Light*> casting;
  for (const scene::Light& light : scene.lights)
    if (casts_shadow(light)) casting.push_back(&light);
  const int total = scene.render.shadow_samples, lights = static_cast<int>(casting.size());
  const bool sky = scene.sky.intensity > 0;

  // The sky is the widest light and gets the larger fraction, five eighths.
  int for_lights = lights == 0 ? 0 : (sky ? (3 * total + 4) / 8 : total);
  ShadowSampleSet set;
  for (int i = 0; i < lights; ++i) {
    const int count = for_lights * (i + 1) / lights - for_lights * i / lights;
    sample_disc(*casting[static_cast<std::size_t>(i)], count, set.samples);
  }
  set.lights = static_cast<int>(set.samples.size());
  if (sky) sample_sky(scene.sky, total - set.lights, set.samples);
  return set;
}

bool shadow_is_seen(const ShadowSample& sample, const Box& bounds, const View& view, double reach,
                    std::optional<double> ground) {
  std::array<Vec3, 16> hull;  // corners of the body's box, then the ends of their shadows
  const std::array<Vec3, 8> corners = bounds.corners();
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Vec3 away = direction_away(sample, corners[i]);
    double length = reach;
    if (ground && away.y() < 0) length = std::clamp((*ground - corners[i].y()) / away.y(), 0.0, reach);
    hull[i] = corners[i];
    hull[i + 8] = corners[i] + length * away;
  }
  for (const Vec3& inward : view.inward_normals())
    if (std::all_of(hull.begin(), hull.end(), [&](const Vec3& x) { return inward.dot(x - view.eye) < 0; }))
      return false;
  return true;
}

ShadowFrustum fit_shadow_frustum(const ShadowSample& sample, const std::vector<Box>& casters, int side) {
  DUET_ASSERT(!casters.empty() && side > 0);
  Box all = casters.front();
  for (const Box& b : casters) {
    all.low = all.low.cwiseMin(b.low);
    all.high = all.high.cwiseMax(b.high);
  }
  const Vec3 origin = sample.is_sky ? Vec3(0.5 * (all.low + all.high)) : sample.place;
  const Vec3 forward = direction_away(sample, 0.5 * (all.low + all.high));
  const Vec3 right = forward.unitOrthogonal(), up = right.cross(forward);

  std::vector<Vec3> points;
  for (const Box& b : casters)
    for (const Vec3& corner : b.corners()) {
      const Vec3 d = corner - origin;
      points.emplace_back(right.dot(d), up.dot(d), forward.dot(d));
    }
  double far = points.front().z();
  for (const Vec3& p : points) far = std::max(far, p.z());
  if (!sample.is_sky)
    for (Vec3& p : points) {
      p.z() = std::max(p.z(), nearest_fraction * far);
      p.head<2>() = (p.head<2>() / p.z()).cwiseMax(-steepest_slope).cwiseMin(steepest_slope);
    }
  Vec3 low = points.front(), high = points.front();
  for (const Vec3& p : points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3 margin = 2 * (high - low) / side + Vec3(1e-6, 1e-6, 1e-3 * (high.z() - low.z()) + 1e-6);
  low -= margin;
  high += margin;
  if (!sample.is_sky) low.z() = std::max(low.z(), 0.5 * nearest_fraction * far);

  Mat4 to_light = Mat4::Identity();
  to_light.block<1, 3>(0, 0) = right.transpose();
  to_light.block<1, 3>(1, 0) = up.transpose();
  to_light.block<1, 3>(2, 0) = forward.transpose();
  to_light.block<3, 1>(0, 3) = -(to_light.block<3, 3>(0, 0) * origin);
  const Mat4 clip = sample.is_sky ? clip_parallel(low, high)
                                  : clip_perspective(low.head<2>(), high.head<2>(), low.z(), high.z());
  Mat4 to_unit = 0.5 * Mat4::Identity();  // [-1, 1]^3 to [0, 1]^3
  to_unit.block<3, 1>(0, 3).setConstant(0.5);
  to_unit(3, 3) = 1;
  return {to_unit * clip * to_light, (high - low).head<2>().maxCoeff() / side};
}

}  // namespace duet::render
