// Defines the keys of joints, repetitions and instances.
#include "sim/scene/schema_parts.h"

namespace duet::scene {
namespace {

constexpr double max_seed = 2e9;  // fits into an int

// Bounds of the angle of a joint, degrees.
const Bounds turns{.lower = -180, .upper = 180};

Key interval_key(std::string_view name, Interval& interval, std::string_view unit, const Bounds& bounds,
                 std::string_view meaning) {
  return {name,
          Group{{{"least", &interval.least, unit, bounds, "lower bound; without it, none"},
                 {"most", &interval.most, unit, bounds, "upper bound; without it, none"}}},
          "", any, meaning};
}

Key frame_key(std::string_view name, JointAxes& frame, bool& given, std::string_view meaning) {
  return {name,
          Group{{{"position", &frame.position, "m", any, "of the joint; without it, the origin"},
                 {"axis", &frame.axis, "", any, "x of the joint; any length but 0"},
                 {"up", &frame.up, "", any, "y of the joint; not along the axis"}},
                &given},
          "", any, meaning};
}

Key target_key(JointTarget& target) {
  return {
      "target",
      Group{{{"turn", &target.turn, "degrees", any, "rotation vector in the joint's axes, from the parent"},
             {"travel", &target.travel, "m", any, "along x; prismatic joints only"},
             {"turn_rate", &target.turn_rate, "degrees/s", any,
              "turns at a constant rate from `start` on, added to the rest"},
             {"travel_rate", &target.travel_rate, "m/s", any,
              "moves along x at a constant speed from `start` on; prismatic joints only"},
             {"start", &target.start, "s", non_negative,
              "when the functions of time begin; before, the target grows to their first value"},
             {"sinusoid", list(target.sinusoid), "", any, "swings to and fro, added to the rest"},
             {"keyframes", list(target.keyframes), "", any,
              "values at times, smooth between, added to the rest"},
             {"loop", &target.loop, "", any, "the keyframes repeat; the last one is the first one again"},
             {"wave",
              Group{{{"place", &target.wave.place, "m", any, "of the joint along the spine", required},
                     {"spacing", &target.wave.spacing, "m", positive, "to the joints before and after",
                      required},
                     {"wavelength", &target.wave.wavelength, "m", positive, "along the spine", required},
                     {"period", &target.wave.period, "s", positive, "of the wave", required},
                     {"bend", &target.wave.bend, "m", any, "amplitude to the sides, along z"},
                     {"height", &target.wave.height, "m", any, "amplitude upward, along y"}},
                    &target.has_wave},
              "", any, "the bend of a wave that travels along a spine: x along it, y upward"}}},
      "", any, "what the joint is to do; without it, to be as its frames are"};
}

Key control_key(Joint& joint) {
  JointControl& control = joint.control;
  return {"control",
          Group{{{"gain", &control.gain, "1/s^2", non_negative,
                  "k_p: the error e obeys e'' + k_v e' + k_p e = 0; 0: a motor that knows speeds alone"},
                 {"damping", &control.damping, "1/s", non_negative, "k_v; without it, critical: 2 sqrt(k_p)"},
                 {"torque_limit", &control.torque_limit, "N m", positive,
                  "most about each axis (N of a travel); without it, whatever it takes"},
                 {"x", &control.x, "", any, "whether it controls the rotation about x; else that is free"},
                 {"y", &control.y, "", any, "the same about y"},
                 {"z", &control.z, "", any, "the same about z; point joints only"},
                 {"lead", &control.lead, "", any,
                  "knows how fast the target moves, and does not lag by 2 / sqrt(k_p) behind it"},
                 target_key(control.target)},
                &joint.has_control},
          "", any, "proportional-derivative control of the joint's rotation, or of a prismatic one's travel"};
}

}  // namespace

std::vector<Key> keys(TargetSinusoid& swing) {
  return {
      {"turn", &swing.turn, "degrees", any, "amplitude, a rotation vector in the joint's axes"},
      {"travel", &swing.travel, "m", any, "amplitude along x; prismatic joints only"},
      {"period", &swing.period, "s", positive, "of a full swing", required},
      {"phase", &swing.phase, "degrees", any, "where in the swing it starts: 0 in the middle, 90 at the end"},
  };
}

std::vector<Key> keys(TargetKey& key) {
  return {
      {"time", &key.time, "s", any, "after the start; later than that of the one before it", required},
      {"turn", &key.turn, "degrees", any, "at that time"},
      {"travel", &key.travel, "m", any, "at that time; prismatic joints only"},
  };
}

std::vector<Key> keys(JointEntry& entry) {
  Joint& joint = entry.joint;
  return {
      {"name", Name{&joint.name}, "", any, "unique among the joints", required},
      {"type",
       Choice{{"point", "hinge", "universal", "prismatic", "prismatic_twist", "weld"},
              static_cast<std::size_t>(joint.type),
              [&joint](std::size_t i) { joint.type = static_cast<JointType>(i); }},
       "", any, "leaves free: turning; turning about x; about x and the child's y; travel; the two; nothing",
       required},
      {"parent", &joint.parent, "", any, "name of a rigid body, or `ground`", required},
      {"child", &joint.child, "", any, "name of another rigid body", required},
      {"position", &joint.world.position, "m", any,
       "of the joint in the world at the start; this, or parent_frame and child_frame"},
      {"axis", &joint.world.axis, "", any, "x of the joint in the world at the start; any length but 0"},
      {"up", &joint.world.up, "", any, "y of the joint in the world; not along the axis"},
      frame_key("parent_frame", joint.parent_frame, joint.has_parent_frame,
                "the joint in the coordinates of the parent's shape"),
      frame_key("child_frame", joint.child_frame, joint.has_child_frame,
                "the joint in the coordinates of the child's shape"),
      interval_key("angle", joint.angle, "degrees", turns, "bounds of the angle; hinge and prismatic_twist"),
      {"swing",
       &joint.swing,
       "degrees",
       {.lower = 0, .upper = 180, .lower_open = true},
       "largest angle between the axes x of parent and child; point joints"},
      interval_key("travel", joint.travel, "m", any, "bounds of the travel; prismatic and prismatic_twist"),
      {"friction", &joint.friction, "N m", non_negative,
       "most torque about, and force (N) along, each axis that is free and not controlled"},
      {"collide", &joint.collide, "", any, "whether parent and child touch each other"},
      control_key(joint),
      repeat_key(entry.repeat),
  };
}

std::vector<Key> keys(Repetition& repetition) {
  return {
      {"count", &repetition.count, "", {.lower = 1, .upper = 1e5}, "of copies", required},
      {"step", &repetition.step, "m", any, "from one `position` to the next"},
  };
}

Key repeat_key(Repetition& repetition) {
  return {"repeat", Group{keys(repetition)}, "", any,
          "copies of the table: `{}` in its texts is the copy's number, `{+}` the next one"};
}

std::vector<Key> keys(Instance& instance) {
  Scatter& scatter = instance.scatter;
  return {
      {"name", Name{&instance.name}, "", any,
       "bodies are called NAME-body, those of many NAME1-body, NAME2-body and so on", required},
      {"prefab", &instance.prefab, "", any, "which of the prefabs it is", required},
      {"position", &instance.position, "m", any, "of the prefab's origin"},
      {"rotation",
       Group{{{"axis", &instance.rotation.axis, "", any, "any length but 0", required},
              {"degrees", &instance.rotation.degrees, "degrees", any, "angle", required}}},
       "", any, "of all of it about its origin"},
      {"scale", &instance.scale, "", positive, "on all lengths; masses grow with its third power"},
      {"grid", &instance.grid, "", {.lower = 1, .upper = 1e4}, "how many along x, y and z"},
      {"step", &instance.step, "m", any, "of the grid"},
      {"scatter",
       Group{{{"count", &scatter.count, "", {.lower = 1, .upper = 1e5}, "how many", required},
              {"size", &scatter.size, "m", positive,
               "edges of a box about the origin that keeps clear of others", required},
              {"lower", &scatter.lower, "m", any, "corner of the space for the boxes", required},
              {"upper", &scatter.upper, "m", any, "the opposite corner", required},
              {"turn", &scatter.turn, "", any, "with random rotations"}},
             &instance.has_scatter},
       "", any, "many at random places, clear of each other and of all scattered before"},
      {"seed", &instance.seed, "", Bounds{.lower = 0, .upper = max_seed}, "of the random numbers"},
  };
}

}  // namespace duet::scene
