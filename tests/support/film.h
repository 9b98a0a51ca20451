// A scene of the folder scenes/ that a test watches frame by frame.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/support/places.h"
#include "tests/support/scenes.h"

#include "sim/scene/reader/reader.h"
#include "sim/step/world.h"

namespace duet::test {

// The simulation of such a scene, with the worst measurements of its frames so far.
struct Film {
  scene::Scene scene;  // as read, with the overrides
  Simulation simulation;
  // Largest drift of a joint and largest penetration at the end of a frame (m).
  double gap = 0, penetration = 0;
  double least_det = 1;               // least determinant of a deformation gradient at the end of a frame
  std::vector<BodySurface> surfaces;  // scratch of centers()

  // Reads scenes/NAME.toml, changed by `overrides` ("key=value").
  explicit Film(const std::string& name, const std::vector<std::string>& overrides = {})
      : scene(scene::read(source_folder() + "/scenes/" + name + ".toml", overrides).scene),
        simulation(scene, plan(scene)) {}

  // Returns the bodies as they are now.
  const Bodies& bodies() { return simulation.world().bodies; }
  // Returns the state of the rigid body called `name`. Throws std::out_of_range if there is none.
  const RigidState& body(const std::string& name) {
    return bodies().rigid.state[index_of_name(bodies().rigid.name, name)];
  }
  // Returns the pose of the shape of the rigid body called `name`. Throws std::out_of_range if there is none.
  Pose pose(const std::string& name) {
    return shape_pose(bodies().rigid, index_of_name(bodies().rigid.name, name));
  }
  // Returns the means of the vertices (m) of all bodies whose names begin with `beginning`, in their order.
  std::vector<Vec3> centers(const std::string& beginning) {
    simulation.surfaces(surfaces);
    std::vector<Vec3> found;
    for (const BodySurface& body : surfaces) {
      if (!body.name.starts_with(beginning)) continue;
      Vec3 sum = Vec3::Zero();
      for (const Vec3& x : body.surface.positions) sum += x;
      found.push_back(sum / static_cast<double>(body.surface.positions.size()));
    }
    return found;
  }
  // Simulates `frames` frames and updates the worst measurements.
  void advance(int frames) {
    for (int i = 0; i < frames; ++i) {
      simulation.advance_frame();
      gap = std::max(gap, JointSolver::drift(bodies().articulation, bodies().rigid).gap);
      penetration = std::max(penetration, simulation.stats().max_penetration);
      least_det = std::min(least_det, simulation.stats().min_det_F);
    }
  }
};

// Returns the angle (rad) of a rotation about the x axis.
inline double turn_about_x(const Pose& pose) {
  return 2 * std::atan2(pose.orientation.x(), pose.orientation.w());
}

}  // namespace duet::test
