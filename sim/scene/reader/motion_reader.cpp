#include "sim/scene/reader/motion_reader.h"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "sim/base/rotation.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

// Largest difference of the first and the last keyframe of a loop, m and rad, which is that of rounded
// decimal numbers.
constexpr double same_place = 1e-9;

// Checks the motion of one body.
class MotionChecker {
 public:
  MotionChecker(const RigidBody& body, const toml::table& body_table, const std::string& path,
                Problems& problems)
      : motion_(body.motion),
        body_table_(body_table),
        body_path_(path),
        path_(path + ".motion"),
        problems_(problems) {}

  void check(const toml::table& table) {
    const auto lacks = [&](const char* key) {
      const toml::node* node = table.get(key);
      return !node || is_empty_array(*node);
    };
    if (lacks("keyframes") && lacks("spin") && lacks("sinusoid"))
      problems_.add(table.source(), path_, "says no motion",
                    "give at least one of keyframes, spin, sinusoid");
    if (lacks("keyframes"))
      for (const char* key : {"interpolation", "loop"})
        if (const toml::node* node = table.get(key))
          problems_.add(node->source(), join_path(path_, key), "has no effect without keyframes",
                        "add `keyframes`");
    check_keyframes(tables(table, "keyframes"));
    check_spins(tables(table, "spin"));
    check_sinusoids(tables(table, "sinusoid"));
  }

 private:
  // Returns the tables under a key of the motion; none if it is absent.
  std::vector<ListedTable> tables(const toml::table& table, std::string_view key) const {
    const toml::node* node = table.get(key);
    return node ? listed_tables(*node, join_path(path_, key)) : std::vector<ListedTable>{};
  }

  void add(const ListedTable& at, std::string_view key, std::string message, std::string hint) {
    problems_.add(place_of(*at.table, key), join_path(at.path, key), std::move(message), std::move(hint));
  }

  // Reports an axis without length, if the table is given.
  void check_axis(const toml::table* table, const std::string& path, const Vec3& axis) {
    if (table && axis.squaredNorm() == 0)
      problems_.add(place_of(*table, "axis"), join_path(path, "axis"), "has zero length",
                    "any direction, for example [0, 1, 0]");
  }

  void check_keyframes(const std::vector<ListedTable>& tables) {
    if (tables.empty()) return;
    if (tables.size() == 1)
      problems_.add(tables[0].table->source(), tables[0].path, "is the only keyframe, must be at least 2",
                    "a body that never moves is `static = true`");
    for (std::size_t i = 0; i < tables.size(); ++i) check_keyframe(tables[i], motion_.keyframes[i]);
    check_times(tables, problems_);
    check_placement("position", tables);
    if (motion_.loop) check_loop(tables);
  }

  void check_keyframe(const ListedTable& at, const Keyframe& key) {
    if (!at.table->contains("position") && !at.table->contains("rotation"))
      problems_.add(at.table->source(), at.path, "has neither position nor rotation",
                    "give at least one of them");
    if (at.table->contains("velocity") && !at.table->contains("position"))
      add(at, "velocity", "has no effect without a position", "add a `position`");
    if (at.table->contains("velocity") && motion_.interpolation == Interpolation::linear)
      add(at, "velocity", "has no effect with linear interpolation", "remove it, or interpolate smoothly");
    check_axis((*at.table)["rotation"].as_table(), join_path(at.path, "rotation"), key.rotation.axis);
  }

  // Reports a key of the body that its keyframes replace. This holds for positions; rotations of keyframes
  // turn the body from its own rotation.
  void check_placement(const char* key, const std::vector<ListedTable>& tables) {
    const bool keyed = std::any_of(tables.begin(), tables.end(),
                                   [&](const ListedTable& at) { return at.table->contains(key); });
    if (const toml::node* node = body_table_.get(key); node && keyed)
      problems_.add(node->source(), join_path(body_path_, key),
                    fmt::format("given together with keyframes that have a {}", key),
                    fmt::format("remove it: the first keyframe says the {} at the start", key));
  }

  // Checks that a loop ends as it begins.
  void check_loop(const std::vector<ListedTable>& tables) {
    const Keyframe &first = motion_.keyframes.front(), &last = motion_.keyframes.back();
    for (const char* key : {"position", "rotation"}) {
      const bool keyed = std::any_of(tables.begin(), tables.end(),
                                     [&](const ListedTable& at) { return at.table->contains(key); });
      for (const ListedTable* end : {&tables.front(), &tables.back()})
        if (keyed && !end->table->contains(key))
          problems_.add(end->table->source(), end->path,
                        fmt::format("lacks the {} that a loop begins and ends with", key),
                        fmt::format("add a `{}`", key));
    }
    const std::string hint = "a loop ends where it begins";
    if (first.position && last.position && (*first.position - *last.position).norm() > same_place)
      add(tables.back(), "position", "is not that of the first keyframe", hint);
    if (first.has_rotation && last.has_rotation &&
        logarithm(exponential(first.rotation.vector()).conjugate() * exponential(last.rotation.vector()))
                .norm() > same_place)
      add(tables.back(), "rotation", "is not that of the first keyframe", hint);
  }

  void check_span(const ListedTable& at, double start, const std::optional<double>& stop) {
    if (stop && *stop <= start)
      add(at, "stop", fmt::format("must be > {:.6g} s, the start, is {:.6g}", start, *stop),
          "it stops after it has started");
  }

  void check_spins(const std::vector<ListedTable>& tables) {
    for (std::size_t i = 0; i < tables.size(); ++i) {
      const Spin& spin = motion_.spin[i];
      check_axis(tables[i].table, tables[i].path, spin.axis);
      check_span(tables[i], spin.start, spin.stop);
      if (spin.stop && *spin.stop > spin.start && spin.ramp > (*spin.stop - spin.start) / 2)
        add(tables[i], "ramp",
            fmt::format("must be <= {:.6g} s, half of the time from start to stop, is {:.6g}",
                        (*spin.stop - spin.start) / 2, spin.ramp),
            "there is one ramp at the start and one at the stop");
    }
  }

  void check_sinusoids(const std::vector<ListedTable>& tables) {
    for (std::size_t i = 0; i < tables.size(); ++i) {
      const Sinusoid& sinusoid = motion_.sinusoid[i];
      const toml::table& table = *tables[i].table;
      if (!table.contains("amplitude") && !table.contains("rotation"))
        problems_.add(table.source(), tables[i].path, "has neither amplitude nor rotation",
                      "give at least one of them");
      check_axis(table["rotation"].as_table(), join_path(tables[i].path, "rotation"), sinusoid.rotation.axis);
      check_span(tables[i], sinusoid.start, sinusoid.stop);
    }
  }

  const Motion& motion_;
  const toml::table& body_table_;
  const std::string& body_path_;
  const std::string path_;
  Problems& problems_;
};

}  // namespace

void check_motion(const RigidBody& body, const toml::table& body_table, const std::string& path,
                  Problems& problems) {
  const toml::node* node = body_table.get("motion");
  if (!node) return;
  if (body.is_static)
    problems.add(node->source(), join_path(path, "motion"), "given together with `static = true`",
                 "a static body never moves: remove one of the two");
  if (const toml::table* table = node->as_table())
    MotionChecker(body, body_table, path, problems).check(*table);
}

}  // namespace duet::scene
