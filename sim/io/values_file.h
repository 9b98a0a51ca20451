// The numbers of a run in double precision, for exporters and for NumPy: values/bodies.npy holds the
// surfaces at rest, values/0000.npy the motion of a frame. Each file is one NumPy record (a structured
// array without dimensions), so that numpy.load(path)["position"] is an array.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/io/run_directory.h"
#include "sim/simulation/frame.h"

namespace duet {
class Simulation;
}

namespace duet::io {

/// Motion of all bodies at a frame. Rigid bodies have one row each, in the manifest's order. The points of
/// deformable bodies follow each other in the manifest's order: a body has as many points as its surface
/// has vertices. Names in quotes are those of the fields of the file.
struct FrameValues {
  int frame = 0;    ///< "frame": number of the frame
  double time = 0;  ///< "time": simulated time, s
  /// "position" (m), "orientation" (quaternion w, x, y, z), "velocity" (m/s) and "angular_velocity" (rad/s)
  /// of rigid bodies, in world axes.
  std::vector<RigidMotion> rigid;
  std::vector<Vec3> points;       ///< "point": positions of the points, m, world frame
  std::vector<Vec3f> velocities;  ///< "point_velocity": velocities of the points, m/s, world axes
  /// "strain": at each point the largest |principal stretch - 1| of the elements around it, without unit;
  /// -1 if one of them is inverted, 0 for bodies without strain.
  std::vector<float> strain;
  /// "stress": von Mises equivalent of the elastic stress at each point, Pa; 0 for bodies without finite
  /// elements. The files of programs before 30 November 2026 have neither this nor the next: both are empty.
  std::vector<float> stress;
  std::vector<float> energy_density;  ///< "energy_density": elastic energy over the volume at rest, J/m^3
};

/// Sets `values` to the motion at the frame that the simulation holds. `surfaces` are
/// Simulation::surfaces() of that frame.
void measure_values(const Simulation& simulation, const std::vector<BodySurface>& surfaces,
                    FrameValues& values);

/// Sets Surface::strain of those `bodies` that have a strain. `listed` are their entries in the manifest,
/// in the same order.
void take_strain(const FrameValues& values, const std::vector<ManifestBody>& listed,
                 std::vector<BodySurface>& bodies);

/// Returns the bytes of values/0000.npy, the file of a frame.
std::string npy_text(const FrameValues& values);

/// Returns the bytes of values/bodies.npy, with the fields "rest" (positions, m), "normal", "uv" and
/// "corner". A row of "corner" is a triangle: for each of its three corners the indices of position,
/// texture coordinate and normal, which count within the body.
std::string npy_text(const std::vector<BodySurface>& rest);

/// Reads the file of a frame. `listed` are the manifest's bodies. Throws FileError if the file is missing,
/// differs from what the journal lists, does not fit the bodies or the frame, or holds values that are not
/// finite or orientations that are not unit quaternions.
FrameValues read_values(const RunDirectory& run, const std::vector<ManifestBody>& listed, int frame);

/// Reads values/bodies.npy: the surfaces at rest, in the manifest's order. Rigid bodies are in the axes of
/// their poses, deformable bodies where they are at frame 0; m. `listed` are the manifest's bodies. Throws
/// FileError if the file is missing, differs from what the journal lists, does not fit the bodies, or holds
/// coordinates that are not finite or indices out of range.
std::vector<BodySurface> read_rest_surfaces(const RunDirectory& run, const std::vector<ManifestBody>& listed);

}  // namespace duet::io
