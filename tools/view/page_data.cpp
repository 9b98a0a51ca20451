#include "tools/view/page_data.h"

#include <algorithm>
#include <cmath>

#include "tools/base64.h"
#include "tools/view/near_bodies.h"
#include "tools/view/packing.h"

#include "sim/io/export/split_vertices.h"
#include "sim/io/export/tracks.h"
#include "sim/scene/camera_path.h"

namespace duet::view {
namespace {

using Json = nlohmann::ordered_json;

// Bytes of a block before it is compressed: the page says how far it has come after each one, and holds one
// of them twice while it unpacks it.
constexpr std::size_t block_bytes = 4'000'000;

Json json_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Json json_of(const std::optional<double>& x) { return x ? Json(*x) : Json(); }

bool has_uv(const io::ExportedRun& run, const io::ExportedBody& body) {
  const scene::Look& look = run.looks().looks.at(as_index(body.look));
  return (!look.pattern.empty() || !look.spots.empty()) && !body.rest.uvs.empty();
}

// For each body its mesh: bodies with the same rest surface share one, which then has texture coordinates if
// any of them needs these.
struct MeshList {
  std::vector<std::size_t> bodies;  // the first one of each mesh
  std::vector<bool> uv;             // of each mesh
  std::vector<std::size_t> of_body;
};

MeshList list_meshes(const io::ExportedRun& run) {
  const std::vector<std::size_t> first = io::first_with_same_surface(run.bodies());
  MeshList list;
  for (std::size_t i = 0; i < first.size(); ++i) {
    const bool uv = has_uv(run, run.bodies()[i]);
    if (first[i] == i) {
      list.of_body.push_back(list.bodies.size());
      list.bodies.push_back(i);
      list.uv.push_back(uv);
    } else {
      list.of_body.push_back(list.of_body[first[i]]);
      if (uv) list.uv[list.of_body[i]] = true;
    }
  }
  return list;
}

void append_vectors(std::string& bytes, const auto& vectors) {
  std::vector<float> numbers;
  for (const auto& v : vectors)
    for (int axis = 0; axis < static_cast<int>(v.size()); ++axis)
      numbers.push_back(static_cast<float>(v[axis]));
  append(bytes, numbers);
}

void append_mesh(std::string& bytes, const io::ExportedBody& body, bool uv) {
  const io::SplitVertices split = io::split_vertices(body.rest);
  if (body.is_rigid()) {
    append_vectors(bytes, body.rest.positions);
    append_vectors(bytes, body.rest.normals);
  }
  std::vector<std::uint32_t> corners;
  std::vector<Vec2f> uvs;
  for (const Corner& corner : split.vertices) {
    corners.push_back(static_cast<std::uint32_t>(corner.position));
    corners.push_back(static_cast<std::uint32_t>(corner.normal));
    if (uv) uvs.push_back(body.rest.uvs.at(as_index(corner.uv)));
  }
  append(bytes, corners);
  append_vectors(bytes, uvs);
  append(bytes, split.indices);
}

std::vector<Vec3> points_of(const io::ExportedBody& body, const io::FrameValues& values, const Vec3& origin) {
  std::vector<Vec3> points(body.rest.positions.size());
  for (std::size_t i = 0; i < points.size(); ++i) points[i] = values.points.at(body.first_point + i) - origin;
  return points;
}

void add(std::vector<float>& row, const Vec3& v) {
  for (int axis = 0; axis < 3; ++axis) row.push_back(static_cast<float>(v[axis]));
}

// Packs frames one after another, each from those before.
class FramePacker {
 public:
  FramePacker(const io::ExportedRun& run, const Measures& measures, std::optional<double> ground)
      : run_(run), measures_(measures), near_(run, ground), marks_(run.bodies().size()) {
    for (std::size_t i = 0; i < run.bodies().size(); ++i) {
      positions_.emplace_back(measures.extents[i]);
      speeds_.emplace_back();
      strains_.emplace_back();
      stresses_.emplace_back();
      pressures_.emplace_back();
    }
  }

