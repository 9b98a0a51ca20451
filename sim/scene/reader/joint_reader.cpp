#include "sim/scene/reader/joint_reader.h"

#include <algorithm>
#include <numbers>
#include <optional>
#include <vector>

#include <fmt/format.h>

#include "sim/articulation/joint_rows.h"
#include "sim/base/elementary.h"
#include "sim/base/near_miss.h"
#include "sim/scene/joints.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

// Largest gap (m) and angle (rad) between the two frames of a joint at the start. The first step closes them.
constexpr double apart = 1e-4;
constexpr double askew = 1e-3;
// Largest difference of the first and the last keyframe of a target that repeats, degrees and m, which is
// that of rounded decimal numbers.
constexpr double same_value = 1e-9;

// Names of the types in messages, in the order of JointType.
constexpr std::string_view type_names[] = {"point",     "hinge",           "universal",
                                           "prismatic", "prismatic_twist", "weld"};

// Checks one joint.
class JointChecker {
 public:
  JointChecker(const Joint& joint, const Scene& scene, const toml::table& table, const std::string& path,
               Problems& problems)
      : joint_(joint), scene_(scene), table_(table), path_(path), problems_(problems) {}

  void check() {
    const bool named = check_bodies();
    const bool placed = check_frames();
    check_kind();
    check_bounds("angle", joint_.angle);
    check_bounds("travel", joint_.travel);
    check_control();
    if (named && placed) check_start();
  }

 private:
  void add(std::string_view key, std::string message, std::string hint) {
    problems_.add(place_of(table_, key), join_path(path_, key), std::move(message), std::move(hint));
  }

  // Reports a key that does not apply to the type of the joint.
  void reject(std::string_view key, bool applies) {
    if (applies || !table_.contains(key)) return;
    add(key, fmt::format("has no effect on a {} joint", type_names[static_cast<std::size_t>(joint_.type)]),
        "remove it, or choose another type");
  }

  // Returns the rigid body of this name; null if there is none.
  const RigidBody* body(const std::string& name) const {
    const auto found = std::find_if(scene_.rigid.begin(), scene_.rigid.end(),
                                    [&](const RigidBody& b) { return b.name == name; });
    return found == scene_.rigid.end() ? nullptr : &*found;
  }

  bool exists(const std::string& name) const {
    return body(name) || (name == "ground" && scene_.ground.has_value());
  }

  // Reports flaws of the names of the two bodies. Returns whether both exist, differ, and one is dynamic.
  bool check_bodies() {
    std::vector<std::string> names;
    for (const RigidBody& b : scene_.rigid) names.push_back(b.name);
    if (scene_.ground) names.emplace_back("ground");
    const auto known = [&](std::string_view key, const std::string& name) {
      if (name.empty() || exists(name)) return !name.empty();
      if (name == "ground") {
        add(key, "is the ground, and the scene has none", "add [ground], or name a static body");
        return false;
      }
      const std::string hint = did_you_mean(name, names);
      add(key, fmt::format("no rigid body is called `{}`", name),
          hint.empty() ? "joints connect rigid bodies" : hint);
      return false;
    };
    const bool parent = known("parent", joint_.parent), child = known("child", joint_.child);
    if (!parent || !child) return false;
    if (joint_.parent == joint_.child) {
      add("child", fmt::format("is the parent, `{}`", joint_.parent), "a joint connects two bodies");
      return false;
    }
    const auto moves = [&](const std::string& name) {
      const RigidBody* b = body(name);
      return b && !b->is_static && !b->is_kinematic;
    };
    if (moves(joint_.parent) || moves(joint_.child)) return true;
    add("child", "neither it nor the parent is a dynamic body: nothing can move for the joint's sake",
        "one of them needs a mass or density");
    return false;
  }

  // Reports an axis or `up` that gives no frame. Returns whether there is none.
  bool check_axes(const JointAxes& axes, const std::string& path, const toml::table& table) {
    if (axes.axis.squaredNorm() == 0) {
      problems_.add(place_of(table, "axis"), join_path(path, "axis"), "has zero length",
                    "any direction, for example [0, 0, 1]");
      return false;
    }
    // The sine of the angle; below 1e-6 rounding of the coordinates would turn the frame.
    if (!axes.up || axes.axis.normalized().cross(axes.up->normalized()).norm() > 1e-6) return true;
    problems_.add(place_of(table, "up"), join_path(path, "up"), "is along the axis, or zero",
                  "any direction across the axis");
    return false;
  }

