// One frame of a simulation, captured for Python: arrays that no later step changes.
#pragma once

#include <array>
#include <cstdint>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/io/run_directory.h"
#include "sim/io/values_file.h"
#include "sim/scene/scene.h"
#include "sim/simulation/simulation.h"

namespace duet::python {

// A range of rows of an array that belongs to one body.
struct Rows {
  std::size_t begin = 0, count = 0;
};

// What is equal in all frames of a simulation: bodies and which parts of the arrays are theirs.
struct Topology {
  struct Body {
    std::string name, kind;
    int rigid = -1;  // row of the arrays of rigid bodies; -1: the body is deformable
    Rows points,     // rows of the points of the surface
        triangles,   // rows of its triangles
        particles,   // rows of the particles; none for rigid bodies
        tetrahedra;  // rows of the tetrahedra; none for rigid bodies, shells and rods
  };
  std::vector<Body> bodies;                            // rigid, then deformable, in the order of the scene
  std::vector<std::array<std::int32_t, 3>> triangles,  // of all surfaces, as rows of the points of all bodies
      own_triangles;                                   // the same as rows of the points of their body
  std::vector<Tet> tetrahedra,                         // as rows of all particles
      own_tetrahedra;                                  // as rows of the particles of their body
  // The bodies with their boxes at frame 0, from which the renderer takes a view if the scene has no camera.
  std::vector<io::ManifestBody> listed;
  std::size_t rigid = 0;  // number of rigid bodies, without the ground
};

// The contacts of a frame that have an impulse, by columns.
struct Contacts {
  std::vector<Vec3> position,  // m
      normal,                  // unit, from the second body of a row to the first
      impulse;                 // N s, on the first body, in the last step of the frame
  // Guest and host as rows of Topology::bodies; -1: the ground.
  std::vector<std::array<std::int32_t, 2>> bodies;
};

// The state at one frame. Positions in m, velocities in m/s and rad/s, world axes.
struct FrameData {
  std::shared_ptr<const Topology> topology;
  FrameStats stats;
  std::vector<Vec3> points, velocities;  // of the surfaces of all bodies
  // For each of io::point_values its numbers at the points, 0 for rigid bodies: one a scalar, three a vector.
  std::array<std::vector<float>, std::size(io::point_values)> point_values;
  std::vector<Vec3> contact_forces, contact_torques;                  // on rigid bodies, N and N m
  std::vector<Vec3> positions, rigid_velocities, angular_velocities;  // of rigid bodies
  std::vector<std::array<double, 4>> orientations;                    // quaternions w, x, y, z
  std::vector<std::array<double, 16>> transforms;                     // body to world, 4 x 4, row by row
  std::vector<Vec3> particles, particle_velocities;
  Contacts contacts;
  std::vector<BodySurface> surfaces;  // for the renderer
};

// Returns what is equal in all frames of a simulation of `scene`. `before` is what was equal before a body
// was released; null at the beginning.
std::shared_ptr<const Topology> topology_of(const Simulation& simulation, const scene::Scene& scene,
                                            const Topology* before);

// Returns the current frame of a simulation.
std::shared_ptr<FrameData> capture(const Simulation& simulation, std::shared_ptr<const Topology> topology);

}  // namespace duet::python