  void append_to(std::string& bytes, const io::FrameValues& values) {
    std::vector<float> row;
    std::string rest;
    for (std::size_t i = 0; i < run_.bodies().size(); ++i)
      if (run_.bodies()[i].is_rigid())
        add_rigid(row, as_index(run_.bodies()[i].row), values);
      else
        add_deformable(row, rest, i, values);
    rows_.append_to(bytes, row);
    bytes += rest;
    const std::vector<std::vector<std::uint8_t>> marks = near_.at(values);
    for (std::size_t i = 0; i < marks.size(); ++i) append_sparse(bytes, marks_[i], marks[i]);
    if (!measures_.max_pressure) return;
    for (std::size_t i = 0; i < run_.bodies().size(); ++i)
      if (!run_.bodies()[i].is_rigid()) append_sparse(bytes, pressures_[i], pressures_of(i, values));
  }

 private:
  // A row that may be left out: a byte that says whether it is there, and the row.
  static void append_sparse(std::string& bytes, ByteRows& rows, const std::vector<std::uint8_t>& row) {
    bytes += row.empty() ? '\0' : '\1';
    if (!row.empty()) rows.append_to(bytes, row);
  }

  // The pressures of contact on the body; empty if nothing presses on it.
  std::vector<std::uint8_t> pressures_of(std::size_t i, const io::FrameValues& values) const {
    const io::ExportedBody& body = run_.bodies()[i];
    std::vector<std::uint8_t> pressures;
    bool is_pressed = false;
    for (std::size_t k = 0; k < body.rest.positions.size(); ++k) {
      const float pressure = values.contact.pressure.at(body.first_point + k);
      pressures.push_back(root_byte(static_cast<double>(pressure), *measures_.max_pressure));
      is_pressed = is_pressed || pressures.back() > 0;
    }
    if (!is_pressed) pressures.clear();
    return pressures;
  }

  void add_rigid(std::vector<float>& row, std::size_t index, const io::FrameValues& values) const {
    const RigidMotion& motion = values.rigid.at(index);
    const Quat& q = motion.pose.orientation;
    add(row, motion.pose.position - measures_.origin);
    for (const double x : {q.w(), q.x(), q.y(), q.z()}) row.push_back(static_cast<float>(x));
    add(row, motion.velocity);
    add(row, motion.angular_velocity);
    add(row, measures_.max_pressure ? values.contact.rigid_force.at(index) : Vec3::Zero());
  }

  void add_deformable(std::vector<float>& row, std::string& rest, std::size_t i,
                      const io::FrameValues& values) {
    const io::ExportedBody& body = run_.bodies()[i];
    const std::vector<Vec3> points = points_of(body, values, measures_.origin);
    Eigen::AlignedBox3d box;
    Vec3 mean = Vec3::Zero(), velocity = Vec3::Zero();
    double most_speed = 0, most_strain = 0;
    std::vector<std::uint8_t> speeds, strains;
    for (std::size_t k = 0; k < points.size(); ++k) {
      box.extend(points[k]);
      mean += points[k];
      const Vec3 v = values.velocities.at(body.first_point + k).cast<double>();
      velocity += v;
      most_speed = std::max(most_speed, v.norm());
      speeds.push_back(root_byte(v.norm(), measures_.max_speed));
      const auto strain = static_cast<double>(values.strain.at(body.first_point + k));
      if (strain < 0 || most_strain < 0)
        most_strain = -1;
      else
        most_strain = std::max(most_strain, strain);
      constexpr std::uint8_t inverted = 255;
      strains.push_back(strain < 0 ? inverted : root_byte(strain, measures_.max_strain, inverted - 1));
    }
    const Vec3f center = box.center().cast<float>();
    const auto count = static_cast<double>(points.size());
    add(row, center.cast<double>());
    add(row, mean / count);
    add(row, velocity / count);
    row.push_back(static_cast<float>(most_speed));
    row.push_back(static_cast<float>(most_strain));
    positions_[i].append_to(rest, points, center);
    speeds_[i].append_to(rest, speeds);
    if (measures_.has_strain[i]) strains_[i].append_to(rest, strains);
    add_loads(row, rest, i, values);
  }

