#include "sim/io/values_file.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <span>
#include <string_view>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/simulation/simulation.h"

namespace duet::io {
namespace {

static_assert(std::endian::native == std::endian::little, "the records are written as they lie in memory");

// Returns the head of a .npy file of version 1.0 that holds one record: magic, length, and a Python
// dictionary, padded to a multiple of 64 bytes. `fields` are the entries of the record: "('name', '<f8',
// (rows, 3)), ".
std::string npy_head(const std::string& fields) {
  constexpr std::size_t before = 10, unit = 64;  // bytes before the dictionary, and alignment of its end
  std::string text = "{'descr': [" + fields + "], 'fortran_order': False, 'shape': (), }";
  text.append(unit - 1 - (before + text.size()) % unit, ' ');
  text += '\n';
  std::string head("\x93NUMPY\x01\x00", 8);
  head += static_cast<char>(text.size() & 255);
  head += static_cast<char>(text.size() >> 8);
  return head + text;
}

// The kinds of files that programs have written. Each has the fields of the one before, and then its own.
enum class Fields {
  motion,   // positions, velocities and strain
  stress,   // "stress" and "energy_density"
  contact,  // forces of contact
};

// Returns the head of a frame's file with this number of rigid bodies and points of deformable bodies.
std::string frame_head(std::size_t rigid, std::size_t points, Fields fields) {
  std::string text = fmt::format(
      "('frame', '<i8'), ('time', '<f8'), ('position', '<f8', ({0}, 3)), ('orientation', '<f8', ({0}, 4)), "
      "('velocity', '<f8', ({0}, 3)), ('angular_velocity', '<f8', ({0}, 3)), ('point', '<f8', ({1}, 3)), "
      "('point_velocity', '<f4', ({1}, 3)), ('strain', '<f4', ({1},))",
      rigid, points);
  if (fields >= Fields::stress)
    text += fmt::format(", ('stress', '<f4', ({0},)), ('energy_density', '<f4', ({0},))", points);
  if (fields >= Fields::contact)
    text += fmt::format(
        ", ('contact_force', '<f8', ({0}, 3)), ('contact_torque', '<f8', ({0}, 3)), "
        "('point_contact_force', '<f4', ({1}, 3)), ('contact_pressure', '<f4', ({1},))",
        rigid, points);
  return npy_head(text);
}

// Returns the number of bytes that follow the head of such a file.
std::size_t frame_bytes(std::size_t rigid, std::size_t points, Fields fields) {
  std::size_t of_rigid = 13 * sizeof(double), of_point = 3 * sizeof(double) + 4 * sizeof(float);
  if (fields >= Fields::stress) of_point += 2 * sizeof(float);
  if (fields >= Fields::contact) {
    of_rigid += 6 * sizeof(double);
    of_point += 4 * sizeof(float);
  }
  return sizeof(std::int64_t) + sizeof(double) + rigid * of_rigid + points * of_point;
}

// Returns the fields for which there are values of all bodies and points.
Fields fields_of(const FrameValues& values) {
  const std::size_t rigid = values.rigid.size(), points = values.points.size();
  if (values.stress.size() != points || values.energy_density.size() != points) return Fields::motion;
  const ContactLoads& contact = values.contact;
  const bool has_contact = contact.rigid_force.size() == rigid && contact.rigid_torque.size() == rigid &&
                           contact.force.size() == points && contact.pressure.size() == points;
  return has_contact ? Fields::contact : Fields::stress;
}

// Sizes of the surfaces of all bodies together.
struct SurfaceCounts {
  std::size_t positions = 0, normals = 0, uvs = 0, triangles = 0;
};

// Returns the head of values/bodies.npy.
std::string bodies_head(const SurfaceCounts& all) {
  return npy_head(
      fmt::format("('rest', '<f8', ({}, 3)), ('normal', '<f4', ({}, 3)), ('uv', '<f4', ({}, 2)), "
                  "('corner', '<i4', ({}, 3, 3))",
                  all.positions, all.normals, all.uvs, all.triangles));
}

// Collects a file: its head, then values as they lie in memory.
class Writer {
 public:
  explicit Writer(std::string head) : bytes_(std::move(head)) {}
  template <class Value>
  void add(const Value* values, std::size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(Value));
  }
  template <class Value>
  void add(const std::vector<Value>& values) {
    add(values.data(), values.size());
  }
  std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

// Hands out the values after the head of a file, in their order. The constructor throws FileError unless
// the file has the expected head and `body_bytes` bytes after it, so that no take() reads beyond its end.
class ValuesReader {
 public:
  ValuesReader(const fs::path& path, std::string bytes, const std::string& head, std::size_t body_bytes)
      : bytes_(std::move(bytes)), at_(head.size()) {
    if (!bytes_.starts_with(head) || bytes_.size() != head.size() + body_bytes)
      throw FileError(path.string(), "does not hold the values of the bodies that manifest.json lists",
                      "the file is damaged or of another run: simulate the scene anew");
  }
  template <class Value>
  void take(Value* values, std::size_t count) {
    if (count == 0) return;
    std::memcpy(static_cast<void*>(values), bytes_.data() + at_, count * sizeof(Value));
    at_ += count * sizeof(Value);
  }
  template <class Value>
  void take(std::vector<Value>& values, std::size_t count) {
    values.resize(count);
    take(values.data(), count);
  }

