#include "sim/io/export/glb_scene.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/io/export/glb_materials.h"

namespace duet::io {
namespace {

constexpr const char* lights_extension = "KHR_lights_punctual";

// Returns the coordinates of the vectors one after the other.
std::vector<float> floats(const std::vector<Vec3f>& vectors) {
  std::vector<float> values;
  values.reserve(3 * vectors.size());
  for (const Vec3f& x : vectors) values.insert(values.end(), x.data(), x.data() + 3);
  return values;
}

// Returns the array [x, y, z, w] in single precision, the order of glTF.
Json json_of(const Quat& q) {
  const Eigen::Vector4f xyzw = q.coeffs().cast<float>();
  return {xyzw.x(), xyzw.y(), xyzw.z(), xyzw.w()};
}

// Returns true if all groups of `width` values are equal.
template <class Value>
bool is_constant(const std::vector<Value>& values, std::size_t width) {
  return std::equal(values.begin() + static_cast<std::ptrdiff_t>(width), values.end(), values.begin());
}

}  // namespace

GlbScene::GlbScene(const ExportedRun& run, const GlbMeasures& measures)
    : run_(run), measures_(measures), first_same_(first_with_same_surface(run.bodies())) {
  add_bodies();
  if (run_.frames().size() > 1) animate_bodies();
  add_camera();
  add_lights();
  finish_meshes();
  finish_json();
}

int GlbScene::add_node(Json node) {
  const auto index = static_cast<int>(nodes_.size());
  nodes_.push_back(std::move(node));
  root_children_.push_back(index);
  return index;
}

void GlbScene::add_bodies() {
  nodes_.push_back({{"name", run_.manifest().title.empty() ? "run" : run_.manifest().title}});  // the root
  for (std::size_t i = 0; i < run_.bodies().size(); ++i) body_nodes_.push_back(add_node(body_node(i)));
}

Json GlbScene::body_node(std::size_t i) {
  const ExportedBody& body = run_.bodies()[i];
  Json node = {{"name", body.name}};
  Vec3 position = measures_.origin;  // relative to the origin of the run
  if (body.is_rigid()) {
    const PoseTrack& track = measures_.poses.of(i);
    position = track.positions.front();
    node["translation"] = json_of(Vec3f((position - measures_.origin).cast<float>()));
    node["rotation"] = json_of(track.orientations.front());
    if (!body.rest.triangles.empty()) node["mesh"] = rigid_mesh(i);
  }
  for (std::size_t k = 0; k < measures_.morphed.size(); ++k) {
    if (measures_.bodies[k] != i) continue;
    const Vec3f translation = measures_.morphed[k].translation();
    position += translation.cast<double>();
    node["translation"] = json_of(translation);
    node["mesh"] = morphed_mesh(k);
  }
  node["extras"] = {{"kind", body.kind}, {"position", json_of(position)}};
  return node;
}

int GlbScene::rigid_mesh(std::size_t i) {
  const ExportedBody& body = run_.bodies()[i];
  const auto [entry, is_new] =
      rigid_meshes_.try_emplace({first_same_[i], body.look}, static_cast<int>(meshes_.size()));
  if (!is_new) return entry->second;
  const auto [geometry, is_first] = rigid_geometry_.try_emplace(first_same_[i]);
  if (is_first) {
    const SplitVertices split = split_vertices(body.rest);
    std::vector<Vec3f> positions, normals;
    for (const Corner& corner : split.vertices) {
      positions.push_back(body.rest.positions[static_cast<std::size_t>(corner.position)].cast<float>());
      normals.push_back(body.rest.normals[static_cast<std::size_t>(corner.normal)]);
    }
    geometry->second = add_geometry(body.rest, split, positions, normals);
  }
  meshes_.emplace_back(mesh_start(body, geometry->second), -1);
  return entry->second;
}

int GlbScene::morphed_mesh(std::size_t k) {
  const MorphedBody& morphed = measures_.morphed[k];
  const Geometry geometry =
      add_geometry(morphed.body().rest, morphed.split(), morphed.positions(), morphed.normals());
  meshes_.emplace_back(mesh_start(morphed.body(), geometry), static_cast<int>(k));
  return static_cast<int>(meshes_.size()) - 1;
}

GlbScene::Geometry GlbScene::add_geometry(const Surface& surface, const SplitVertices& split,
                                          const std::vector<Vec3f>& positions,
                                          const std::vector<Vec3f>& normals) {
  Geometry geometry;
  geometry.positions = document_.add_floats(floats(positions), 3, ViewUse::vertices, Bounds::write);
  std::vector<float> unit = floats(normals);
  for (std::size_t i = 0; i < normals.size(); ++i) {  // glTF demands unit normals
    const float length = normals[i].norm();
    const Vec3f n = length > 0 ? Vec3f(normals[i] / length) : Vec3f(Vec3f::UnitY());
    std::copy_n(n.data(), 3, unit.data() + 3 * i);
  }
  geometry.normals = document_.add_floats(unit, 3, ViewUse::vertices, Bounds::leave_out);
  if (!surface.uvs.empty()) {
    std::vector<float> uvs;
    for (const Corner& corner : split.vertices) {
      const Vec2f& uv = surface.uvs[static_cast<std::size_t>(corner.uv)];
      uvs.insert(uvs.end(), {uv.x(), 1 - uv.y()});  // in glTF v points down
    }
    geometry.uvs = document_.add_floats(uvs, 2, ViewUse::vertices, Bounds::leave_out);
  }
  if (!split.keeps_positions(surface.positions.size())) {
    std::vector<float> places;  // glTF has no attributes of 32-bit integers; floats are exact up to 2^24
    for (const Corner& corner : split.vertices) places.push_back(static_cast<float>(corner.position));
    geometry.run_vertices = document_.add_floats(places, 1, ViewUse::vertices, Bounds::leave_out);
  }
  geometry.indices = document_.add_indices(split.indices, split.vertices.size());
  return geometry;
}

std::string GlbScene::mesh_start(const ExportedBody& body, const Geometry& geometry) {
  std::string text =
      fmt::format("{{\"name\":{},\"primitives\":[{{\"attributes\":{{\"POSITION\":{},\"NORMAL\":{}",
                  json_text(body.name), geometry.positions, geometry.normals);
  if (geometry.uvs >= 0) text += fmt::format(",\"TEXCOORD_0\":{}", geometry.uvs);
  if (geometry.run_vertices >= 0) text += fmt::format(",\"_RUN_VERTEX\":{}", geometry.run_vertices);
  text += fmt::format("}},\"indices\":{}", geometry.indices);
  if (!run_.looks().looks.empty()) text += fmt::format(",\"material\":{}", material(body.look));
  return text;
}

int GlbScene::material(int look) {
  const auto [entry, is_new] = material_of_look_.try_emplace(look, static_cast<int>(materials_.size()));
  if (is_new)
    materials_.push_back(gltf_material(run_.looks().looks.at(static_cast<std::size_t>(look)), run_.scale()));
  return entry->second;
}

void GlbScene::animate(int node, const char* path, const std::vector<float>& values, int components) {
  if (is_constant(values, static_cast<std::size_t>(components))) return;
  channels_.push_back({{"sampler", samplers_.size()}, {"target", {{"node", node}, {"path", path}}}});
  samplers_.push_back(
      {{"input", times_},
       {"output", document_.add_floats(values, components, ViewUse::other, Bounds::leave_out)}});
}

void GlbScene::animate_poses(int node, const PoseTrack& track) {
  std::vector<float> translations, rotations;
  for (const Vec3& x : track.positions) {
    const Vec3f local = (x - measures_.origin).cast<float>();
    translations.insert(translations.end(), local.data(), local.data() + 3);
  }
  for (const Quat& q : track.orientations) {
    const Eigen::Vector4f xyzw = q.coeffs().cast<float>();
    rotations.insert(rotations.end(), xyzw.data(), xyzw.data() + 4);
  }
  animate(node, "translation", translations, 3);
  animate(node, "rotation", rotations, 4);
}

void GlbScene::animate_bodies() {
  const std::vector<double>& times = measures_.poses.times();
  times_ = document_.add_floats({times.begin(), times.end()}, 1, ViewUse::other, Bounds::write);
  for (std::size_t i = 0; i < run_.bodies().size(); ++i)
    if (run_.bodies()[i].is_rigid()) animate_poses(body_nodes_[i], measures_.poses.of(i));
  for (std::size_t k = 0; k < measures_.morphed.size(); ++k) {
    const int node = body_nodes_[measures_.bodies[k]];
    std::vector<Vec3f> translations{measures_.morphed[k].translation()};
    for (const std::vector<MorphFrame>& frame : measures_.morphs)
      translations.push_back(frame[k].translation);
    animate(node, "translation", floats(translations), 3);
    if (!measures_.changes[k]) continue;
    if (weights_ < 0) {
      // At frame n the weight of target n - 1 is 1 and those of the others are 0. Readers interpolate
      // linearly.
      const std::size_t targets = times.size() - 1;
      std::vector<float> weights(times.size() * targets, 0);
      for (std::size_t frame = 1; frame < times.size(); ++frame) weights[frame * targets + frame - 1] = 1;
      weights_ = static_cast<int>(samplers_.size());
      samplers_.push_back({{"input", times_}, {"output", document_.add_sparse_floats(weights)}});
    }
    channels_.push_back({{"sampler", weights_}, {"target", {{"node", node}, {"path", "weights"}}}});
  }
}

void GlbScene::add_camera() {
  const CameraTrack track = camera_track(run_, measures_.poses.times());
  const int node = add_node(
      {{"name", "camera"},
       {"camera", 0},
       {"translation", json_of(Vec3f((track.poses.positions.front() - measures_.origin).cast<float>()))},
       {"rotation", json_of(track.poses.orientations.front())}});
  if (track.poses.positions.size() > 1) animate_poses(node, track.poses);
  document_.json()["cameras"] = {gltf_camera(track, run_.looks())};
}

void GlbScene::add_lights() {
  Json lights = Json::array();
  for (const scene::Light& light : run_.looks().lights) {
    const Vec3 position = run_.scale() * (run_.axes() * light.position) - measures_.origin;
    const Json use = {{lights_extension, {{"light", lights.size()}}}};
    Json node = {{"name", light.name}, {"translation", json_of(Vec3f(position.cast<float>()))}};
    node["extensions"] = use;
    if (light.kind == scene::LightKind::area) node["extras"] = {{"radius", run_.scale() * light.radius}};
    add_node(std::move(node));
    lights.push_back(gltf_light(light, run_.scale()));
  }
  if (lights.empty()) return;
  document_.json()["extensionsUsed"] = {lights_extension};
  document_.json()["extensions"] = {{lights_extension, {{"lights", lights}}}};
}

void GlbScene::finish_meshes() {
  std::vector<std::size_t> vertices, slot(measures_.morphed.size());
  for (std::size_t k = 0; k < measures_.morphed.size(); ++k) {
    if (!measures_.changes[k]) continue;
    slot[k] = 2 * vertices.size();
    vertices.push_back(measures_.morphed[k].split().vertices.size());
  }
  std::vector<std::string> targets(measures_.morphed.size()), names(measures_.morphed.size());
  std::vector<int> accessors;
  for (std::size_t frame = 0; frame < measures_.morphs.size() && !vertices.empty(); ++frame) {
    std::vector<MorphFrame> row;
    for (std::size_t k = 0; k < slot.size(); ++k)
      if (measures_.changes[k]) row.push_back(measures_.morphs[frame][k]);
    accessors = add_morph_accessors(row, vertices, accessors, document_);
    const char* comma = frame > 0 ? "," : "";
    for (std::size_t k = 0; k < slot.size(); ++k) {
      if (!measures_.changes[k]) continue;
      targets[k] += fmt::format("{}{{\"POSITION\":{},\"NORMAL\":{}}}", comma, accessors[slot[k]],
                                accessors[slot[k] + 1]);
      names[k] += fmt::format("{}\"frame {}\"", comma, run_.frames()[frame + 1]);
    }
  }
  for (const auto& [start, morphed] : meshes_) {
    const auto k = static_cast<std::size_t>(morphed);
    document_.add_mesh(morphed >= 0 && measures_.changes[k]
                           ? fmt::format("{},\"targets\":[{}]}}],\"extras\":{{\"targetNames\":[{}]}}}}",
                                         start, targets[k], names[k])
                           : start + "}]}");
  }
}

void GlbScene::finish_json() {
  Json& json = document_.json();
  nodes_[0]["children"] = root_children_;
  json["asset"] = {{"version", "2.0"}, {"generator", program_text(run_.manifest().origin)}};
  json["asset"]["extras"] = {{"fps", run_.manifest().fps},          {"first_frame", run_.frames().front()},
                             {"last_frame", run_.frames().back()},  {"missing_frames", run_.missing()},
                             {"origin", json_of(measures_.origin)}, {"units_per_meter", run_.scale()},
                             {"up", std::string(1, run_.up())}};
  json["scene"] = 0;
  json["scenes"] = {{{"name", run_.manifest().title}, {"nodes", {0}}}};
  json["nodes"] = nodes_;
  if (!materials_.empty()) json["materials"] = materials_;
  if (!channels_.empty())
    json["animations"] = {{{"name", "run"}, {"samplers", samplers_}, {"channels", channels_}}};
}

}  // namespace duet::io
