#include "sim/scene/reader/prefabs.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "sim/base/near_miss.h"
#include "sim/base/rotation.h"
#include "sim/scene/joints.h"
#include "sim/scene/reader/expansion_limits.h"
#include "sim/scene/reader/lengths.h"
#include "sim/scene/reader/parameters.h"
#include "sim/scene/reader/prefab_checks.h"
#include "sim/scene/reader/random_placement.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

constexpr std::array<std::string_view, 3> listed = {"rigid", "deformable", "joints"};  // sections of prefabs
constexpr int max_copies = 100000;  // of prefabs in a scene

// Returns the three numbers of an array; none if the node is something else.
std::optional<Vec3> vector_of(const toml::node* node) {
  const toml::array* array = node ? node->as_array() : nullptr;
  if (!array || array->size() != 3) return std::nullopt;
  Vec3 v;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto value = (*array)[i].value<double>();
    if (!value) return std::nullopt;
    v[static_cast<Eigen::Index>(i)] = *value;
  }
  return v;
}

void set_vector(toml::table& table, std::string_view key, const Vec3& v) {
  toml::array array;
  for (Eigen::Index i = 0; i < 3; ++i) array.push_back(static_cast<double>(v[i]));
  table.insert_or_assign(key, std::move(array));
}

// Calls change(text) for all texts in the node.
template <class Change>
void for_each_text(toml::node& node, Change&& change) {
  if (toml::table* table = node.as_table())
    for (auto&& [key, value] : *table) for_each_text(value, change);
  else if (toml::array* array = node.as_array())
    for (toml::node& value : *array) for_each_text(value, change);
  else if (auto* text = node.as_string())
    change(text->get());
}

// Calls change(table) for a table, or for all tables of an array.
template <class Change>
void for_each_table(toml::node* node, Change&& change) {
  if (toml::table* table = node ? node->as_table() : nullptr) change(*table);
  if (toml::array* array = node ? node->as_array() : nullptr)
    for (toml::node& element : *array) for_each_table(&element, change);
}

