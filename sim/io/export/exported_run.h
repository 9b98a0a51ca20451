// A run as exporters read it: its bodies with surfaces at rest and looks, and their motion frame by frame,
// in the axes and the unit of length that the user chose.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "sim/geometry/mesh/surface.h"
#include "sim/io/run_directory.h"
#include "sim/io/values_file.h"
#include "sim/scene/scene.h"

namespace duet::io {

/// Choice of the user: the bodies and frames of a run to export, and the axes and unit of the export.
struct ExportChoice {
  /// Patterns of body names, in which * stands for any characters; empty: all bodies.
  std::vector<std::string> bodies;
  std::optional<int> first,  ///< first frame; none: the first that is there
      last;                  ///< last frame, inclusive; none: the last that is there
  /// Axis that points up in the export, 'y' or 'z'. For 'z' everything is rotated by 90 degrees about x.
  char up = 'y';
  double scale = 1;  ///< units of length of the export in a meter, 1/m
};

/// Looks, camera and lights of a scene. Values that the scene leaves out are those with which its pictures
/// are drawn.
struct ExportedLooks {
  std::vector<scene::Look> looks;  ///< looks of the bodies, with names that differ from each other
  std::vector<int> of_body;        ///< index into `looks` for each body of the manifest
  scene::Camera camera;            ///< camera with its keyframes; SI units and y up, whatever the export has
  std::vector<scene::Light> lights;  ///< lights; SI units and y up, whatever the export has
  int width = 1280,                  ///< width of a picture, pixels
      height = 720;                  ///< height of a picture, pixels
};

/// A body that is exported, with its surface at rest.
struct ExportedBody {
  std::string name;  ///< name in the scene
  std::string kind;  ///< "rigid", "kinematic", "static" or "deformable"
  int look = 0;      ///< index into ExportedLooks::looks
  /// Surface at rest, in the unit of the export. A rigid body's is in the axes of its pose, a deformable
  /// body's in the axes of the export, at frame 0.
  Surface rest;
  int row = -1;  ///< index in FrameValues::rigid of a rigid, kinematic or static body; -1: deformable
  std::size_t first_point = 0;  ///< index in FrameValues::points of a deformable body's first position

  /// Returns true if the body has a pose: if it is rigid, kinematic or static.
  bool is_rigid() const { return row >= 0; }
};

/// A run in the axes and unit of an export. Frames are read one at a time.
class ExportedRun {
 public:
  /// Reads the manifest and the surfaces at rest, and looks for the frames. Throws Error (usage) if a
  /// pattern matches no body or none of the chosen frames is there. Throws FileError if the run is damaged
  /// or has no values/.
  ExportedRun(RunDirectory run, const ExportChoice& choice);

  /// Returns the run directory.
  const RunDirectory& run() const { return run_; }
  /// Returns the manifest of the run, with all its bodies.
  const Manifest& manifest() const { return manifest_; }
  /// Returns the chosen bodies, in the order of the manifest.
  const std::vector<ExportedBody>& bodies() const { return bodies_; }
  /// Returns the chosen frames that are there, in ascending order. There is at least one.
  const std::vector<int>& frames() const { return frames_; }
  /// Returns the chosen frames that are missing, in ascending order. A bound that was not chosen is that of
  /// the frames that are there.
  const std::vector<int>& missing() const { return missing_; }
  /// Returns the looks, camera and lights. They are empty until set_looks().
  const ExportedLooks& looks() const { return looks_; }
  /// Sets the looks, camera and lights, and ExportedBody::look of all bodies.
  void set_looks(ExportedLooks looks);

  /// Returns the rotation that takes vectors from the run's axes (y up) to those of the export.
  const Quat& axes() const { return axes_; }
  /// Returns the vector `x`, given in the run's axes, rotated by axes(). The result is exact, without
  /// rounding.
  Vec3 turned(const Vec3& x) const { return up_ == 'z' ? Vec3(x.x(), 0 - x.z(), x.y()) : x; }
  /// Returns the units of length of the export in a meter, 1/m.
  double scale() const { return scale_; }
  /// Returns the axis of the export that points up, 'y' or 'z'.
  char up() const { return up_; }

  /// Reads the values of a frame, in the axes and unit of the export. Positions and velocities are scaled,
  /// angular velocities, strain, stress (Pa) and forces (N) are not. Throws FileError as read_values() does,
  /// and whatever the watch throws.
  FrameValues read(int frame) const;
  /// Sets a function that read() calls with the frame before it reads. It may show progress, or throw to
  /// end the export.
  void set_watch(std::function<void(int frame)> watch) { watch_ = std::move(watch); }

 private:
  RunDirectory run_;
  Manifest manifest_;
  std::vector<ExportedBody> bodies_;
  std::vector<int> body_rows_;  // for each exported body its index in the manifest
  std::vector<int> frames_, missing_;
  ExportedLooks looks_;
  std::function<void(int frame)> watch_;
  Quat axes_;
  double scale_;
  char up_;
};

/// Moves `surface` to the place of the body at a frame: sets its positions and normals. `surface` must be a
/// copy of body.rest, which may have been placed before. It may lack normals, or triangles and normals.
void place(const ExportedBody& body, const FrameValues& values, Surface& surface);

/// Sets `out` to the velocities of the positions of the body's surface, in the axes of the export and in
/// its unit of length per second. Those of a rigid body are v + w x r, with r from its center of mass.
void velocities(const ExportedBody& body, const FrameValues& values, std::vector<Vec3f>& out);

/// Returns true if the whole name matches the pattern, in which * stands for any characters, also none.
bool matches(std::string_view pattern, std::string_view name);

}  // namespace duet::io
