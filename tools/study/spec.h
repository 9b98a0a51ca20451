// What a study does: a scene, knobs to turn, and measures of what that changes. Read from a TOML file as
// strictly as a scene is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/commands.h"

#include "sim/base/types.h"

namespace duet::study {

// What is compared, and with what.
enum class MeasureKind {
  slide,          // the way of a body down a slope with Coulomb friction; relative to the way
  free_top,       // the orientation of a box without torque; rad
  pendulum,       // the angle of a rigid body that swings on the scene's first joint; rad
  cantilever,     // the sag of a clamped beam's centre of mass at rest (Timoshenko); relative
  vibrating_bar,  // the centre of mass of a clamped bar under its suddenly released weight; relative
  state,          // where the particles and rigid bodies are, to the reference; m, root of the mean square
  centres,        // the same of the bodies' centres of mass, for meshes that differ; m
  penetration,    // the deepest at any frame's end; m
  energy,         // the largest change of the total energy; relative to the largest kinetic energy
  energy_gain,    // the largest rise of the total energy; the same
  momentum,       // the largest change of the total momentum; relative to that of the largest kinetic energy
  angular_momentum,  // the same; relative to its start
  joints,            // the widest gap of a joint at the end; m
  volume,            // the largest relative error of an incompressible body's volume
  image              // the last frame's picture to that of the reference: RMSE of sRGB values in [0, 1]
};

struct Measure {
  std::string name;
  MeasureKind kind = MeasureKind::state;
  std::string body;     // whose motion the closed form gives; state and centres: empty for all that move
  double slope = 0;     // degrees about z, of a slide towards -x
  double friction = 0;  // of a slide
  double floor = 0;     // what is not told apart from rounding, and left out of orders
};

bool needs_reference(MeasureKind kind);
std::string unit_of(MeasureKind kind);  // "m", "rad", "" of what is relative

// What is changed in the scene.
struct Change {
  std::string label;                 // "1/96 s"
  std::vector<std::string> set;      // "key=value"
  std::vector<std::string> without;  // effects
  std::optional<double> number;      // the value, if it is one; the largest number of an array
};

// Along what an error's order of convergence is fitted.
enum class OrderOf { none, steps, cells };

struct Knob {
  std::string name;
  std::vector<Change> values;  // with what all of them share
  OrderOf order = OrderOf::none;
  bool pictures = false;
};

// Processor seconds per simulated second, or per picture of the last frame.
enum class Cost { simulation, drawing };
enum class Count {
  steps,
  iterations
};  // hardware-free cost: substeps, or (substeps + CG iterations) x unknowns

struct Spec {
  std::string path, title, about;
  std::string scene;  // path or name
  Change base;        // of all runs
  int frames = 1;
  int repetitions = 5;
  double time_limit = 600;  // s, of a run
  Cost cost = Cost::simulation;
  Count count = Count::steps;  // of drawing: samples of pixels and shadow maps
  bool effects = false;        // also with each effect left out that the scene calls for
  int picture_width = 480, picture_height = 270;
  std::optional<Change> reference;
  std::vector<Measure> measures;
  std::vector<Knob> knobs;
};

// Throws SceneError with every problem, each with file, line and column; FileError if it cannot be read.
Spec read_spec(const std::string& path);

// The scene of a run: the study's changes, then those of `change`.
tools::SceneChoice scene_of(const Spec& spec, const Change& change);

}  // namespace duet::study
