// Tests that the reference and the reader agree: every key of one is a key of the other.
#include <algorithm>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::scene::reference_test {
namespace {

// Returns "[[rigid]] shape.box" and the like for every key of the reference, with "top" for those before the
// first table.
std::set<std::string> keys_of_reference() {
  std::set<std::string> keys;
  std::string section;
  bool in_table = false;  // true below the line of column titles
  std::istringstream lines(reference());
  for (std::string line; std::getline(lines, line);) {
    const bool indented = line.starts_with("  ");
    if (!indented) {
      section = line.starts_with('[') ? line.substr(0, line.find(": ")) : "top";
      in_table = false;
    } else if (line.starts_with("  key ")) {
      in_table = true;
    } else if (in_table && line[2] != ' ') {
      keys.insert(section + " " + line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return keys;
}

// A scene with every key, none of which has its default value.
const char* const full_scene = R"(
title = "All keys"
figure = "7"
frames = 12
fps = 30
gravity = [0, -1.6, 0]

[materials.NAME]
density = 900
youngs_modulus = 3e5
poisson_ratio = 0.3
damping = 0.02
springs = { stiffness = 30, damping = 0.5 }
bending_springs = { stiffness = 3, damping = 0.6 }
bending_factor = 2

[materials.SOLID]
mass_damping = 0.1
model = "corotated"

[[rigid]]
name = "ball"
shape = { sphere = 2 }
position = [0, 5, 0]
rotation = { axis = [0, 0, 1], degrees = 45 }
velocity = [1, 0, 0]
angular_velocity = [0, 1, 0]
density = 700
friction = 0.1
restitution = 0.9
rolling_friction = 0.001
spinning_friction = 0.001
terminal_speed = 20
look = "NAME"

[[rigid]]
name = "wall"
shape = { box = [1, 2, 3] }
static = true

[[rigid]]
name = "brick"
shape = { box = [1, 2, 3] }
mass = 4
sample_spacing = 0.25
repeat = { count = 1, step = [1, 0, 0] }

[[rigid]]
name = "pill"
shape = { capsule = { radius = 1, length = 2 } }
mass = 4

[[rigid]]
name = "can"
shape = { cylinder = { radius = 1, height = 2 } }
mass = 4

[[rigid]]
name = "ring"
shape = { torus = { radius = 1, tube = 0.5 } }
mass = 4

[[rigid]]
name = "wheel"
shape = { cylinder = { radius = 1, height = 2 } }
motion = { keyframes = [{ time = 0, position = [0, 0, 0], rotation = { axis = [1, 0, 0], degrees = 3 } }, { time = 1, position = [1, 0, 0], velocity = [1, 0, 0], rotation = { axis = [1, 0, 0], degrees = 3 } }, { time = 2, position = [0, 0, 0], rotation = { axis = [0, 1, 0], degrees = 0 } }], loop = false, spin = { axis = [0, 0, 1], rate = 2, start = 1, stop = 3, ramp = 0.5 }, sinusoid = [{ amplitude = [0, 1, 0], rotation = { axis = [1, 0, 0], degrees = 3 }, frequency = 2, phase = 90, start = 1, stop = 2 }] }

[[rigid]]
name = "slide"
shape = { box = [1, 2, 3] }
motion = { keyframes = [{ time = 1, position = [0, 0, 0] }, { time = 2, position = [0, 0, 1] }, { time = 3, position = [0, 0, 0] }], interpolation = "linear", loop = true }

[[rigid]]
name = "bowl"
shape = { mesh = "bowl.obj", scale = 2, cells = 32 }
mass = 4

[[deformable]]
name = "jelly"
shape = { box = [1, 1, 2], cells = [2, 2, 4], pattern = "six" }
position = [4, 4, 4]
rotation = { axis = [1, 0, 0], degrees = -30 }
velocity = [0, 2, 0]
angular_velocity = [0, 0, 3]
material = "NAME"
mass = 12
terminal_speed = 30
incompressible = true
self_collision = true
collision_thickness = 0.01
collision_friction = 0.3
look = "NAME"
attach = ["brick"]
attach_springs = { gain = 100, damping = 0.5 }
skin = { mesh = "knot.obj", scale = 2, contact = true, mass = 3 }
repeat = { count = 1, step = [1, 0, 0] }

[[deformable]]
name = "cloth"
shape = { panel = { size = [1, 2], cells = [3, 4] } }
thickness = 0.01
pins = [{ from = [0.5, 0, 0], to = [0.5, 0, 1], radius = 0.1, body = "wheel" }]
material = "NAME"

[[deformable]]
name = "round"
shape = { disc = { radius = 1, rings = 5 } }
thickness = 0.01
material = "NAME"

[[deformable]]
name = "rope"
shape = { rod = { points = [[0, 0, 0], [1, 0, 0], [1, 1, 0]], closed = true, segments = 30 } }
thickness = 0.01
material = "NAME"

[[deformable]]
name = "coil"
shape = { helix = { radius = 1, pitch = 0.2, turns = 3, segments = 40 } }
thickness = 0.01
material = "NAME"

[[deformable]]
name = "trefoil"
shape = { knot = { radius = 1, tube = 0.4, winding = [3, 2], segments = 50 } }
thickness = 0.01
material = "NAME"

[[deformable]]
name = "soft_knot"
shape = { mesh = "knot.obj", scale = 2, spacing = 0.05, graded = true }
drawn = "tetrahedra"
material = "SOLID"

[[deformable]]
name = "soft_ball"
shape = { sphere = 2 }
material = "NAME"

[[deformable]]
name = "soft_pill"
shape = { capsule = { radius = 1, length = 2 } }
material = "NAME"

[[deformable]]
name = "soft_can"
shape = { cylinder = { radius = 1, height = 2 } }
material = "NAME"

[[deformable]]
name = "soft_ring"
shape = { torus = { radius = 2, tube = 1 } }
material = "NAME"

[[deformable]]
name = "bead"
shape = { particle = 0.1 }
material = "NAME"

[[deformable]]
name = "meshed"
shape = { tets = "meshed.msh", scale = 3 }
material = "NAME"

[[prefabs.thing.rigid]]
name = "part"
shape = { sphere = 1 }
mass = 1

[[instances]]
name = "things"
prefab = "thing"
position = [9, 0, 0]
rotation = { axis = [0, 0, 1], degrees = 5 }
scale = 2
grid = [2, 1, 1]
step = [3, 0, 0]
seed = 4

[[instances]]
name = "heap"
prefab = "thing"
scatter = { count = 2, size = [1, 1, 1], lower = [0, 0, 0], upper = [9, 9, 9], turn = false }

[[joints]]
name = "ball"
type = "point"
parent = "brick"
child = "pill"
position = [0, 0, 0]
swing = 60
friction = 0.2
collide = true
control = { gain = 50, damping = 3, torque_limit = 9, x = false, y = true, z = true, lead = true, target = { turn = [1, 2, 3], turn_rate = [0, 1, 0], start = 0.5, sinusoid = [{ turn = [0, 4, 0], period = 2, phase = 30 }], keyframes = [{ time = 0, turn = [0, 0, 0] }, { time = 1, turn = [0, 5, 0] }, { time = 2, turn = [0, 0, 0] }], loop = true, wave = { place = 1, spacing = 0.5, wavelength = 4, period = 2, bend = 0.3, height = 0.1 } } }
repeat = { count = 1, step = [1, 0, 0] }

[[joints]]
name = "slider"
type = "prismatic"
parent = "can"
child = "ring"
parent_frame = { position = [0, 1, 0], axis = [0, 1, 0], up = [1, 0, 0] }
child_frame = { position = [0, 1, 0], axis = [0, 1, 0], up = [1, 0, 0] }
travel = { least = -1, most = 2 }
control = { target = { travel = 0.1, travel_rate = 0, sinusoid = { travel = 0.2, period = 1 }, keyframes = [{ time = 0, travel = 0 }, { time = 1, travel = 0.1 }] } }

[[joints]]
name = "door"
type = "hinge"
parent = "wall"
child = "bowl"
position = [1, 0, 0]
axis = [0, 1, 0]
up = [0, 0, 1]
angle = { least = -90, most = 90 }

[ground]
height = -1
friction = 0.8
restitution = 0.2
rolling_friction = 0.001
spinning_friction = 0.001
look = "NAME"

[solver]
accuracy = "fine"
cfl = 0.8
compression = "damped"
relaxation = 0.05
max_travel = 0.2
max_rotation = 0.5
max_time_step = 0.01
max_substeps = 5000
damping_at = 0.6
cg_tolerance = 1e-4
cg_iterations = 77
volume_tolerance = 1e-3
pressure_iterations = 50
collision_iterations = 6
contact_iterations = 33
whole_islands = false
push_out_iterations = 5
push_out_sweeps = 12
push_out_gradual = false
push_out_order = "frozen_levels"
velocity_constraints = "after_solve"
rigid_push_out = "deepest_points"
shock_propagation = "on"
initial_overlap = "refuse"
projection_iterations = 3
integration = "implicit"
newton_iterations = 9
face_samples = 1
deformable_collision = false
contact_reduction = false
orientation = "first_order"
keep_spin = false

[camera]
position = [5, 5, 5]
target = [0, 1, 0]
up = [0, 1, 0.1]
vertical_fov = 50
keyframes = [{ time = 1 }, { time = 2, position = [4, 5, 5], target = [0, 2, 0], vertical_fov = 40 }]

[[lights]]
name = "lamp"
kind = "area"
position = [3, 9, 3]
target = [0, 1, 0]
radius = 2
power = 50
color = [1, 0.9, 0.8]
shadow = false

[sky]
zenith = [0.1, 0.2, 3]
horizon = [1, 1, 1]
intensity = 0.7

[looks.NAME]
color = [0.1, 0.2, 0.3]
metallic = 1
roughness = 0.1
pattern = "checker"
color2 = [1, 1, 1]
pattern_size = 0.5
opacity = 0.5
spots = [[0, 0, 0.1]]

[render]
width = 320
height = 200
supersampling = 1
shadow_samples = 4
exposure = 2
color = "stress"
strain_range = 0.2
color_range = 3e4

[output]
formats = ["obj", "usd"]
)";

std::set<std::string> keys_of_full_scene() {
  std::set<std::string> keys;
  std::string section = "top";
  std::istringstream lines(full_scene);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("[[prefabs"))
      section.clear();  // Prefabs hold tables of the other kinds.
    else if (line.starts_with('['))
      section = line == "[materials.SOLID]" ? "[materials.NAME]" : line;
    std::vector<std::string> outer;  // {"shape", "shape.capsule"} within `shape = { capsule = { radius = 2`
    std::string last;                // key whose value comes next
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '{') outer.push_back(last);
      if (line[i] == '}') {
        last = outer.back();
        outer.pop_back();
      }
      if (line.compare(i, 3, " = ") != 0) continue;
      const auto before = line.find_last_of(' ', i - 1);
      const std::string name = line.substr(before + 1, i - before - 1);  // npos + 1 is 0
      last = outer.empty() ? name : outer.back() + "." + name;
      if (!section.empty()) keys.insert(fmt::format("{} {}", section, last));
    }
  }
  return keys;
}

