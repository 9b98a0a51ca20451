/// Poses of rigid bodies and of the camera, frame by frame.
#pragma once

#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// A pose a frame. Successive orientations are less than half a turn apart as quaternions (their scalar
/// product is not negative), so that interpolating them takes the shorter way.
struct PoseTrack {
  std::vector<Vec3> positions;
  std::vector<Quat> orientations;

  void add(const Pose& pose);
};

/// The poses of a run's bodies, in the order of ExportedRun::bodies().
class PoseTracks {
 public:
  explicit PoseTracks(const ExportedRun& run) : run_(run), tracks_(run.bodies().size()) {}

  void add(const FrameValues& values);
  const std::vector<double>& times() const { return times_; }  ///< s, of the frames added
  /// Static bodies have one pose, deformable ones none.
  const PoseTrack& of(std::size_t body) const { return tracks_[body]; }

 private:
  const ExportedRun& run_;
  std::vector<PoseTrack> tracks_;
  std::vector<double> times_;
};

/// The place that the points of a deformable body are stored relative to, so that floats keep the body's
/// shape: the center of the box around it, until it goes farther from there than 4 of its sizes (diagonals of
/// the box at first); then the center where it is. Staying put lets points that rest keep their values.
class LocalOrigin {
 public:
  /// The place for a frame; the frames have to come in order.
  const Vec3& follow(const std::vector<Vec3>& positions);
  double size() const { return size_; }  ///< of the body at the first frame

 private:
  Vec3 place_ = Vec3::Zero();
  double size_ = -1;  // before the first frame
};

/// The camera at each of some times, in the axes and unit of the export. It looks along the negative z axis
/// of its pose, and y of the pose points up in the picture.
struct CameraTrack {
  PoseTrack poses;
  std::vector<double> vertical_fov;      ///< rad
  std::vector<double> target_distances;  ///< from the camera to what it looks at

  bool has_zoom() const;  ///< whether vertical_fov changes
};

/// One sample if the camera has no keyframes, and otherwise one a time.
CameraTrack camera_track(const ExportedRun& run, const std::vector<double>& times);

/// For each body the index of the first rigid body with the same rest surface to the last bit, which is its
/// own index if there is none before it. Deformable bodies have their own.
std::vector<std::size_t> first_with_same_surface(const std::vector<ExportedBody>& bodies);

}  // namespace duet::io
