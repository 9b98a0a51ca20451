/// The numbers of a run in double precision, for exporters and for NumPy: values/bodies.npy holds the
/// surfaces at rest, values/0000.npy the motion of a frame. Each is one NumPy record (a structured array
/// without dimensions), so that numpy.load(path)["position"] is an array.
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

/// The motion of all bodies at a frame. Rigid bodies have a row each, in the manifest's order; the points of
/// deformable bodies follow each other in the manifest's order, as many a body as it has vertices.
struct FrameValues {
  int frame = 0;
  double time = 0;                 ///< s
  std::vector<RigidMotion> rigid;  ///< "position", "orientation" (w, x, y, z), "velocity", "angular_velocity"
  std::vector<Vec3> points;        ///< "point": m, world axes
  std::vector<Vec3f> velocities;   ///< "point_velocity": m/s, of the points
  std::vector<float> strain;       ///< "strain": of the points, negative where an element is inverted
};

/// Sets `values` to those of the frame that the simulation holds, whose surfaces are `surfaces`.
void measure_values(const Simulation& simulation, const std::vector<BodySurface>& surfaces,
                    FrameValues& values);

/// Sets the strain of those deformable bodies that have one. `listed` is the manifest's list of `bodies`.
void take_strain(const FrameValues& values, const std::vector<ManifestBody>& listed,
                 std::vector<BodySurface>& bodies);

/// The bytes of values/0000.npy.
std::string npy_text(const FrameValues& values);

/// The bytes of values/bodies.npy: fields "rest" (m), "normal", "uv", and "corner", whose rows are triangles
/// of three corners of indices into the body's rest positions, texture coordinates and normals.
std::string npy_text(const std::vector<BodySurface>& rest);

/// What values/0000.npy holds. Throws FileError where it is missing, damaged, or not of the manifest's
/// bodies.
FrameValues read_values(const RunDirectory& run, const std::vector<ManifestBody>& listed, int frame);

/// The surfaces of values/bodies.npy, in the manifest's order. Throws FileError as read_values does.
std::vector<BodySurface> read_rest_surfaces(const RunDirectory& run, const std::vector<ManifestBody>& listed);

}  // namespace duet::io
