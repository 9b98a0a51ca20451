#include "tools/farm/bodies.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/io/values_file.h"

namespace duet::farm {
namespace {

// A body while the frames of its run are read.
struct Track {
  bool is_rigid = true;
  std::size_t first = 0;                      // row of a rigid body, or first point of a deformable one
  std::vector<double> weights;                // of the points of a deformable body, with sum 1
  Vec3 start, place, velocity;                // m, m, m/s
  double path = 0, fastest = 0, turning = 0;  // m, m/s, rad/s
};

// Returns a third of the area of the triangles around each vertex, as parts of the whole. All vertices of a
// surface without area have the same part.
std::vector<double> area_weights(const Surface& surface) {
  std::vector<double> weights(surface.positions.size(), 0.0);
  double sum = 0;
  for (const auto& corners : surface.triangles) {
    const auto at = [&](int corner) {
      return surface.positions[static_cast<std::size_t>(corners[static_cast<std::size_t>(corner)].position)];
    };
    const double area = (at(1) - at(0)).cross(at(2) - at(0)).norm() / 2;
    for (const Corner& corner : corners) weights[static_cast<std::size_t>(corner.position)] += area / 3;
    sum += area;
  }
  for (double& weight : weights) weight = sum > 0 ? weight / sum : 1.0 / static_cast<double>(weights.size());
  return weights;
}

std::vector<Track> tracks_of(const io::RunDirectory& run, const std::vector<io::ManifestBody>& bodies) {
  const std::vector<BodySurface> rest = io::read_rest_surfaces(run, bodies);
  std::vector<Track> tracks;
  std::size_t rigid = 0, point = 0;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    Track track;
    track.is_rigid = !bodies[i].is_deformable();
    track.first = track.is_rigid ? rigid++ : point;
    if (!track.is_rigid) {
      track.weights = area_weights(rest[i].surface);
      point += track.weights.size();
    }
    tracks.push_back(std::move(track));
  }
  return tracks;
}

// Moves the body on to the next frame, or places it at frame 0.
void advance(const io::FrameValues& values, Track& track) {
  const Vec3 before = track.place;
  if (track.is_rigid) {
    const RigidMotion& motion = values.rigid[track.first];
    track.place = motion.pose.position;
    track.velocity = motion.velocity;
    track.turning = motion.angular_velocity.norm();
  } else {
    track.place = track.velocity = Vec3::Zero();
    for (std::size_t i = 0; i < track.weights.size(); ++i) {
      track.place += track.weights[i] * values.points[track.first + i];
      track.velocity += track.weights[i] * values.velocities[track.first + i].cast<double>();
    }
  }
  if (values.frame == 0)
    track.start = track.place;
  else
    track.path += (track.place - before).norm();
  track.fastest = std::max(track.fastest, track.velocity.norm());
}

BodyResult result_of(const io::ManifestBody& body, const Track& track) {
  return {body.name,
          body.kind,
          {track.place.x(), track.place.y(), track.place.z(), (track.place - track.start).norm(), track.path,
           track.velocity.norm(), track.fastest,
           track.is_rigid ? track.turning : std::numeric_limits<double>::quiet_NaN()}};
}

}  // namespace

const std::vector<Result>& body_results() {
  static const std::vector<Result> list = {{"x", "x at the end (m)"},
                                           {"y", "y at the end (m)"},
                                           {"z", "z at the end (m)"},
                                           {"moved", "distance from the start to the end (m)"},
                                           {"travelled", "length of the path (m)"},
                                           {"speed", "speed at the end (m/s)"},
                                           {"top_speed", "largest speed (m/s)"},
                                           {"spin", "angular speed at the end (rad/s)"}};
  return list;
}

std::vector<BodyResult> read_bodies(const io::RunDirectory& run, int last) {
  const std::vector<io::ManifestBody> bodies = io::read_manifest(run).bodies;
  std::vector<Track> tracks = tracks_of(run, bodies);
  for (int frame = 0; frame <= last; ++frame) {
    const io::FrameValues values = io::read_values(run, bodies, frame);
    for (Track& track : tracks) advance(values, track);
  }
  std::vector<BodyResult> results;
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (bodies[i].kind != "static") results.push_back(result_of(bodies[i], tracks[i]));
  return results;
}

}  // namespace duet::farm