void replace_all(std::string& text, std::string_view from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

// Returns the node at a path of keys with dots between; null if there is none.
toml::node* at_path(toml::table& table, std::string_view path) {
  toml::table* inner = &table;
  for (std::size_t dot = path.find('.'); dot != std::string_view::npos; dot = path.find('.')) {
    toml::node* next = inner->get(path.substr(0, dot));
    inner = next ? next->as_table() : nullptr;
    if (!inner) return nullptr;
    path.remove_prefix(dot + 1);
  }
  return inner->get(path);
}

// Expands the document of a scene; see expand().
class Expander {
 public:
  Expander(toml::table& document, Problems& problems) : document_(document), problems_(problems) {}

  void expand() {
    check_expanded_tables(document_, problems_);
    parameters_.take_from(document_);
    repeat_lists(document_, "");
    toml::table* prefabs = document_["prefabs"].as_table();
    // If the instances ask for too many elements, they are refused below, and the repetitions in prefabs are
    // not expanded before.
    if (prefabs && limits_.can_hold(asked_for(*prefabs)))
      for (auto&& [name, prefab] : *prefabs)
        if (toml::table* table = prefab.as_table())
          repeat_lists(*table, fmt::format("prefabs.{}.", name.str()));
    if (const toml::array* instances = document_["instances"].as_array())
      for (std::size_t i = 0; i < instances->size(); ++i)
        if (const toml::table* instance = (*instances)[i].as_table())
          place(*instance, path_of(*instance, "instances", i));
    document_.erase("parameters");
    document_.erase("prefabs");
    document_.erase("instances");
  }

 private:
  // Returns the number of bodies and joints in the lists of a scene or prefab, with the repetitions that are
  // not expanded yet.
  static double elements_of(const toml::table& table) {
    double elements = 0;
    for (const std::string_view key : listed)
      if (const toml::array* list = table[key].as_array())
        for (const toml::node& node : *list) {
          const toml::table* element = node.as_table();
          elements +=
              element ? static_cast<double>((*element)["repeat"]["count"].value_or(std::int64_t{1})) : 1;
        }
    return elements;
  }

  // Returns the number of bodies and joints that all instances would make. Counts that are no integers are 1.
  double asked_for(const toml::table& prefabs) const {
    double elements = 0;
    const toml::array* instances = document_["instances"].as_array();
    if (!instances) return 0;
    for (const toml::node& node : *instances) {
      const toml::table* instance = node.as_table();
      if (!instance) continue;
      const toml::table* prefab = prefabs[(*instance)["prefab"].value_or(std::string())].as_table();
      if (!prefab) continue;
      double copies = static_cast<double>((*instance)["scatter"]["count"].value_or(std::int64_t{1}));
      if (const toml::array* grid = (*instance)["grid"].as_array())
        for (const toml::node& count : *grid) copies *= static_cast<double>(count.value_or(std::int64_t{1}));
      elements += copies * elements_of(*prefab);
    }
    return elements;
  }

  // Expands the repetitions in the lists of the scene or of a prefab.
  void repeat_lists(toml::table& table, const std::string& path) {
    for (const std::string_view key : listed)
      if (toml::array* list = table[key].as_array()) repeat(*list, fmt::format("{}{}", path, key));
  }

  // Replaces the elements of a list that have a `repeat` by their copies.
  void repeat(toml::array& list, const std::string& path) {
    const auto repeats = [](const toml::node& node) {
      return node.is_table() && node.as_table()->contains("repeat");
    };
    if (std::none_of(list.begin(), list.end(), repeats)) return;
    toml::array result;
    for (std::size_t i = 0; i < list.size(); ++i) {
      toml::node& node = list[i];
      const std::string original = path_of(node, path, i);
      toml::table* element = node.as_table();
      const toml::table* repeat = element ? (*element)["repeat"].as_table() : nullptr;
      if (!repeat) {
        // The value is moved, because a copy has no line in the file.
        node.visit([&](auto& value) { result.push_back(std::move(value)); });
        continue;
      }
      Repetition repetition;
      TableReader(problems_).read(*repeat, keys(repetition), original + ".repeat", {"advance"});
      check_advance(*repeat, original, problems_);
      const auto places = problems_.copies().of(*element, original);
      if (!limits_.allow_repeat(*repeat, repetition.count, original)) continue;
      toml::table copy = *element;
      copy.erase("repeat");
      for (int k = 0; k < repetition.count; ++k) {
        result.push_back(nth(copy, *repeat, repetition, k, original));
        problems_.copies().add(path_of(result.back(), path, result.size() - 1), places);
      }
    }
    list = std::move(result);
  }

  // Returns the k-th copy, from 0, of an element: with its numbers in texts, moved by k steps and with
  // advanced numbers.
  toml::table nth(const toml::table& element, const toml::table& repeat, const Repetition& repetition, int k,
                  const std::string& path) {
    toml::table copy = element;
    for_each_text(copy, [&](std::string& text) {
      replace_all(text, "{+}", std::to_string(k + 2));
      replace_all(text, "{}", std::to_string(k + 1));
    });
    if (!repetition.step.isZero(0))
      set_vector(copy, "position",
                 vector_of(copy.get("position")).value_or(Vec3::Zero()) + k * repetition.step);
    const toml::table* advance = repeat["advance"].as_table();
    if (!advance) return copy;
    for (auto&& [key, step] : *advance) {
      toml::node* number = at_path(copy, key.str());
      const auto start = number ? number->value<double>() : std::nullopt;
      const auto by = step.value<double>();
      if (!start || !by)
        problems_.add(step.source(), fmt::format("{}.repeat.advance.{}", path, key.str()),
                      "is not a number that the table has",
                      "name a key of the table, with dots between, in quotes");
      else if (auto* integer = number->as_integer())
        integer->get() += k * static_cast<std::int64_t>(*by);
      else
        number->as_floating_point()->get() += k * *by;
    }
    return copy;
  }

  // Makes the copies of a prefab that the instance `table` asks for.
  void place(const toml::table& table, const std::string& path) {
    Instance instance;
    const std::size_t before = problems_.count();
    TableReader(problems_).read(table, keys(instance), path, {"set", "vary"});
    check_instance(table, instance, path, problems_);
    if (problems_.count() != before) return;
    const toml::table* prefabs = document_["prefabs"].as_table();
    const toml::node* node = prefabs ? prefabs->get(instance.prefab) : nullptr;
    const toml::table* prefab = node ? node->as_table() : nullptr;
    if (node && !prefab) return;  // check_expanded_tables() has reported it
    if (!prefab) {
      std::vector<std::string> names;
      if (prefabs)
        for (auto&& [name, other] : *prefabs) names.emplace_back(name.str());
      const std::string hint = did_you_mean(instance.prefab, names);
      problems_.add(place_of(table, "prefab"), path + ".prefab",
                    fmt::format("unknown prefab `{}`", instance.prefab),
                    hint.empty() ? fmt::format("add tables [[prefabs.{}.rigid]]", instance.prefab) : hint);
      return;
    }
    if (instance.rotation.axis.squaredNorm() == 0) {
      problems_.add(table.source(), path + ".rotation.axis", "has zero length",
                    "any direction, for example [0, 1, 0]");
      return;
    }
    const double elements = elements_of(*prefab);  // of one copy
    const Vec3 grid = instance.grid.cast<double>();
    const double copies = instance.has_scatter ? instance.scatter.count : grid.prod();
    if (!limits_.allow_copies(table, copies, elements, path)) return;
    const Pose base{instance.position, exponential(instance.rotation.vector())};
    if (instance.has_scatter)
      scatter(table, instance, *prefab, base, path);
    else
      place_grid(table, instance, *prefab, base, path);
  }

  void place_grid(const toml::table& table, const Instance& instance, const toml::table& prefab,
                  const Pose& base, const std::string& path) {
    const Vec3i& n = instance.grid;
    const bool single = n == Vec3i(1, 1, 1);
    Random random(static_cast<std::uint64_t>(instance.seed));
    int number = 0;
    for (int i = 0; i < n.x(); ++i)
      for (int j = 0; j < n.y(); ++j)
        for (int k = 0; k < n.z(); ++k) {
          Pose pose = base;
          pose.position += Vec3(i, j, k).cwiseProduct(instance.step);
          ++number;
          add(table, prefab, pose, single ? instance.name : fmt::format("{}{}", instance.name, number),
              random, path);
        }
  }

  void scatter(const toml::table& table, const Instance& instance, const toml::table& prefab,
               const Pose& base, const std::string& path) {
    Random random(static_cast<std::uint64_t>(instance.seed));
    std::vector<PlacedBox> placed = placed_;  // in the coordinates of the instance
    for (PlacedBox& box : placed)
      box.pose = {base.to_body(box.pose.position), base.orientation.conjugate() * box.pose.orientation};
    for (int i = 1; i <= instance.scatter.count; ++i) {
      const auto pose =
          random_pose(instance.scatter.size / 2, instance.scatter.lower, instance.scatter.upper,
                      instance.scatter.turn ? BoxAxes::random : BoxAxes::of_bounds, placed, random);
      if (!pose) {
        problems_.add(place_of(table, "scatter"), path + ".scatter",
                      fmt::format("there is no room left for number {} of {}", i, instance.scatter.count),
                      "raise upper, or lower count or size");
        return;
      }
      const Pose in_world{base.to_world(pose->position), base.orientation * pose->orientation};
      placed.push_back({*pose, instance.scatter.size / 2});
      placed_.push_back({in_world, instance.scatter.size / 2});
      add(table, prefab, in_world, fmt::format("{}{}", instance.name, i), random, path);
    }
  }

  // Returns the parameters of the prefab, as the instance sets and varies them.
  toml::table parameters(const toml::table& table, const toml::table& prefab, Random& random,
                         const std::string& path) {
    toml::table values;
    if (const toml::table* defaults = prefab["parameters"].as_table()) values = *defaults;
    const auto known = [&](const toml::key& key, std::string_view where) {
      if (values.contains(key)) return true;
      std::vector<std::string> names;
      for (auto&& [name, node] : values) names.emplace_back(name.str());
      problems_.add(key.source(), fmt::format("{}.{}.{}", path, where, key.str()),
                    "the prefab has no such parameter", did_you_mean(std::string(key.str()), names));
      return false;
    };
    if (const toml::table* set = table["set"].as_table())
      for (auto&& [key, value] : *set)
        if (const toml::key& name = key; known(name, "set"))
          value.visit([&](const auto& node) { values.insert_or_assign(name, node); });
    if (const toml::table* vary = table["vary"].as_table())
      for (auto&& [key, value] : *vary) {
        const toml::array* range = value.as_array();
        const auto least = range && range->size() == 2 ? (*range)[0].value<double>() : std::nullopt,
                   most = range && range->size() == 2 ? (*range)[1].value<double>() : std::nullopt;
        if (!least || !most)
          problems_.add(value.source(), fmt::format("{}.vary.{}", path, key.str()), "must be [least, most]",
                        "two numbers, between which every instance draws its own");
        else if (known(key, "vary"))
          values.insert_or_assign(key, random.uniform(*least, *most));
      }
    return values;
  }

  // Adds one copy of the prefab at `pose`, with `name` as the prefix of its names.
  void add(const toml::table& table, const toml::table& prefab, const Pose& pose, const std::string& name,
           Random& random, const std::string& path) {
    const double scale = table["scale"].value_or(1.0);
    if (++copies_ > max_copies) {
      if (copies_ == max_copies + 1)
        problems_.add(table.source(), path,
                      fmt::format("is the {}th copy of a prefab, the last that is made", copies_),
                      "lower its grid or its scatter.count");
      return;
    }
    const toml::table values = parameters(table, prefab, random, path);
    std::set<std::string> own;  // names of the prefab's bodies
    for (const std::string_view key : {"rigid", "deformable"})
      if (const toml::array* list = prefab[key].as_array())
        for (const toml::node& node : *list)
          if (const toml::table* element = node.as_table())
            own.insert((*element)["name"].value_or(std::string()));
    for (const std::string_view key : listed) {
      const toml::array* list = prefab[key].as_array();
      if (!list) continue;
      if (!document_.contains(key)) document_.insert(key, toml::array());
      toml::array* target = document_[key].as_array();
      for (std::size_t i = 0; i < list->size(); ++i) {
        const toml::node& node = (*list)[i];
        if (!node.is_table() || !target) continue;
        const std::string prefab_path = fmt::format("prefabs.{}.{}", table["prefab"].value_or(""), key);
        const std::string original = path_of(node, prefab_path, i);
        const auto places = places_of(*node.as_table(), original);
        toml::table copy = *node.as_table();
        parameters_.fill_in(copy, values, original);
        scale_lengths(copy, scale);
        rename(copy, name, own);
        if (key == "joints")
          move_joint(copy, pose);
        else
          move_body(copy, pose);
        problems_.copies().add(path_of(copy, std::string(key), target->size()), places);
        target->push_back(std::move(copy));
      }
    }
  }

  // Returns the source positions of the values of an element of a prefab, which are found once.
  std::shared_ptr<const Places> places_of(const toml::table& original, const std::string& path) {
    auto& places = places_[&original];
    if (!places) {
      places = problems_.copies().of(original, path);
      problems_.copies().add(path, places);  // for problems of a copy before it has a name of its own
    }
    return places;
  }

  // Prefixes the name of an element, and its references to bodies of the prefab (`own`), by `name`.
  void rename(toml::table& element, const std::string& name, const std::set<std::string>& own) {
    const auto prefix = [&](toml::node* node) {
      if (auto* text = node ? node->as_string() : nullptr)
        text->get() = fmt::format("{}-{}", name, text->get());
    };
    const auto prefix_own = [&](toml::node* node) {
      if (auto* text = node ? node->as_string() : nullptr; text && own.contains(text->get())) prefix(node);
    };
    prefix(element.get("name"));
    for (const std::string_view key : {"parent", "child"}) prefix_own(element.get(key));
    if (toml::array* attach = element["attach"].as_array())
      for (toml::node& node : *attach) prefix_own(&node);
    if (toml::array* pins = element["pins"].as_array())
      for (toml::node& pin : *pins)
        if (toml::table* table = pin.as_table()) prefix_own(table->get("body"));
  }

  // Transforms a motion by the pose with the rotation P: a rotation R of the motion becomes P R P^-1. The
  // orientation that it starts from is turned by P in move_body().
  void move_motion(toml::node& motion, const Pose& pose) {
    const auto turn = [&](toml::table* table, std::string_view key) {
      const auto v = table ? vector_of(table->get(key)) : std::nullopt;
      if (v) set_vector(*table, key, pose.orientation * *v);
    };
    toml::table* table = motion.as_table();
    if (!table) return;  // the reader reports it
    for_each_table(table->get("keyframes"), [&](toml::table& keyframe) {
      if (const auto position = vector_of(keyframe.get("position")))
        set_vector(keyframe, "position", pose.to_world(*position));
      turn(&keyframe, "velocity");
      turn(keyframe["rotation"].as_table(), "axis");
    });
    for_each_table(table->get("spin"), [&](toml::table& spin) { turn(&spin, "axis"); });
    for_each_table(table->get("sinusoid"), [&](toml::table& sinusoid) {
      turn(&sinusoid, "amplitude");
      turn(sinusoid["rotation"].as_table(), "axis");
    });
  }

  // Transforms a body by the pose.
  void move_body(toml::table& body, const Pose& pose) {
    bool keyed = false;  // true if keyframes give the position
    if (toml::node* motion = body.get("motion")) {
      move_motion(*motion, pose);
      if (toml::table* table = motion->as_table())
        for_each_table(table->get("keyframes"),
                       [&](toml::table& keyframe) { keyed = keyed || keyframe.contains("position"); });
    }
    if (!keyed || body.contains("position"))
      set_vector(body, "position", pose.to_world(vector_of(body.get("position")).value_or(Vec3::Zero())));
    for (const std::string_view key : {"velocity", "angular_velocity"})
      if (const auto v = vector_of(body.get(key))) set_vector(body, key, pose.orientation * *v);
    Rotation own;
    if (const toml::table* rotation = body["rotation"].as_table()) {
      own.axis = vector_of(rotation->get("axis")).value_or(Vec3::Zero());
      own.degrees = (*rotation)["degrees"].value_or(0.0);
      if (own.axis.squaredNorm() == 0) return;  // the reader reports it
    }
    const Vec3 turn = logarithm(pose.orientation * exponential(own.vector()));
    if (turn.norm() == 0) {
      body.erase("rotation");
      return;
    }
    toml::table rotation;
    set_vector(rotation, "axis", turn.normalized());
    rotation.insert("degrees", turn.norm() * 180 / std::numbers::pi);
    body.insert_or_assign("rotation", std::move(rotation));
  }

  // Transforms a joint by the pose.
  void move_joint(toml::table& joint, const Pose& pose) {
    const auto position = vector_of(joint.get("position"));
    if (!position) return;  // frames in the bodies move with them
    JointAxes axes;
    axes.position = position;
    axes.axis = vector_of(joint.get("axis")).value_or(axes.axis);
    axes.up = vector_of(joint.get("up"));
    if (axes.axis.squaredNorm() == 0) return;  // the reader reports it
    const Mat3 frame = (pose.orientation * frame_of(axes).orientation).toRotationMatrix();
    set_vector(joint, "position", pose.to_world(*position));
    set_vector(joint, "axis", frame.col(0));
    set_vector(joint, "up", frame.col(1));
  }

  toml::table& document_;
  Problems& problems_;
  std::vector<PlacedBox> placed_;  // boxes of all copies that were scattered so far, in the world
  std::map<const toml::table*, std::shared_ptr<const Places>> places_;  // by the elements of prefabs
  int copies_ = 0;                                                      // copies of prefabs so far
  ExpansionLimits limits_{problems_};
  Parameters parameters_{problems_, limits_};
};

}  // namespace

void expand(toml::table& document, Problems& problems) { Expander(document, problems).expand(); }

}  // namespace duet::scene