  // Reports flaws of the position and frames. Returns whether there are none.
  bool check_frames() {
    const bool in_world = table_.contains("position");
    const bool in_bodies = table_.contains("parent_frame") && table_.contains("child_frame");
    const bool any_frame = table_.contains("parent_frame") || table_.contains("child_frame");
    if (in_world == in_bodies || (in_world && any_frame)) {
      problems_.add(table_.source(), path_,
                    in_world ? "has both a position in the world and frames in the bodies" : "has no place",
                    "give `position` (and `axis`), or both `parent_frame` and `child_frame`");
      return false;
    }
    if (in_world) return check_axes(joint_.world, path_, table_);
    for (const std::string_view key : {"axis", "up"})
      if (table_.contains(key))
        add(key, "has no effect beside frames in the bodies", "move it into the frames");
    bool good = true;
    for (const auto& [key, axes] :
         {std::pair("parent_frame", &joint_.parent_frame), std::pair("child_frame", &joint_.child_frame)})
      if (const toml::table* frame = table_[key].as_table())
        good = check_axes(*axes, join_path(path_, key), *frame) && good;
    return good;
  }

  void check_kind() {
    const auto kind = static_cast<JointKind>(joint_.type);
    reject("angle", twists(kind));
    reject("travel", travels(kind));
    reject("swing", kind == JointKind::point);
    reject("friction", kind != JointKind::weld);
    reject("control", kind != JointKind::weld);
  }

  void check_bounds(std::string_view key, const Interval& interval) {
    if (interval.least && interval.most && *interval.least >= *interval.most)
      add(key, fmt::format("its least {:.6g} is not below its most {:.6g}", *interval.least, *interval.most),
          "exchange the two");
  }

  // Reports flags of axes that the joint does not have, and control of no axis at all.
  void check_controlled_axes(const toml::table& control, const std::string& path) {
    const bool is_point = joint_.type == JointType::point, is_universal = joint_.type == JointType::universal;
    for (const std::string_view axis : {"x", "y", "z"}) {
      if (!control.contains(axis) || is_point || (is_universal && axis != "z")) continue;
      problems_.add(place_of(control, axis), join_path(path, axis),
                    is_universal ? "has no effect: a universal joint turns about x and y"
                                 : "has no effect: the joint has one axis",
                    "remove it");
    }
    const JointControl& flags = joint_.control;
    if ((is_point || is_universal) && !flags.x && !flags.y && (is_universal || !flags.z))
      add("control", "controls no axis",
          is_point ? "remove it, or let x, y or z be true" : "remove it, or let x or y be true");
  }

  void check_control() {
    const toml::table* control = table_["control"].as_table();
    if (!control) return;
    const std::string path = join_path(path_, "control");
    check_controlled_axes(*control, path);
    if (joint_.control.gain == 0 && !(joint_.control.damping.value_or(0) > 0))
      problems_.add(place_of(*control, "gain"), join_path(path, "gain"),
                    "is 0 without damping: nothing is controlled",
                    "set damping > 0, how fast a motor takes on its speed, in 1/s");
    const toml::table* target = (*control)["target"].as_table();
    if (!target) return;
    const bool slides = joint_.type == JointType::prismatic;
    const auto check_words = [&](const toml::table& table, const std::string& at) {
      for (const std::string_view ending : {"", "_rate"}) {
        const std::string wrong = fmt::format("{}{}", slides ? "turn" : "travel", ending);
        if (table.contains(wrong))
          problems_.add(place_of(table, wrong), join_path(at, wrong),
                        slides ? "has no effect on a prismatic joint" : "has no effect on a joint that turns",
                        fmt::format("use `{}{}`", slides ? "travel" : "turn", ending));
      }
    };
    const std::string at = join_path(path, "target");
    check_words(*target, at);
    for (const std::string_view key : {"sinusoid", "keyframes"})
      if (const toml::node* node = target->get(key)) {
        const std::vector<ListedTable> tables = listed_tables(*node, join_path(at, key));
        for (const ListedTable& listed : tables) check_words(*listed.table, listed.path);
        if (key != "keyframes") continue;
        check_times(tables, problems_);
        if (joint_.control.target.loop && !tables.empty())
          check_loop(tables.back(), slides ? "travel" : "turn");
      }
    if (target->contains("loop") && !target->contains("keyframes"))
      problems_.add(place_of(*target, "loop"), join_path(at, "loop"), "has no effect without keyframes",
                    "remove it, or give `keyframes`");
    if (slides && target->contains("wave"))
      problems_.add(place_of(*target, "wave"), join_path(at, "wave"), "has no effect on a prismatic joint",
                    "a wave turns point joints");
  }