 private:
  const std::string bytes_;
  std::size_t at_;
};

// Reads a file of values. Throws FileError that explains why a run may lack it.
std::string read_bytes(const RunDirectory& run, const fs::path& path) {
  if (!fs::exists(path))
    throw FileError(
        path.string(), "is missing: the run has no numbers in double precision",
        "runs of `duet sim --stats-only`, of other --frames, and of programs before December 2026 have none: "
        "simulate the scene anew");
  return run.read(path);
}

std::size_t count_of(int count) { return static_cast<std::size_t>(count); }

template <class Vectors>
bool all_finite(const Vectors& vectors) {
  for (const auto& x : vectors)
    if (!x.allFinite()) return false;
  return true;
}

bool all_finite(const std::vector<float>& values) {
  for (const float value : values)
    if (!std::isfinite(value)) return false;
  return true;
}

// Returns true if all numbers are finite and the orientation is a unit quaternion, within 1e-9. Rounding
// makes an error of about 1e-16; a larger bound would let damaged files pass.
bool is_whole(const RigidMotion& motion) {
  return motion.pose.position.allFinite() && std::abs(motion.pose.orientation.norm() - 1) < 1e-9 &&
         motion.velocity.allFinite() && motion.angular_velocity.allFinite();
}

// Throws the FileError of a damaged file.
[[noreturn]] void refuse(const fs::path& path, const std::string& what) {
  throw FileError(path.string(), what, "the file is damaged: simulate the scene anew");
}

}  // namespace

void measure_values(const Simulation& simulation, const std::vector<BodySurface>& surfaces,
                    FrameValues& values) {
  const FrameStats stats = simulation.stats();
  values.frame = stats.frame;
  values.time = stats.time;
  simulation.rigid_motion(values.rigid);
  simulation.surface_velocities(values.velocities);
  simulation.surface_stress(values.stress, values.energy_density);
  simulation.contact_loads(surfaces, values.contact);
  values.points.clear();
  values.strain.clear();
  for (std::size_t i = values.rigid.size(); i < surfaces.size(); ++i) {
    const Surface& surface = surfaces[i].surface;
    values.points.insert(values.points.end(), surface.positions.begin(), surface.positions.end());
    values.strain.insert(values.strain.end(), surface.strain.begin(), surface.strain.end());
    values.strain.resize(values.points.size(), 0);
  }
}

void take_strain(const FrameValues& values, const std::vector<ManifestBody>& listed,
                 std::vector<BodySurface>& bodies) {
  auto next = values.strain.begin();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!listed[i].is_deformable()) continue;
    const auto end = next + listed[i].vertices;
    if (listed[i].has_strain) bodies[i].surface.strain.assign(next, end);
    next = end;
  }
}

void take_color(const FrameValues& values, const std::vector<ManifestBody>& listed, scene::ColorBy color,
                std::vector<BodySurface>& bodies) {
  if (color == scene::ColorBy::look) return;
  if (color == scene::ColorBy::strain) return take_strain(values, listed, bodies);
  const std::vector<float>& all = color == scene::ColorBy::stress ? values.stress : values.contact.pressure;
  if (all.size() != values.points.size()) return;
  auto next = all.begin();
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (!listed[i].is_deformable()) continue;
    bodies[i].surface.shown.assign(next, next + listed[i].vertices);
    next += listed[i].vertices;
  }
}

std::string npy_text(const FrameValues& values) {
  const Fields fields = fields_of(values);
  Writer writer(frame_head(values.rigid.size(), values.points.size(), fields));
  const std::int64_t frame = values.frame;
  writer.add(&frame, 1);
  writer.add(&values.time, 1);
  for (const RigidMotion& motion : values.rigid) writer.add(motion.pose.position.data(), 3);
  for (const RigidMotion& motion : values.rigid) {
    const Quat& q = motion.pose.orientation;
    const double wxyz[] = {q.w(), q.x(), q.y(), q.z()};
    writer.add(wxyz, 4);
  }
  for (const RigidMotion& motion : values.rigid) writer.add(motion.velocity.data(), 3);
  for (const RigidMotion& motion : values.rigid) writer.add(motion.angular_velocity.data(), 3);
  writer.add(values.points);
  writer.add(values.velocities);
  writer.add(values.strain);
  if (fields >= Fields::stress) {
    writer.add(values.stress);
    writer.add(values.energy_density);
  }
  if (fields >= Fields::contact) {
    writer.add(values.contact.rigid_force);
    writer.add(values.contact.rigid_torque);
    writer.add(values.contact.force);
    writer.add(values.contact.pressure);
  }
  return writer.take();
}