TEST(SceneReference, ListsExactlyTheKeysOfAFullScene) {
  const Scene scene = read_text(full_scene, "full.toml", {}, Meshes::leave).scene;
  EXPECT_EQ(scene.solver.orientation, OrientationUpdate::first_order);
  EXPECT_EQ(scene.looks[0].pattern, "checker");
  EXPECT_EQ(scene.deformable[0].shape.cells, Vec3i(2, 2, 4));
  EXPECT_EQ(scene.deformable[0].self_collision, true);
  EXPECT_EQ(scene.deformable[0].collision_thickness, 0.01);
  EXPECT_EQ(scene.deformable[0].collision_friction, 0.3);
  EXPECT_EQ(scene.deformable[1].shape.panel_cells, Eigen::Vector2i(3, 4));
  EXPECT_EQ(scene.deformable[1].pins.at(0).to, Vec3(0.5, 0, 1));
  EXPECT_EQ(scene.deformable[1].pins.at(0).body, "wheel");
  EXPECT_EQ(scene.deformable[3].shape.points.size(), 3U);
  EXPECT_TRUE(scene.materials[0].has_springs && scene.materials[0].has_bending_springs);
  const auto wheel = std::find_if(scene.rigid.begin(), scene.rigid.end(),
                                  [](const RigidBody& body) { return body.name == "wheel"; });
  ASSERT_TRUE(wheel != scene.rigid.end() && wheel->is_kinematic);
  ASSERT_EQ(wheel->motion.keyframes.size(), 3U);
  EXPECT_FALSE(wheel->motion.keyframes[0].velocity);
  EXPECT_EQ(*wheel->motion.keyframes[1].velocity, Vec3(1, 0, 0));
  EXPECT_EQ(wheel->motion.keyframes[2].rotation.axis, Vec3(0, 1, 0));
  EXPECT_EQ(wheel->motion.spin.at(0).stop, 3);
  EXPECT_EQ(wheel->motion.sinusoid.at(0).phase, 90);
  EXPECT_EQ(keys_of_reference(), keys_of_full_scene());
}