  // Reports keyframes that repeat but do not end with the value that they begin with. `last` is the last one,
  // and `key` the key of its value.
  void check_loop(const ListedTable& last, std::string_view key) {
    const std::vector<TargetKey>& keys = joint_.control.target.keyframes;
    if (keys.empty()) return;
    if ((keys.front().turn - keys.back().turn).norm() <= same_value &&
        std::abs(keys.front().travel - keys.back().travel) <= same_value)
      return;
    problems_.add(place_of(*last.table, key), join_path(last.path, key), "is not that of the first keyframe",
                  "a loop ends where it begins");
  }

  // Returns whether the motion of a body has a start: flaws of it, which are reported with the body, may
  // leave it without one.
  static bool has_start(const RigidBody* body) {
    if (!body) return true;
    const std::vector<Keyframe>& keys = body->motion.keyframes;
    std::vector<Vec3> positions;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (i > 0 && !(keys[i - 1].time < keys[i].time)) return false;
      if (keys[i].has_rotation && keys[i].rotation.axis.isZero(0)) return false;
      if (keys[i].position) positions.push_back(*keys[i].position);
    }
    return !body->motion.loop || positions.empty() ||
           (positions.front() - positions.back()).norm() <= same_value;
  }

  // Reports frames in the two bodies that do not coincide at the start, as far as the type of the joint
  // demands it, and limits that are exceeded there.
  void check_start() {
    if (!has_start(body(joint_.parent)) || !has_start(body(joint_.child))) return;
    const auto start = [&](const std::string& name) {
      if (const RigidBody* b = body(name)) return start_of(*b);
      return Pose{Vec3(0, scene_.ground->height, 0), Quat::Identity()};
    };
    // Control has no part in the start, and flaws of its target, which are reported above, may not give one.
    const EffectSet effects = EffectSet().set().reset(index(Effect::pd_control));
    const duet::Joint made = make_joint(joint_, effects, start(joint_.parent), start(joint_.child));
    const JointFrames frames(made, start(joint_.parent), start(joint_.child));
    Quat reference = frames.relative();
    if (reference.w() < 0) reference.coeffs() *= -1;
    double gap = 0, angle = 0;
    for (const JointRow& row : rows_of(made)) {
      if (row.role != RowRole::structure) continue;
      const double error = structure_error(made, row, frames, reference);
      double& worst = row.motion == RowMotion::travel ? gap : angle;
      worst = math::hypot(worst, error);
    }
    if (gap > apart)
      problems_.add(
          table_.source(), path_,
          fmt::format("its two frames are {:.4g} m apart at the start, at most {:.4g} m are allowed", gap,
                      apart),
          fmt::format("on `{}` it is at ({:.6g}, {:.6g}, {:.6g}), on `{}` at ({:.6g}, {:.6g}, {:.6g})",
                      joint_.parent, frames.parent.x(), frames.parent.y(), frames.parent.z(), joint_.child,
                      frames.child.x(), frames.child.y(), frames.child.z()));
    if (angle > askew)
      problems_.add(table_.source(), path_,
                    fmt::format("its two frames are turned by {:.4g} degrees against what its type allows",
                                angle * 180 / std::numbers::pi),
                    "turn a body or a frame, or choose a type that leaves this rotation free");
    for (const JointRow& row : rows_of(made))
      if (row.role == RowRole::limit && limit_slack(made, row, frames) < -askew)
        problems_.add(table_.source(), path_, "is outside of its bounds at the start",
                      "widen the bounds, or turn or move a body");
  }

  const Joint& joint_;
  const Scene& scene_;
  const toml::table& table_;
  const std::string& path_;
  Problems& problems_;
};

}  // namespace

void check_joint(const Joint& joint, const Scene& scene, const toml::table& table, const std::string& path,
                 Problems& problems) {
  JointChecker(joint, scene, table, path, problems).check();
}

}  // namespace duet::scene
