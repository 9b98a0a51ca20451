// Soft shadows are sums over many sharp ones: points on the area lights and directions of the sky, each with
// a shadow map of its own.
#pragma once

#include <optional>
#include <vector>

#include "render/projection.h"
#include "sim/scene/scene.h"

namespace duet::render {

struct ShadowSample {
  bool is_sky = false;
  Vec3 place;         // m, point on a light; for the sky the unit direction towards it
  double weight = 0;  // luminance of the irradiance that comes from here: facing, for a light at distance 1 m
};

// The samples of the lights, then those of the sky. Deterministic; neighbours in the list lie far apart on
// the light, so that every n-th sample is a fair choice too.
struct ShadowSampleSet {
  std::vector<ShadowSample> samples;
  int lights = 0;  // how many of them are of lights
};

// Shares scene.render.shadow_samples among the area lights with shadows and the sky.
ShadowSampleSet make_shadow_samples(const scene::Scene& scene);

struct Bounds {
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();  // m, axis-aligned
  std::array<Vec3, 8> corners() const;
};

// Whether the body within `bounds` can throw a shadow of this sample on something that the camera sees.
// `reach`: m, how far shadows are followed; `ground`: height below which there is nothing.
bool shadow_is_seen(const ShadowSample& sample, const Bounds& bounds, const View& view, double reach,
                    std::optional<double> ground);

struct ShadowFrustum {
  Mat4 to_map = Mat4::Zero();  // world to [0, 1]^3, to be divided by the last component
  double texel = 0;  // m, width of a texel; of a light's map: at distance 1 m, growing with the distance
};

// The smallest view of the sample that holds the casters, in a map `side` texels wide. There must be a
// caster.
ShadowFrustum fit_shadow_frustum(const ShadowSample& sample, const std::vector<Bounds>& casters, int side);

}  // namespace duet::render
