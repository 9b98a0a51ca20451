// Defines the keys of pictures: the camera, lights, looks, what is written and how it is drawn.
#include "sim/scene/schema_parts.h"
namespace duet::scene {

std::vector<Key> keys(Camera& camera) {
  return {
      {"position", &camera.position, "m", any, "of the eye"},
      {"target", &camera.target, "m", any, "point in the middle of the picture; not the position"},
      {"up", &camera.up, "", any, "direction that points up in the picture; not along the view"},
      {"vertical_fov", &camera.vertical_fov, "degrees", between(0.1, 170),
       "angle from the lower to the upper edge"},
      {"keyframes", list(camera.keyframes), "", any,
       "views at times, smooth between them; at rest before and after them"},
  };
}

std::vector<Key> keys(CameraKey& keyframe) {
  return {
      {"time", &keyframe.time, "s", any, "of the keyframe; later than that of the one before it", required},
      {"position", &keyframe.position, "m", any, "at that time; without it, the camera's own"},
      {"target", &keyframe.target, "m", any, "at that time; without it, the camera's own"},
      {"vertical_fov", &keyframe.vertical_fov, "degrees", between(0.1, 170),
       "at that time; without it, the camera's own"},
  };
}

std::vector<Key> keys(Light& light) {
  return {
      {"name", Name{&light.name}, "", any, "unique among the lights", required},
      {"kind", choice(light.kind, {"area", "point"}), "", any,
       "a disc that faces its target and casts soft shadows, or a point without shadows"},
      {"position", &light.position, "m", any, "of the light"},
      {"target", &light.target, "m", any, "what the disc faces; area lights only"},
      {"radius", &light.radius, "m", positive, "of the disc; area lights only"},
      {"power", &light.power, "", non_negative,
       "irradiance at distance d, facing the light: power / (4 pi d^2)"},
      {"color", &light.color, "linear RGB", between(0, 1), "of the light; linear RGB, not sRGB"},
      {"shadow", &light.shadow, "", any, "whether it casts shadows; area lights only"},
  };
}

std::vector<Key> keys(Sky& sky) {
  return {
      {"zenith", &sky.zenith, "linear RGB", non_negative, "radiance straight up; linear RGB, not sRGB"},
      {"horizon", &sky.horizon, "linear RGB", non_negative, "radiance at the horizon; linear RGB, not sRGB"},
      {"intensity", &sky.intensity, "", non_negative, "factor on both as light"},
  };
}

std::vector<Key> keys(Look& look) {
  return {
      {"color", &look.color, "linear RGB", between(0, 1), "base color; linear RGB, not sRGB"},
      {"metallic", &look.metallic, "", between(0, 1), "0: plastic, stone, wood; 1: bare metal"},
      {"roughness", &look.roughness, "", between(0, 1), "0: a mirror; 1: chalk"},
      {"pattern", choice(look.pattern, {"", "checker", "stripes"}), "", any,
       "\"\" for none; stripes show how a ball spins"},
      {"color2", &look.color2, "linear RGB", between(0, 1), "second color of the pattern; linear RGB"},
      {"pattern_size", &look.pattern_size, "m", positive, "size of the pattern's cells"},
      {"opacity", &look.opacity, "", between(0, 1),
       "1: solid; less: what is inside and behind shows through, in steps of 1/supersampling^2"},
      {"spots", &look.spots, "m", any,
       "round spots of color2: [u, v, radius] in the plane (y, z), (z, x) or (x, y) that a side of a mesh "
       "faces"},
  };
}

std::vector<Key> keys(Output& output) {
  return {{"formats", Words{&output.formats, {export_formats.begin(), export_formats.end()}}, "", any,
           "exports at the end of run and sim, as by `duet export --to`; --formats replaces them"}};
}

std::vector<Key> keys(Render& render) {
  return {
      {"width", &render.width, "pixels", between(16, 16384), "of the picture"},
      {"height", &render.height, "pixels", between(16, 16384), "of the picture"},
      {"supersampling", &render.supersampling, "", between(1, 8),
       "samples a pixel along each axis; the picture's edges times this may not exceed 16384"},
      {"shadow_samples", &render.shadow_samples, "", between(0, 256),
       "shadow maps, shared by all shadow-casting lights and the sky; 0: no shadows"},
      {"exposure", &render.exposure, "", positive, "factor on radiance before tone mapping"},
      {"color", choice(render.color, {"look", "strain", "stress", "contact"}), "", any,
       "what deformable bodies show from blue (0) to yellow; strain has red for inverted elements"},
      {"color_range", &render.color_range, "Pa", positive,
       "stress or contact pressure at the yellow end; required for these two"},
      {"strain_range", &render.strain_range, "", positive,
       "largest |stretch - 1| of the elements around a particle that the colors tell apart"},
  };
}

}  // namespace duet::scene