TEST(SceneReference, EveryKeyIsKnownToTheReader) {
  for (const std::string& entry : keys_of_reference()) {
    SCOPED_TRACE(entry);
    const auto space = entry.find(' ');
    const std::string section = entry.substr(0, space), key = entry.substr(space + 1);
    // No key takes a date, so that the message tells a known key from an unknown one.
    const std::string text = fmt::format("{}\n{} = 2024-02-29\n", section == "top" ? "" : section, key);
    try {
      read_text(text, "one.toml");
      ADD_FAILURE() << "accepted: " << text;
    } catch (const SceneError& error) {
      int known = 0;
      for (const SceneProblem& problem : error.problems()) {
        EXPECT_NE(problem.message, "unknown key") << problem.text();
        known += problem.key.ends_with(key) && problem.message.starts_with("must be") ? 1 : 0;
      }
      EXPECT_EQ(known, 1) << error.what();
    }
  }
}

TEST(SceneReference, ShowsThePresetsWhereTheyDiffer) {
  const std::string text = reference();
  EXPECT_NE(text.find("0.9 / 0.7 / 0.175"), std::string::npos);
  EXPECT_NE(text.find("in (-1, 0.5)"), std::string::npos);
  EXPECT_NE(text.find("linear RGB, not sRGB"), std::string::npos);
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 112u) << line;
}

}  // namespace
}  // namespace duet::scene::reference_test
