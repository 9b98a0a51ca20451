#include "sim/io/export/exported_run.h"

#include <algorithm>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/near_miss.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet::io {
namespace {

constexpr double half_sqrt2 = std::numbers::sqrt2 / 2;  // sine and cosine of half of 90 degrees

bool is_wanted(const std::string& name, const std::vector<std::string>& patterns) {
  return patterns.empty() || std::any_of(patterns.begin(), patterns.end(),
                                         [&](const std::string& pattern) { return matches(pattern, name); });
}

// Throws Error (usage) if one of the chosen patterns matches no body of the run.
void require_matches(const ExportChoice& choice, const Manifest& manifest) {
  for (const std::string& pattern : choice.bodies) {
    const bool found = std::any_of(manifest.bodies.begin(), manifest.bodies.end(),
                                   [&](const ManifestBody& body) { return matches(pattern, body.name); });
    if (found) continue;
    std::vector<std::string> names;
    for (const ManifestBody& body : manifest.bodies) names.push_back(body.name);
    const std::optional<std::string> near = near_miss(pattern, names);
    throw Error(ExitStatus::usage,
                fmt::format("--bodies {}: no body of the run has such a name ({})", pattern,
                            near ? fmt::format("did you mean `{}`?", *near) : "manifest.json lists all"));
  }
}

// Returns the frames that have a file of values, in ascending order.
std::vector<int> frames_with_values(const RunDirectory& run) {
  std::vector<int> frames;
  for (const fs::path& path : files_in(run.values(0).parent_path()))
    if (const int frame = frame_of_file(path, ".npy"); frame >= 0) frames.push_back(frame);
  std::sort(frames.begin(), frames.end());
  return frames;
}

}  // namespace

ExportedRun::ExportedRun(RunDirectory run, const ExportChoice& choice)
    : run_(std::move(run)),
      manifest_(read_manifest(run_)),
      axes_(choice.up == 'z' ? Quat(half_sqrt2, half_sqrt2, 0, 0) : Quat::Identity()),
      scale_(choice.scale),
      up_(choice.up) {
  require_matches(choice, manifest_);
  std::vector<BodySurface> surfaces = read_rest_surfaces(run_, manifest_.bodies);
  int row = 0;
  std::size_t first_point = 0;
  for (std::size_t i = 0; i < surfaces.size(); ++i) {
    const ManifestBody& listed = manifest_.bodies[i];
    if (is_wanted(listed.name, choice.bodies)) {
      ExportedBody body{listed.name, listed.kind, 0, std::move(surfaces[i].surface), -1, first_point};
      body.row = listed.is_deformable() ? -1 : row;
      for (Vec3& x : body.rest.positions) x = scale_ * (body.is_rigid() ? x : turned(x));
      if (!body.is_rigid())
        for (Vec3f& n : body.rest.normals) n = turned(n.cast<double>()).cast<float>();
      bodies_.push_back(std::move(body));
      body_rows_.push_back(static_cast<int>(i));
    }
    if (listed.is_deformable())
      first_point += static_cast<std::size_t>(listed.vertices);
    else
      ++row;
  }
  const std::vector<int> there = frames_with_values(run_);
  for (const int frame : there)
    if (frame >= choice.first.value_or(0) && frame <= choice.last.value_or(manifest_.frames))
      frames_.push_back(frame);
  if (frames_.empty())
    throw Error(
        ExitStatus::usage,
        fmt::format("{}: has none of the frames that are asked for; {}", run_.root.string(),
                    there.empty() ? std::string("it has no frame at all")
                                  : fmt::format("it has frames {} to {}", there.front(), there.back())));
  std::size_t next = 0;
  for (int frame = choice.first.value_or(frames_.front()); frame <= choice.last.value_or(frames_.back());
       ++frame)
    if (next < frames_.size() && frames_[next] == frame)
      ++next;
    else
      missing_.push_back(frame);
}

void ExportedRun::set_looks(ExportedLooks looks) {
  looks_ = std::move(looks);
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    bodies_[i].look = looks_.of_body.at(static_cast<std::size_t>(body_rows_[i]));
}

FrameValues ExportedRun::read(int frame) const {
  if (watch_) watch_(frame);
  FrameValues values = read_values(run_, manifest_.bodies, frame);
  if (up_ == 'y' && scale_ == 1) return values;
  for (RigidMotion& motion : values.rigid) {
    motion.pose.position = scale_ * turned(motion.pose.position);
    motion.pose.orientation = (axes_ * motion.pose.orientation).normalized();
    motion.velocity = scale_ * turned(motion.velocity);
    motion.angular_velocity = turned(motion.angular_velocity);
  }
  for (Vec3& x : values.points) x = scale_ * turned(x);
  for (Vec3f& v : values.velocities) v = (scale_ * turned(v.cast<double>())).cast<float>();
  for (std::vector<Vec3>* all : {&values.contact.rigid_force, &values.contact.rigid_torque})
    for (Vec3& x : *all) x = turned(x);
  for (Vec3f& force : values.contact.force) force = turned(force.cast<double>()).cast<float>();
  return values;
}

void place(const ExportedBody& body, const FrameValues& values, Surface& surface) {
  if (body.is_rigid()) {
    const Pose& pose = values.rigid.at(static_cast<std::size_t>(body.row)).pose;
    const Mat3 rotation = pose.orientation.toRotationMatrix();
    for (std::size_t i = 0; i < surface.positions.size(); ++i)
      surface.positions[i] = rotation * body.rest.positions[i] + pose.position;
    for (std::size_t i = 0; i < surface.normals.size(); ++i)
      surface.normals[i] = (rotation * body.rest.normals[i].cast<double>()).cast<float>();
    return;
  }
  std::copy_n(values.points.begin() + static_cast<std::ptrdiff_t>(body.first_point), surface.positions.size(),
              surface.positions.begin());
  update_normals(surface);
}

void velocities(const ExportedBody& body, const FrameValues& values, std::vector<Vec3f>& out) {
  out.resize(body.rest.positions.size());
  if (!body.is_rigid()) {
    std::copy_n(values.velocities.begin() + static_cast<std::ptrdiff_t>(body.first_point), out.size(),
                out.begin());
    return;
  }
  const RigidMotion& motion = values.rigid.at(static_cast<std::size_t>(body.row));
  for (std::size_t i = 0; i < out.size(); ++i) {
    const Vec3 arm = motion.pose.orientation * body.rest.positions[i];
    out[i] = (motion.velocity + motion.angular_velocity.cross(arm)).cast<float>();
  }
}

bool matches(std::string_view pattern, std::string_view name) {
  // Greedy matching: `taken` is the first character after those that the last star stands for. At a
  // mismatch the star takes one character more, and matching resumes behind it.
  std::size_t p = 0, n = 0, star = std::string_view::npos, taken = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++;
      taken = n;
    } else if (p < pattern.size() && pattern[p] == name[n]) {
      ++p;
      ++n;
    } else if (star != std::string_view::npos) {
      p = star + 1;
      n = ++taken;
    } else {
      return false;
    }
  }
  return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

}  // namespace duet::io
