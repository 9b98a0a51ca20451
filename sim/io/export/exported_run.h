/// A run as exporters read it: its bodies with their surfaces at rest and looks, and frame by frame where
/// they are, in the axes and the unit of length that were asked for.
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

/// Which bodies and frames of a run are exported, and in which axes and unit.
struct ExportChoice {
  std::vector<std::string>
      bodies;  ///< patterns of names, in which * stands for any characters; none: all bodies
  std::optional<int> first, last;  ///< frames; none: all that are there
  char up = 'y';     ///< axis that points up in the export, 'y' or 'z'; a turn about x, nothing mirrored
  double scale = 1;  ///< units of the export in a meter
};

/// What a scene says of pictures, with what it leaves out filled in as pictures have it.
struct ExportedLooks {
  std::vector<scene::Look> looks;  ///< each with a name; the names differ
  std::vector<int> of_body;        ///< index into looks, for each body of the manifest
  scene::Camera camera;            ///< with its keyframes; SI units, y up, whatever was asked for
  std::vector<scene::Light> lights;
  int width = 1280, height = 720;  ///< pixels of a picture
};

struct ExportedBody {
  std::string name;
  std::string kind;  ///< "rigid", "kinematic", "static" or "deformable"
  int look = 0;      ///< index into ExportedLooks::looks
  /// At rest, in the unit of the export: a rigid body in the axes of its pose, a deformable one at frame 0.
  Surface rest;
  int row = -1;                 ///< of a rigid body: its index in FrameValues::rigid
  std::size_t first_point = 0;  ///< of a deformable body: where its positions begin in FrameValues::points

  bool is_rigid() const { return row >= 0; }
};

class ExportedRun {
 public:
  /// Throws Error (usage) where a pattern matches no body or no frame of the range is there, FileError where
  /// the run is damaged or has no values/.
  ExportedRun(RunDirectory run, const ExportChoice& choice);

  const RunDirectory& run() const { return run_; }
  const Manifest& manifest() const { return manifest_; }
  const std::vector<ExportedBody>& bodies() const { return bodies_; }
  /// Frames that are there and asked for, in order, and those between the first and the last of them, or of
  /// those asked for, that are missing.
  const std::vector<int>& frames() const { return frames_; }
  const std::vector<int>& missing() const { return missing_; }
  /// The looks of bodies are indices into these. Empty until set, and the looks of all bodies 0.
  const ExportedLooks& looks() const { return looks_; }
  void set_looks(ExportedLooks looks);

  /// Turns a vector from the run's axes (y up) to those of the export.
  const Quat& axes() const { return axes_; }
  /// A vector turned like this, without rounding.
  Vec3 turned(const Vec3& x) const { return up_ == 'z' ? Vec3(x.x(), 0 - x.z(), x.y()) : x; }
  double scale() const { return scale_; }  ///< units of the export in a meter
  char up() const { return up_; }

  /// The values of a frame in the axes and unit of the export. Lengths are scaled, also those in velocities.
  FrameValues read(int frame) const;
  /// read() calls `watch` with its frame first, which may show progress, or throw to end the export.
  void set_watch(std::function<void(int frame)> watch) { watch_ = std::move(watch); }

 private:
  RunDirectory run_;
  Manifest manifest_;
  std::vector<ExportedBody> bodies_;
  std::vector<int> body_rows_;  // index of each exported body in the manifest
  std::vector<int> frames_, missing_;
  ExportedLooks looks_;
  std::function<void(int frame)> watch_;
  Quat axes_;
  double scale_;
  char up_;
};

/// Sets `surface`, which must be body.rest or a copy placed before, to where the body is: positions and
/// normals.
void place(const ExportedBody& body, const FrameValues& values, Surface& surface);

/// The velocities of the positions of the body's surface, m/s in the unit and axes of `values`.
void velocities(const ExportedBody& body, const FrameValues& values, std::vector<Vec3f>& out);

/// Whether the name is what the pattern says; * stands for any characters, also none.
bool matches(std::string_view pattern, std::string_view name);

}  // namespace duet::io
