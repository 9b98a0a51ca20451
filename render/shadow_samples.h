// Sampling of soft shadows: sums over many sharp ones, from points on the area lights and directions of the
// sky, each with a shadow map of its own.
#pragma once

#include <optional>
#include <vector>

#include "render/projection.h"
#include "sim/scene/scene.h"

namespace duet::render {

/// A point of an area light or a direction of the sky, whose shadow map is one term of the soft shadows.
struct ShadowSample {
  bool is_sky = false;  ///< a direction of the sky, else a point on a light
  Vec3 place;           ///< m, point on the light (world frame); of the sky: unit direction towards it
  /// Luminance of the irradiance that arrives on a facing surface; from a light: at distance 1 m.
  double weight = 0;
};

/// The samples of all area lights, then those of the sky. They are deterministic, and neighbors in the list
/// lie far apart on their light, so that every n-th sample is a fair choice as well.
struct ShadowSampleSet {
  std::vector<ShadowSample> samples;  ///< all samples; one shadow map each
  int lights = 0;                     ///< number of leading samples that belong to lights
};

/// Divides scene.render.shadow_samples among the area lights that cast shadows and the sky. With both, the
/// sky gets five eighths.
ShadowSampleSet make_shadow_samples(const scene::Scene& scene);

/// An axis-aligned box.
struct Box {
  Vec3 low = Vec3::Zero(),  ///< m, its corner with the least coordinates
      high = Vec3::Zero();  ///< m, its corner with the greatest coordinates
  /// Returns the eight corners; bits 0, 1, 2 of the place choose high x, y, z.
  std::array<Vec3, 8> corners() const;
};

/// Returns whether the body within `bounds` can throw a shadow of this sample on anything that the camera
/// sees; true in doubt. Shadows are followed for `reach` (m), or down to the height `ground` (m) if there is
/// one. All places are in one frame.
bool shadow_is_seen(const ShadowSample& sample, const Box& bounds, const View& view, double reach,
                    std::optional<double> ground);

/// The projection of a shadow map.
struct ShadowFrustum {
  Mat4 to_map = Mat4::Zero();  ///< from world to [0, 1]^3 of the map, after division by the last component
  /// Width of a texel (m); of a light's map: at distance 1 m, and proportional to the distance.
  double texel = 0;
};

/// Returns the smallest projection of the sample that holds all `casters`, for a map of `side` x `side`
/// texels. There must be a caster.
ShadowFrustum fit_shadow_frustum(const ShadowSample& sample, const std::vector<Box>& casters, int side);

}  // namespace duet::render
