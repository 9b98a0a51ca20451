// The table of keys of a scene file. Validation, defaults, overrides and reference() are all made from it.
//
// A table of the file is described by a list of keys that are bound to a live object: the value that the
// object holds is the key's default, and reading the key assigns to it.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "sim/scene/scene.h"

namespace duet::scene {

// The interval a number (or every element of an array) must lie in.
struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();
  double upper = std::numeric_limits<double>::infinity();
  bool lower_open = false, upper_open = false;
  bool contains(double value) const;
  std::string text() const;  // "> 0", "in [0, 1]", "in (-1, 0.5)"; empty for all numbers
};

struct Key;

struct Name {  // of a body, light, material or look: it becomes an object or grid name in the files of a run
  std::string* text;
};
struct Reference {  // to an element of `section`
  std::string* name;
  std::string_view section;
};
struct References {  // to elements of `section`
  std::vector<std::string>* names;
  std::string_view section;
};
struct Choice {  // one of a few words
  std::vector<std::string_view> names;
  std::size_t selected;
  std::function<void(std::size_t)> select;
};
struct Group {  // a table within the table
  std::vector<Key> keys;
  bool* given = nullptr;  // set where the table is there
};
struct List {  // an array of tables within the table; a single table will do for an array of one
  std::function<std::size_t()> size;
  std::function<std::vector<Key>(std::size_t)> element;  // keys of the i-th one, which it makes if need be
};

using Target = std::variant<bool*, std::optional<bool>*, int*, double*, std::optional<double>*, Vec2*, Vec3*,
                            std::optional<Vec3>*, Eigen::Vector2i*, Vec3i*, std::vector<Vec3>*, std::string*,
                            Name, Reference, References, Choice, Group, List>;

enum class Presence {
  optional,
  required,
  one_of
};  // one_of: the rules of the table say when (see `meaning`)

struct Key {
  std::string_view name;
  Target target;
  std::string_view unit;
  Bounds bounds;
  std::string_view meaning;
  Presence presence = Presence::optional;
};

std::string type_text(const Key& key);     // "number", "3 numbers", "name of a look"
std::string default_text(const Key& key);  // of the value bound to the key: "0.5", "[0, 1, 0]"; "required"

// Copies of a table, each a step farther.
struct Repetition {
  int count = 1;
  Vec3 step = Vec3::Zero();  // m
};
// What the file says in other terms than the scene keeps it. Repetition has been carried out before the
// reader comes.
struct RigidEntry {
  RigidBody body;
  Rotation rotation;
  Repetition repeat;
};
struct DeformableEntry {
  DeformableBody body;
  bool has_attach_springs = false, has_skin = false;
  AttachSprings attach_springs;
  Skin skin;
  Rotation rotation;
  Repetition repeat;
};
struct JointEntry {
  Joint joint;
  Repetition repeat;
};
// Bodies and joints of a prefab, once, on a grid, or scattered.
struct Scatter {
  int count = 1;
  Vec3 size = Vec3::Ones(), lower = Vec3::Zero(), upper = Vec3::Ones();  // m
  bool turn = true;
};
struct Instance {
  std::string name, prefab;
  Vec3 position = Vec3::Zero();  // m
  Rotation rotation;
  double scale = 1;
  Vec3i grid = Vec3i(1, 1, 1);
  Vec3 step = Vec3::Zero();  // m
  bool has_scatter = false;
  Scatter scatter;
  int seed = 1;
};

std::vector<Key> keys(Scene& scene);  // the keys outside of all tables
std::vector<Key> keys(Material& material);
std::vector<Key> keys(Pin& pin);
std::vector<Key> keys(Keyframe& keyframe);
std::vector<Key> keys(CameraKey& keyframe);
std::vector<Key> keys(Spin& spin);
std::vector<Key> keys(Sinusoid& sinusoid);
std::vector<Key> keys(RigidEntry& entry);
std::vector<Key> keys(DeformableEntry& entry);
std::vector<Key> keys(TargetSwing& swing);
std::vector<Key> keys(TargetKey& key);
std::vector<Key> keys(JointEntry& entry);
std::vector<Key> keys(Repetition& repetition);
Key repeat_key(Repetition& repetition);
std::vector<Key> keys(Instance& instance);
std::vector<Key> keys(Ground& ground);
std::vector<Key> keys(Solver& solver);
std::vector<Key> keys(Camera& camera);
std::vector<Key> keys(Light& light);
std::vector<Key> keys(Sky& sky);
std::vector<Key> keys(Look& look);
std::vector<Key> keys(Render& render);

inline constexpr std::string_view accuracy_names[] = {"draft", "standard", "fine"};

// The solver's defaults under an accuracy preset.
Solver preset(Accuracy accuracy);

enum class Layout {
  root,   // keys outside of all tables
  table,  // [solver]
  named,  // [materials.NAME]
  list    // [[rigid]], told apart by their key `name`
};
struct Section {
  std::string_view name;
  Layout layout;
  std::string_view meaning;
  std::vector<Key> keys;
  std::string heading() const;  // "[solver]", "[materials.NAME]", "[[rigid]]"
};

// An element of every kind with its defaults, for what needs the schema and no scene.
struct Prototype {
  Scene scene;
  Material material;
  RigidEntry rigid;
  DeformableEntry deformable;
  JointEntry joint;
  Instance instance;
  Ground ground;
  Light light;
  Look look;
};
std::vector<Section> sections(Prototype& prototype);  // the first is the root; bound to `prototype`

}  // namespace duet::scene
