#include "sim/io/export/tracks.h"

#include <algorithm>
#include <cstring>
#include <numbers>
#include <unordered_map>

#include "sim/base/assert.h"
#include "sim/base/hash.h"
#include "sim/scene/camera_path.h"

namespace duet::io {
namespace {

// Returns the rotation from the camera's axes to those of the world. Returns no rotation if the target is
// at the camera or the view is along `up`.
Quat orientation(const scene::Camera& camera) {
  const Vec3 forward = (camera.target - camera.position).normalized();
  const Vec3 right = forward.cross(camera.up).normalized();
  if (!(right.norm() > 0.5)) return Quat::Identity();
  Mat3 axes;
  axes << right, right.cross(forward), -forward;
  return Quat(axes).normalized();
}

// Returns true if both arrays have the same bits.
template <class Value>
bool same_bytes(const std::vector<Value>& a, const std::vector<Value>& b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(static_cast<const void*>(a.data()), static_cast<const void*>(b.data()),
                                   a.size() * sizeof(Value)) == 0);
}

bool is_same(const Surface& a, const Surface& b) {
  return same_bytes(a.positions, b.positions) && same_bytes(a.normals, b.normals) &&
         same_bytes(a.uvs, b.uvs) && same_bytes(a.triangles, b.triangles);
}

}  // namespace

void PoseTrack::add(const Pose& pose) {
  Quat orientation = pose.orientation;
  if (!orientations.empty() && orientations.back().dot(orientation) < 0)
    orientation.coeffs() = -orientation.coeffs();
  positions.push_back(pose.position);
  orientations.push_back(orientation);
}

void PoseTracks::add(const FrameValues& values) {
  times_.push_back(values.time);
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const ExportedBody& body = run_.bodies()[i];
    if (!body.is_rigid() || (body.kind == "static" && !tracks_[i].positions.empty())) continue;
    tracks_[i].add(values.rigid.at(static_cast<std::size_t>(body.row)).pose);
  }
}

const Vec3& LocalOrigin::follow(const std::vector<Vec3>& positions) {
  // Distance of the body's center up to which the origin stays, relative to the body's size. Floats lose
  // two bits of the shape by it, and doubling it costs another bit.
  constexpr double max_drift = 4;
  Eigen::AlignedBox3d box;
  for (const Vec3& x : positions) box.extend(x);
  if (box.isEmpty()) return place_;
  const Vec3 center = box.center();
  if (size_ < 0) {
    size_ = box.diagonal().norm();
    place_ = center;
  } else if ((center - place_).norm() > max_drift * size_) {
    place_ = center;
  }
  return place_;
}

bool CameraTrack::has_zoom() const {
  return std::any_of(vertical_fov.begin(), vertical_fov.end(),
                     [&](double fov) { return fov != vertical_fov.front(); });
}

CameraTrack camera_track(const ExportedRun& run, const std::vector<double>& times) {
  DUET_ASSERT(!times.empty());
  const scene::CameraPath path(run.looks().camera);
  CameraTrack track;
  for (const double time : times) {
    const scene::Camera camera = path.at(time);
    track.poses.add({run.scale() * (run.axes() * camera.position), run.axes() * orientation(camera)});
    track.vertical_fov.push_back(camera.vertical_fov * std::numbers::pi / 180);
    track.target_distances.push_back(run.scale() * (camera.target - camera.position).norm());
    if (run.looks().camera.keyframes.empty()) break;
  }
  return track;
}

std::vector<std::size_t> first_with_same_surface(const std::vector<ExportedBody>& bodies) {
  std::vector<std::size_t> first(bodies.size());
  std::unordered_multimap<std::uint64_t, std::size_t> known;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    first[i] = i;
    if (!bodies[i].is_rigid()) continue;
    const std::vector<Vec3>& positions = bodies[i].rest.positions;
    const std::uint64_t hash = hash_bytes(positions.data(), positions.size() * sizeof(Vec3));
    const auto [begin, end] = known.equal_range(hash);
    const auto same = std::find_if(
        begin, end, [&](const auto& entry) { return is_same(bodies[entry.second].rest, bodies[i].rest); });
    if (same == end)
      known.emplace(hash, i);
    else
      first[i] = same->second;
  }
  return first;
}

}  // namespace duet::io
