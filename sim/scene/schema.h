// Defines the table of keys of a scene file. Validation, defaults, overrides and reference() are all made
// from it.
//
// A list of keys describes one table of the file. The keys are bound to a live object: the value that the
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

/// The interval that a number, or every element of an array, must lie in.
struct Bounds {
  double lower = -std::numeric_limits<double>::infinity();  ///< Lower bound, in the unit of the key.
  double upper = std::numeric_limits<double>::infinity();   ///< Upper bound, in the unit of the key.
  bool lower_open = false,                                  ///< True if `lower` itself is excluded.
      upper_open = false;                                   ///< True if `upper` itself is excluded.
  bool contains(double value) const;                        ///< Returns whether `value` is in the interval.
  /// Returns the interval as text: "> 0", "in [0, 1]", "in (-1, 0.5)"; empty for all numbers.
  std::string text() const;
};

struct Key;

/// A target that is the name of a body, light, material or look. Names become names of objects and grids in
/// the files of a run, so that few characters are allowed.
struct Name {
  std::string* text;  ///< The name.
};
/// A target that is the name of an element of a section.
struct Reference {
  std::string* name;         ///< The name.
  std::string_view section;  ///< Name of the section that the element belongs to.
};
/// A target that is a list of names of elements of a section.
struct References {
  std::vector<std::string>* names;  ///< The names.
  std::string_view section;         ///< Name of the section that the elements belong to.
};
/// A target that is one of a few words.
struct Choice {
  std::vector<std::string_view> names;      ///< The words.
  std::size_t selected;                     ///< Index of the default word.
  std::function<void(std::size_t)> select;  ///< Assigns the word with this index to the object.
};
/// A target that is a list of words, each one of a few.
struct Words {
  std::vector<std::string>* chosen;     ///< The words of the list.
  std::vector<std::string_view> names;  ///< The words that may be in it.
};
/// A target that is a table within the table.
struct Group {
  std::vector<Key> keys;  ///< Keys of the inner table.
  bool* given = nullptr;  ///< Set to true if the file has the table; may be null.
};
/// A target that is an array of tables within the table. A single table stands for an array of one.
struct List {
  std::function<std::size_t()> size;  ///< Returns the number of elements.
  /// Returns the keys of the element with this index, which it makes if there are fewer.
  std::function<std::vector<Key>(std::size_t)> element;
};

/// The value or structure that a key is bound to.
using Target = std::variant<bool*, std::optional<bool>*, int*, double*, std::optional<double>*, Vec2*, Vec3*,
                            std::optional<Vec3>*, Eigen::Vector2i*, Vec3i*, std::vector<Vec3>*, std::string*,
                            Name, Reference, References, Choice, Words, Group, List>;

/// Tells whether a table must have a key.
enum class Presence {
  optional,  ///< The key may be left out.
  required,  ///< The table must have the key.
  one_of     ///< Rules of the table say when it must have the key; Key::meaning names them.
};

/// A key of a table.
struct Key {
  std::string_view name;                   ///< Name in the file.
  Target target;                           ///< Value or structure that it is bound to.
  std::string_view unit;                   ///< Unit, such as "m/s^2"; empty: none.
  Bounds bounds;                           ///< Bounds of a number or of the elements of an array.
  std::string_view meaning;                ///< Description for the reference and for messages.
  Presence presence = Presence::optional;  ///< Whether the table must have the key.
};

/// Returns the type of the key as text: "number", "3 numbers", "name of a look".
std::string type_text(const Key& key);
/// Returns the default of the key, which is the value it is bound to, as text: "0.5", "[0, 1, 0]", "none".
/// For keys that are not optional it is "required" or "one of".
std::string default_text(const Key& key);

/// The key `repeat` of a table: copies of the table, each one step farther.
struct Repetition {
  int count = 1;             ///< Number of copies.
  Vec3 step = Vec3::Zero();  ///< Displacement from one `position` to the next, m.
};
/// A table [[rigid]]: the body, and what the file says in other terms than the scene. Repetitions have been
/// expanded before the reader sees the table.
struct RigidEntry {
  RigidBody body;     ///< The body.
  Rotation rotation;  ///< Rotation from the shape's coordinates to the world.
  Repetition repeat;  ///< Copies of the table.
};
/// A table [[deformable]]: the body, and what the file says in other terms than the scene.
struct DeformableEntry {
  DeformableBody body;              ///< The body.
  bool has_attach_springs = false,  ///< True if `attach_springs` is given.
      has_skin = false;             ///< True if `skin` is given.
  AttachSprings attach_springs;     ///< Soft bindings to bones.
  Skin skin;                        ///< Surface that is drawn in place of the boundary.
  Rotation rotation;                ///< Rotation from the shape's coordinates to the world.
  Repetition repeat;                ///< Copies of the table.
};
/// A table [[joints]].
struct JointEntry {
  Joint joint;        ///< The joint.
  Repetition repeat;  ///< Copies of the table.
};
/// Random placement of the copies of a prefab.
struct Scatter {
  int count = 1;             ///< Number of copies.
  Vec3 size = Vec3::Ones(),  ///< Edges of a box about the prefab's origin that stays clear of others, m.
      lower = Vec3::Zero(),  ///< Lower corner of the region for these boxes, m.
      upper = Vec3::Ones();  ///< Upper corner of the region for these boxes, m.
  bool turn = true;          ///< True if each copy gets a random rotation.
};
/// A table [[instances]]: copies of the bodies and joints of a prefab, one, on a grid, or scattered.
struct Instance {
  std::string name,              ///< Prefix of the names of the copies.
      prefab;                    ///< Name of the prefab.
  Vec3 position = Vec3::Zero();  ///< World position of the prefab's origin, m.
  Rotation rotation;             ///< Rotation about the prefab's origin.
  double scale = 1;              ///< Factor on all lengths; masses grow with its third power.
  Vec3i grid = Vec3i(1, 1, 1);   ///< Number of copies along x, y and z.
  Vec3 step = Vec3::Zero();      ///< Spacing of the grid, m.
  bool has_scatter = false;      ///< True if `scatter` is given, which then replaces the grid.
  Scatter scatter;               ///< Random placement; used if `has_scatter`.
  int seed = 1;                  ///< Seed of the random numbers of the instance.
};