std::string npy_text(const std::vector<BodySurface>& rest) {
  SurfaceCounts all;
  for (const auto& [name, surface] : rest) {
    all.positions += surface.positions.size();
    all.normals += surface.normals.size();
    all.uvs += surface.uvs.size();
    all.triangles += surface.triangles.size();
  }
  Writer writer(bodies_head(all));
  for (const auto& [name, surface] : rest) writer.add(surface.positions);
  for (const auto& [name, surface] : rest) writer.add(surface.normals);
  for (const auto& [name, surface] : rest) writer.add(surface.uvs);
  static_assert(sizeof(Corner) == 3 * sizeof(std::int32_t));
  for (const auto& [name, surface] : rest) writer.add(surface.triangles);
  return writer.take();
}

FrameValues read_values(const RunDirectory& run, const std::vector<ManifestBody>& listed, int frame) {
  std::size_t rigid = 0, points = 0;
  for (const ManifestBody& body : listed) body.is_deformable() ? points += count_of(body.vertices) : ++rigid;
  const fs::path path = run.values(frame);
  std::string bytes = read_bytes(run, path);
  Fields fields = Fields::motion;
  for (const Fields newer : {Fields::stress, Fields::contact})
    if (bytes.starts_with(frame_head(rigid, points, newer))) fields = newer;
  ValuesReader reader(path, std::move(bytes), frame_head(rigid, points, fields),
                      frame_bytes(rigid, points, fields));
  FrameValues values;
  std::int64_t number = 0;
  reader.take(&number, 1);
  reader.take(&values.time, 1);
  values.rigid.resize(rigid);
  for (RigidMotion& motion : values.rigid) reader.take(motion.pose.position.data(), 3);
  for (RigidMotion& motion : values.rigid) {
    double wxyz[4];
    reader.take(wxyz, 4);
    motion.pose.orientation = Quat(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
  }
  for (RigidMotion& motion : values.rigid) reader.take(motion.velocity.data(), 3);
  for (RigidMotion& motion : values.rigid) reader.take(motion.angular_velocity.data(), 3);
  reader.take(values.points, points);
  reader.take(values.velocities, points);
  reader.take(values.strain, points);
  if (fields >= Fields::stress) {
    reader.take(values.stress, points);
    reader.take(values.energy_density, points);
  }
  if (fields >= Fields::contact) {
    reader.take(values.contact.rigid_force, rigid);
    reader.take(values.contact.rigid_torque, rigid);
    reader.take(values.contact.force, points);
    reader.take(values.contact.pressure, points);
  }
  values.frame = static_cast<int>(number);
  if (number != frame) refuse(path, fmt::format("holds the values of frame {}", number));
  bool is_finite = all_finite(values.points) && all_finite(values.velocities) && std::isfinite(values.time);
  for (const RigidMotion& motion : values.rigid) is_finite = is_finite && is_whole(motion);
  is_finite = is_finite && all_finite(values.contact.rigid_force) && all_finite(values.contact.rigid_torque);
  for (const PointValue& kind : point_values)
    is_finite =
        is_finite && (kind.scalars ? all_finite(kind.scalars(values)) : all_finite(kind.vectors(values)));
  if (!is_finite) refuse(path, "holds values that are not finite, or no unit quaternion as an orientation");
  return values;
}

std::vector<BodySurface> read_rest_surfaces(const RunDirectory& run,
                                            const std::vector<ManifestBody>& listed) {
  SurfaceCounts all;
  for (const ManifestBody& body : listed) {
    all.positions += count_of(body.vertices);
    all.normals += count_of(body.normals);
    all.uvs += count_of(body.uvs);
    all.triangles += count_of(body.triangles);
  }
  const fs::path path = run.body_values();
  ValuesReader reader(path, read_bytes(run, path), bodies_head(all),
                      all.positions * sizeof(Vec3) + all.normals * sizeof(Vec3f) + all.uvs * sizeof(Vec2f) +
                          all.triangles * 3 * sizeof(Corner));
  std::vector<BodySurface> bodies(listed.size());
  const auto each = [&](const auto& take) {
    for (std::size_t i = 0; i < bodies.size(); ++i) take(bodies[i].surface, listed[i]);
  };
  each([&](Surface& to, const ManifestBody& body) { reader.take(to.positions, count_of(body.vertices)); });
  each([&](Surface& to, const ManifestBody& body) { reader.take(to.normals, count_of(body.normals)); });
  each([&](Surface& to, const ManifestBody& body) { reader.take(to.uvs, count_of(body.uvs)); });
  each([&](Surface& to, const ManifestBody& body) { reader.take(to.triangles, count_of(body.triangles)); });
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const ManifestBody& body = listed[i];
    bodies[i].name = body.name;
    const Surface& surface = bodies[i].surface;
    if (!all_finite(surface.positions) || !all_finite(surface.normals) || !all_finite(surface.uvs))
      refuse(path, fmt::format("holds coordinates of body `{}` that are not finite", body.name));
    const auto is_index = [](int index, int count) { return index >= 0 && index < count; };
    for (const std::array<Corner, 3>& triangle : surface.triangles)
      for (const Corner& corner : triangle)
        if (!is_index(corner.position, body.vertices) || !is_index(corner.uv, body.uvs) ||
            !is_index(corner.normal, body.normals))
          refuse(path, fmt::format("names vertices that body `{}` does not have", body.name));
  }
  return bodies;
}

}  // namespace duet::io
