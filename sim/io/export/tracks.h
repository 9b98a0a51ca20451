// Poses of rigid bodies and of the camera, frame by frame, and origins of deformable bodies.
#pragma once

#include <vector>

#include "sim/io/export/exported_run.h"

namespace duet::io {

/// Poses at successive frames. Of the two quaternions of an orientation the track has the one whose scalar
/// product with that of the frame before is not negative, so that interpolation takes the shorter path.
struct PoseTrack {
  std::vector<Vec3> positions;     ///< positions, one for each frame
  std::vector<Quat> orientations;  ///< unit quaternions that take body axes to those of the export

  /// Appends a pose.
  void add(const Pose& pose);
};

/// Poses of a run's rigid bodies, in the axes and unit of the export.
class PoseTracks {
 public:
  /// Makes empty tracks. `run` has to outlive the object.
  explicit PoseTracks(const ExportedRun& run) : run_(run), tracks_(run.bodies().size()) {}

  /// Appends the poses at a frame.
  void add(const FrameValues& values);
  /// Returns the times of the frames that were added, s.
  const std::vector<double>& times() const { return times_; }
  /// Returns the track of a body, given by its index in ExportedRun::bodies(). Static bodies have one pose,
  /// deformable bodies have none.
  const PoseTrack& of(std::size_t body) const { return tracks_[body]; }

 private:
  const ExportedRun& run_;
  std::vector<PoseTrack> tracks_;
  std::vector<double> times_;
};

/// Origin to which the points of a deformable body are stored relative, so that floats hold the body's
/// shape. It is the center of the body's bounding box at the first frame. Once the center is farther from
/// it than 4 times the body's size, it moves to the center. It does not follow at every frame, so that
/// points at rest keep their values.
class LocalOrigin {
 public:
  /// Returns the origin for a frame, given the positions of the body's points. Frames have to come in
  /// order.
  const Vec3& follow(const std::vector<Vec3>& positions);
  /// Returns the size of the body: the diagonal of its bounding box at the first frame; -1 before.
  double size() const { return size_; }

 private:
  Vec3 place_ = Vec3::Zero();
  double size_ = -1;  // -1: before the first frame
};

/// The camera at successive times, in the axes and unit of the export.
struct CameraTrack {
  /// Poses: the camera looks along the negative z axis of its pose, and the y axis points up in the
  /// picture.
  PoseTrack poses;
  std::vector<double> vertical_fov;      ///< vertical angle of view, rad
  std::vector<double> target_distances;  ///< distance from the camera to its target, unit of the export

  /// Returns true if the angle of view changes.
  bool has_zoom() const;
};

/// Samples the camera of a run at `times` (s, at least one). A camera without keyframes has a single
/// sample.
CameraTrack camera_track(const ExportedRun& run, const std::vector<double>& times);

/// Returns for each body the index of the first rigid body whose surface at rest has the same bits; its own
/// index if there is none before it, or if the body is deformable.
std::vector<std::size_t> first_with_same_surface(const std::vector<ExportedBody>& bodies);

}  // namespace duet::io