/// Returns the keys outside of all tables, bound to `scene`.
std::vector<Key> keys(Scene& scene);
/// Returns the keys of a table [materials.NAME].
std::vector<Key> keys(Material& material);
/// Returns the keys of an element of `pins`.
std::vector<Key> keys(Pin& pin);
/// Returns the keys of an element of `motion.keyframes`.
std::vector<Key> keys(Keyframe& keyframe);
/// Returns the keys of an element of `camera.keyframes`.
std::vector<Key> keys(CameraKey& keyframe);
/// Returns the keys of an element of `motion.spin`.
std::vector<Key> keys(Spin& spin);
/// Returns the keys of an element of `motion.sinusoid`.
std::vector<Key> keys(Sinusoid& sinusoid);
/// Returns the keys of a table [[rigid]].
std::vector<Key> keys(RigidEntry& entry);
/// Returns the keys of a table [[deformable]].
std::vector<Key> keys(DeformableEntry& entry);
/// Returns the keys of an element of `control.target.sinusoid`.
std::vector<Key> keys(TargetSinusoid& swing);
/// Returns the keys of an element of `control.target.keyframes`.
std::vector<Key> keys(TargetKey& key);
/// Returns the keys of a table [[joints]].
std::vector<Key> keys(JointEntry& entry);
/// Returns the keys of the table `repeat`.
std::vector<Key> keys(Repetition& repetition);
/// Returns the key `repeat` with the keys of its table.
Key repeat_key(Repetition& repetition);
/// Returns the keys of a table [[instances]].
std::vector<Key> keys(Instance& instance);
/// Returns the keys of the table [ground].
std::vector<Key> keys(Ground& ground);
/// Returns the keys of the table [solver].
std::vector<Key> keys(Solver& solver);
/// Returns the keys of the table [camera].
std::vector<Key> keys(Camera& camera);
/// Returns the keys of a table [[lights]].
std::vector<Key> keys(Light& light);
/// Returns the keys of the table [sky].
std::vector<Key> keys(Sky& sky);
/// Returns the keys of a table [looks.NAME].
std::vector<Key> keys(Look& look);
/// Returns the keys of the table [render].
std::vector<Key> keys(Render& render);
/// Returns the keys of the table [output].
std::vector<Key> keys(Output& output);

/// Names of the presets in the file, in the order of Accuracy.
inline constexpr std::string_view accuracy_names[] = {"draft", "standard", "fine"};

/// Returns the solver's defaults under an accuracy preset.
Solver preset(Accuracy accuracy);

/// How a section appears in the file.
enum class Layout {
  root,   ///< Keys outside of all tables.
  table,  ///< One table, such as [solver].
  named,  ///< Tables by name, such as [materials.NAME].
  list    ///< A list of tables, such as [[rigid]], told apart by their key `name`.
};
/// A section of the scene file.
struct Section {
  std::string_view name;     ///< Name in the file; empty for the root.
  Layout layout;             ///< How it appears in the file.
  std::string_view meaning;  ///< Description for the reference.
  std::vector<Key> keys;     ///< Keys of a table of the section.
  /// Returns the heading of its tables: "[solver]", "[materials.NAME]", "[[rigid]]"; for the root, a phrase.
  std::string heading() const;
};

/// One element of every kind with its defaults, to bind keys to where there is no scene.
struct Prototype {
  Scene scene;                 ///< A scene, with solver, camera, sky and render.
  Material material;           ///< A material.
  RigidEntry rigid;            ///< A rigid body.
  DeformableEntry deformable;  ///< A deformable body.
  JointEntry joint;            ///< A joint.
  Instance instance;           ///< An instance of a prefab.
  Ground ground;               ///< The ground.
  Light light;                 ///< A light.
  Look look;                   ///< A look.
};
/// Returns all sections, with keys that are bound to `prototype`. The first one is the root.
std::vector<Section> sections(Prototype& prototype);

}  // namespace duet::scene
