// The specification of a study: a scene, knobs (settings to vary) and measures of their effect. It is read
// from a TOML file as strictly as a scene is.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/commands.h"

#include "sim/base/types.h"

namespace duet::study {

// Kinds of measures: what is compared with what, and the unit of the error.
enum class MeasureKind {
  slide,       // distance that a body slides down a slope with Coulomb friction; relative to the closed form
  free_top,    // orientation of a box without torque against the closed form; rad
  pendulum,    // angle of a rigid body that swings on the scene's first joint against the closed form; rad
  cantilever,  // sag of the center of mass of a clamped beam at rest (Timoshenko); relative
  // Center of mass of a clamped bar that is suddenly loaded by its weight; relative to its sag at rest.
  vibrating_bar,
  state,        // root mean square distance of particles and rigid bodies from the reference; m
  centers,      // root mean square distance of centers of mass from the reference, for meshes that differ; m
  penetration,  // deepest penetration at the end of a frame; m
  energy,       // largest change of the total energy; relative to the largest kinetic energy
  // Largest rise of the total energy above an earlier frame; relative to the largest kinetic energy.
  energy_gain,
  momentum,  // largest change of the momentum; relative to sqrt(2 m E) for the largest kinetic energy E
  angular_momentum,  // largest change of the angular momentum; relative to its start
  joints,            // widest gap of a joint at the end; m
  volume,            // largest relative error of the volume of an incompressible body
  image              // picture of the last frame against that of the reference; RMSE of sRGB values in [0, 1]
};

// An error that is measured for every setting.
struct Measure {
  std::string name;
  MeasureKind kind = MeasureKind::state;  // what is compared with what
  // Name of the body whose motion is measured; empty (state and centres only): all that move.
  std::string body;
  double slope = 0;     // degrees about z; a slide goes towards -x
  double friction = 0;  // coefficient of a slide
  double floor = 0;     // errors up to this are rounding, and left out of orders
};

// Returns whether the kind compares with a reference run.
bool needs_reference(MeasureKind kind);
// Returns the unit of the error: "m", "rad", or "" if it is relative.
std::string unit_of(MeasureKind kind);

// A change of the scene.
struct Change {
  std::string label;                 // text in charts and tables: "1/96 s"
  std::vector<std::string> set;      // "key=value"
  std::vector<std::string> without;  // names of effects that are left out
  std::optional<double> number;      // value as a number; of an array the largest; empty: it is none
};

// Selects what the order of convergence of errors is fitted along: nothing, the time step, or the size of
// cells.
enum class OrderOf { none, steps, cells };

// Changes that form one line in charts: values of one key, or settings.
struct Knob {
  std::string name;
  std::vector<Change> values;     // each includes the changes that all share
  OrderOf order = OrderOf::none;  // what orders of convergence are fitted along
  bool pictures = false;          // show the last frame of each value
};

// Selects what is timed, in processor seconds: a simulated second, or a picture of the last frame.
enum class Cost { simulation, drawing };
// The cost that does not depend on the machine: substeps, or (substeps + CG iterations) times unknowns.
enum class Count { steps, iterations };

// A study. Keys of the file have the names of the members.
struct Spec {
  std::string path, title, about;  // path of the file; title and question of the report
  std::string scene;               // path, or name of a scene that ships
  Change base;                     // changes of all runs
  int frames = 1;                  // last frame of every run
  int repetitions = 5;             // timed runs of each setting
  double time_limit = 600;         // s, for each run
  Cost cost = Cost::simulation;    // what the seconds are measured of
  Count count = Count::steps;      // if drawing is measured, samples of pixels and shadow maps count instead
  bool effects = false;            // also run without each effect that the scene needs
  // Size of pictures in the report (pixels).
  int picture_width = 480, picture_height = 270;
  std::optional<Change> reference;  // of the run that others are compared with; empty: none
  std::vector<Measure> measures;    // at least one
  std::vector<Knob> knobs;          // empty only with `effects`
};

// Reads the specification of a study. Throws SceneError with every problem and its file, line and column;
// FileError if the file cannot be read.
Spec read_spec(const std::string& path);

// Returns the scene with the changes of the study, then those of `change`.
tools::SceneChoice scene_of(const Spec& spec, const Change& change);

}  // namespace duet::study