  // Force of contact, largest stress and pressure; the stresses where the body has them.
  void add_loads(std::vector<float>& row, std::string& rest, std::size_t i, const io::FrameValues& values) {
    const io::ExportedBody& body = run_.bodies()[i];
    Vec3 force = Vec3::Zero();
    float most_stress = 0, most_pressure = 0;
    std::vector<std::uint8_t> stresses;
    const bool has_stress = measures_.has_stress(i);
    for (std::size_t point = body.first_point; point < body.first_point + body.rest.positions.size();
         ++point) {
      if (has_stress) {
        most_stress = std::max(most_stress, values.stress.at(point));
        stresses.push_back(root_byte(static_cast<double>(values.stress.at(point)), *measures_.max_stress));
      }
      if (!measures_.max_pressure) continue;
      force += values.contact.force.at(point).cast<double>();
      most_pressure = std::max(most_pressure, values.contact.pressure.at(point));
    }
    add(row, force);
    row.push_back(most_stress);
    row.push_back(most_pressure);
    if (has_stress) stresses_[i].append_to(rest, stresses);
  }

  const io::ExportedRun& run_;
  const Measures& measures_;
  NearBodies near_;
  FloatRows rows_;
  std::vector<PositionRows> positions_;
  std::vector<ByteRows> speeds_, strains_, stresses_, pressures_, marks_;
};

Json view_of(const scene::Camera& camera, const Vec3& origin) {
  return {{"position", json_of(camera.position - origin)},
          {"target", json_of(camera.target - origin)},
          {"up", json_of(camera.up.normalized())},
          {"fov", camera.vertical_fov}};
}

Json camera_of(const io::ExportedRun& run, const Vec3& origin, const std::vector<int>& frames) {
  const scene::Camera& camera = run.looks().camera;
  Json object = view_of(camera, origin);
  object["aspect"] = static_cast<double>(run.looks().width) / run.looks().height;
  if (camera.keyframes.empty()) return object;
  const scene::CameraPath path(camera);
  for (const int frame : frames)
    object["motion"].push_back(view_of(path.at(frame / run.manifest().fps), origin));
  return object;
}

// Takes the values at the points of deformable bodies into account.
void extend(Measures& measures, const io::FrameValues& values) {
  for (const Vec3f& v : values.velocities)
    measures.max_speed = std::max(measures.max_speed, static_cast<double>(v.norm()));
  for (const float strain : values.strain)
    measures.max_strain = std::max(measures.max_strain, static_cast<double>(strain));
  const auto extend_if_there = [&](std::optional<double>& most, const std::vector<float>& scalars) {
    if (scalars.size() != values.points.size()) most.reset();
    if (!most) return;
    for (const float x : scalars) most = std::max(*most, static_cast<double>(x));
  };
  extend_if_there(measures.max_stress, values.stress);
  extend_if_there(measures.max_pressure, values.contact.pressure);
  if (values.contact.rigid_force.size() != values.rigid.size()) measures.max_pressure.reset();
}

}  // namespace

Measures measure(const io::ExportedRun& run) {
  Measures measures;
  measures.max_stress = measures.max_pressure = 0;
  const std::size_t count = run.bodies().size();
  std::vector<Vec3> extents(count, Vec3::Zero());
  for (const io::ExportedBody& body : run.bodies()) {
    const auto& listed = run.manifest().bodies;
    const auto found = std::find_if(listed.begin(), listed.end(),
                                    [&](const io::ManifestBody& b) { return b.name == body.name; });
    measures.has_strain.push_back(!body.is_rigid() && found != listed.end() && found->has_strain);
  }
  for (const int frame : run.frames()) {
    const io::FrameValues values = run.read(frame);
    Eigen::AlignedBox3d all;
    for (std::size_t i = 0; i < count; ++i) {
      const io::ExportedBody& body = run.bodies()[i];
      if (body.is_rigid()) {
        all.extend(values.rigid.at(as_index(body.row)).pose.position);
        continue;
      }
      Eigen::AlignedBox3d box;
      for (const Vec3& x : points_of(body, values, Vec3::Zero())) box.extend(x);
      extents[i] = extents[i].cwiseMax(box.sizes());
      all.extend(box);
    }
    if (frame == run.frames().front() && !all.isEmpty()) measures.origin = all.center();
    extend(measures, values);
  }
  // A thousandth more, so that the rounding of the center puts no position outside; a flat body has a
  // thickness.
  for (const Vec3& extent : extents) {
    const double least = std::max(1e-6 * extent.norm(), 1e-12);
    measures.extents.push_back((1.001 * extent).cwiseMax(least).cast<float>());
  }
  return measures;
}

std::vector<int> thinned(const std::vector<int>& frames, std::size_t step) {
  std::vector<int> taken;
  for (std::size_t i = 0; i < frames.size(); i += step) taken.push_back(frames[i]);
  if (!frames.empty() && taken.back() != frames.back()) taken.push_back(frames.back());
  return taken;
}

std::string mesh_block(const io::ExportedRun& run) {
  const MeshList list = list_meshes(run);
  std::string bytes;
  for (std::size_t i = 0; i < list.bodies.size(); ++i)
    append_mesh(bytes, run.bodies()[list.bodies[i]], list.uv[i]);
  return tools::base64(deflated(bytes));
}

PackedFrames pack(const io::ExportedRun& run, const Measures& measures, const std::vector<int>& frames,
                  std::optional<double> ground, std::size_t room) {
  FramePacker packer(run, measures, ground);
  PackedFrames packed;
  std::string bytes;
  for (const int frame : frames) {
    packer.append_to(bytes, run.read(frame));
    ++packed.frames;
    if (bytes.size() < block_bytes && frame != frames.back()) continue;
    packed.blocks.push_back(tools::base64(deflated(bytes)));
    packed.bytes += packed.blocks.back().size();
    bytes.clear();
    if (packed.bytes > room) break;
  }
  return packed;
}

Json describe(const io::ExportedRun& run, const Measures& measures, const std::vector<int>& frames) {
  const MeshList list = list_meshes(run);
  Json object = {{"origin", json_of(measures.origin)},
                 {"max_speed", measures.max_speed},
                 {"max_strain", measures.max_strain},
                 {"max_stress", json_of(measures.max_stress)},
                 {"max_pressure", json_of(measures.max_pressure)},
                 {"near_fraction", near_fraction},
                 {"bodies", Json::array()},
                 {"meshes", Json::array()},
                 {"looks", Json::array()},
                 {"lights", Json::array()},
                 {"camera", camera_of(run, measures.origin, frames)}};
  for (std::size_t i = 0; i < run.bodies().size(); ++i) {
    const io::ExportedBody& body = run.bodies()[i];
    Json entry = {{"name", body.name}, {"kind", body.kind}, {"look", body.look}, {"mesh", list.of_body[i]}};
    if (!body.is_rigid()) {
      entry["extent"] = json_of(measures.extents[i].cast<double>());
      entry["strain"] = static_cast<bool>(measures.has_strain[i]);
      entry["stress"] = measures.has_stress(i);
    }
    object["bodies"].push_back(std::move(entry));
  }
  for (std::size_t i = 0; i < list.bodies.size(); ++i) {
    const Surface& surface = run.bodies()[list.bodies[i]].rest;
    object["meshes"].push_back({{"positions", surface.positions.size()},
                                {"normals", surface.normals.size()},
                                {"vertices", io::split_vertices(surface).vertices.size()},
                                {"triangles", surface.triangles.size()},
                                {"uv", static_cast<bool>(list.uv[i])}});
  }
  for (const scene::Look& look : run.looks().looks) {
    Json spots = Json::array();
    for (const Vec3& spot : look.spots) spots.push_back(json_of(spot));
    object["looks"].push_back({{"color", json_of(look.color)},
                               {"metallic", look.metallic},
                               {"roughness", look.roughness},
                               {"opacity", look.opacity},
                               {"pattern", look.pattern},
                               {"color2", json_of(look.color2)},
                               {"pattern_size", look.pattern_size},
                               {"spots", std::move(spots)}});
  }
  for (const scene::Light& light : run.looks().lights)
    object["lights"].push_back({{"position", json_of(light.position - measures.origin)},
                                {"target", json_of(light.target - measures.origin)},
                                {"radius", light.kind == scene::LightKind::area ? light.radius : 0.0},
                                {"power", light.power},
                                {"color", json_of(light.color)},
                                {"shadow", light.kind == scene::LightKind::area && light.shadow}});
  return object;
}

}  // namespace duet::view
