// The numbers of a run in double precision, for exporters and for NumPy: values/bodies.npy holds the
// surfaces at rest, values/0000.npy the motion of a frame. Each file is one NumPy record (a structured
// array without dimensions), so that numpy.load(path)["position"] is an array.
#pragma once

#include <string>
#include <vector>

#include "sim/base/types.h"
#include "sim/io/run_directory.h"
#include "sim/scene/picture.h"
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
  /// "contact_force" (N) and "contact_torque" (N m, about the center of mass) on rigid bodies,
  /// "point_contact_force" (N) and "contact_pressure" (Pa) at the points. All are means over the time since
  /// the frame before, world axes. The files of programs before December 2026 have none of them: all are
  /// empty.
  ContactLoads contact;
};

/// A quantity at the points of deformable bodies. Exporters write those of a run with a loop over
/// point_values; a quantity that a frame lacks is empty.
struct PointValue {
  using Scalars = std::vector<float>;  ///< values of a scalar
  using Vectors = std::vector<Vec3f>;  ///< values of a vector
  const char* name;                    ///< name in exports
  const char* meaning;                 ///< description with the unit
  /// Returns the values of a scalar, one a point; null for a vector.
  const Scalars& (*scalars)(const FrameValues& values);
  /// Returns the values of a vector, one a point, in the axes of `values`; null for a scalar.
  const Vectors& (*vectors)(const FrameValues& values) = nullptr;

  /// Returns whether a frame has the quantity: whether it has a value for each point.
  bool is_in(const FrameValues& values) const {
    return (scalars ? scalars(values).size() : vectors(values).size()) == values.points.size();
  }
};

/// The quantities at the points of deformable bodies, besides their positions and velocities.
inline constexpr PointValue point_values[] = {
    {"strain", "largest |principal stretch - 1| around each point; -1 where an element is inverted",
     [](const FrameValues& v) -> const PointValue::Scalars& { return v.strain; }},
    {"stress", "Pa: von Mises' equivalent of the elastic stress around each point",
     [](const FrameValues& v) -> const PointValue::Scalars& { return v.stress; }},
    {"energy_density", "J/m^3: elastic energy over the volume at rest around each point",
     [](const FrameValues& v) -> const PointValue::Scalars& { return v.energy_density; }},
    {"contact_pressure", "Pa: normal force of contact over area at each point, mean over the frame",
     [](const FrameValues& v) -> const PointValue::Scalars& { return v.contact.pressure; }},
    {"contact_force", "N: force of contact at each point, with friction, mean over the frame", nullptr,
     [](const FrameValues& v) -> const PointValue::Vectors& { return v.contact.force; }},
};

/// Sets `values` to the motion at the frame that the simulation holds. `surfaces` are
/// Simulation::surfaces() of that frame.
void measure_values(const Simulation& simulation, const std::vector<BodySurface>& surfaces,
                    FrameValues& values);

/// Sets Surface::strain of those `bodies` that have a strain. `listed` are their entries in the manifest,
/// in the same order.
void take_strain(const FrameValues& values, const std::vector<ManifestBody>& listed,
                 std::vector<BodySurface>& bodies);

/// Sets what pictures show as colors: Surface::strain, or Surface::shown of the deformable `bodies`. It stays
/// empty if `values` lack the quantity. `listed` are the entries of the bodies in the manifest.
void take_color(const FrameValues& values, const std::vector<ManifestBody>& listed, scene::ColorBy color,
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
