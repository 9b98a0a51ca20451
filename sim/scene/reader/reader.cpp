#include "sim/scene/reader/reader.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <numbers>
#include <sstream>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/near_miss.h"
#include "sim/base/rotation.h"
#include "sim/scene/reader/camera_reader.h"
#include "sim/scene/reader/deformable_reader.h"
#include "sim/scene/reader/joint_reader.h"
#include "sim/scene/reader/motion_reader.h"
#include "sim/scene/reader/prefabs.h"
#include "sim/scene/reader/shape_reader.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

// Largest number of samples along an edge of the picture: the largest texture that software rasterizers
// offer.
constexpr int max_picture_edge = 16384;

Quat orientation_of(const Rotation& rotation) {
  return exponential(rotation.degrees * std::numbers::pi / 180 * rotation.axis.normalized());
}

// Builds a Scene from a document. There is one function for each kind of table, which reads it by the schema
// and then checks the rules that tie several keys together.
class SceneReader {
 public:
  SceneReader(const toml::table& document, const std::string& path, Meshes meshes, const FileMap& files,
              Problems& problems)
      : document_(document), problems_(problems), reader_(problems), shapes_(path, meshes, files, problems) {}

  Scene read();
  const ShapeReader& shapes() const { return shapes_; }

 private:
  void read_root();
  void read_solver();
  void read_camera();
  void read_render();
  void read_rigid(const toml::table& table, const std::string& path);
  void read_deformable(const toml::table& table, const std::string& path);
  void read_joint(const toml::table& table, const std::string& path);
  void read_light(const toml::table& table, const std::string& path);
  void read_look(const toml::table& table, const std::string& path, const std::string& name);
  void read_material(const toml::table& table, const std::string& path, const std::string& name);

  // Returns the table [section]; null if it is absent or no table, which is reported.
  const toml::table* table(std::string_view section);
  Location location_of(const toml::table& table, const std::string& path) const;
  // Calls read_element(table, path) for each table of the list [[section]].
  template <class Read>
  void for_each_in_list(std::string_view section, Read&& read_element);
  // Calls read_element(table, path, name) for each table [section.NAME].
  template <class Read>
  void for_each_named(std::string_view section, Read&& read_element);

  void check_mass(const RigidBody& body, const toml::table& table, const std::string& path);
  void check_terminal_speed(const toml::table& table, const std::string& path);
  bool check_rotation(const Rotation& rotation, const toml::table& table, const std::string& path);
  void check_body_name(const std::string& name, const toml::table& table, const std::string& path);
  void check_unique(std::map<std::string, toml::source_region>& taken, const std::string& name,
                    const toml::table& table, const std::string& path, const std::string& hint);
  // Reports each of `keys` that the table has.
  void reject(const toml::table& table, const std::string& path, std::initializer_list<std::string_view> keys,
              const std::string& why, const std::string& hint);
  void check_references(std::string_view section);
  void check_carriers();
  void check_materials();

  const toml::table& document_;
  Problems& problems_;
  TableReader reader_;
  ShapeReader shapes_;
  Scene scene_;
  std::map<std::string, toml::source_region> body_names_, light_names_, joint_names_;
};

Location SceneReader::location_of(const toml::table& table, const std::string& path) const {
  const toml::source_position at = problems_.place(table.source(), path).begin;
  return {static_cast<int>(at.line), static_cast<int>(at.column)};
}

Scene SceneReader::read() {
  read_root();
  for_each_named("materials", [&](auto&&... args) { read_material(args...); });
  for_each_named("looks", [&](auto&&... args) { read_look(args...); });
  for_each_in_list("rigid", [&](auto&&... args) { read_rigid(args...); });
  for_each_in_list("deformable", [&](auto&&... args) { read_deformable(args...); });
  for_each_in_list("lights", [&](auto&&... args) { read_light(args...); });
  if (const toml::table* ground = table("ground"))
    reader_.read(*ground, keys(scene_.ground.emplace()), "ground");
  for_each_in_list("joints", [&](auto&&... args) { read_joint(args...); });
  if (const toml::table* output = table("output")) reader_.read(*output, keys(scene_.output), "output");
  if (const toml::table* sky = table("sky")) {
    scene_.has_sky = true;
    reader_.read(*sky, keys(scene_.sky), "sky");
  }
  read_solver();
  read_camera();
  read_render();
  check_references("materials");
  check_references("looks");
  check_carriers();
  check_materials();
  if (!document_.contains("rigid") && !document_.contains("deformable"))
    problems_.add_global("the scene has no body", "add a [[rigid]] or a [[deformable]]");
  return std::move(scene_);
}

void SceneReader::read_root() {
  Prototype prototype;
  std::vector<std::string> names = {"parameters", "prefabs"};  // which expansion has replaced
  for (const Section& section : sections(prototype))
    if (section.layout != Layout::root) names.emplace_back(section.name);
  reader_.read(document_, keys(scene_), "", names);
}

const toml::table* SceneReader::table(std::string_view section) {
  const toml::node* node = document_.get(section);
  if (node && !node->is_table())
    problems_.add(node->source(), std::string(section),
                  fmt::format("must be a table [{}], is {}", section, describe(*node)),
                  fmt::format("write [{}] with one bracket above its keys", section));
  return node ? node->as_table() : nullptr;
}

template <class Read>
void SceneReader::for_each_in_list(std::string_view section, Read&& read_element) {
  const toml::node* node = document_.get(section);
  if (!node) return;
  const toml::array* list = node->as_array();
  if (!list || list->empty() || !list->is_homogeneous(toml::node_type::table)) {
    problems_.add(node->source(), std::string(section),
                  fmt::format("must be a list of tables [[{}]], is {}", section, describe(*node)),
                  fmt::format("write [[{}]] with two brackets above the keys of each element", section));
    return;
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const toml::table& element = *(*list)[i].as_table();
    const std::string name = element["name"].value_or(std::string());
    read_element(element,
                 name.empty() ? fmt::format("{}[{}]", section, i) : fmt::format("{}.{}", section, name));
  }
}

template <class Read>
void SceneReader::for_each_named(std::string_view section, Read&& read_element) {
  const toml::table* elements = table(section);
  if (!elements) return;
  for (const auto& [name, node] : *elements) {
    const std::string path = join_path(std::string(section), name);
    reader_.check_name(std::string(name.str()), name.source(), path);
    if (const toml::table* element = node.as_table())
      read_element(*element, path, std::string(name.str()));
    else
      problems_.add(node.source(), path,
                    fmt::format("must be a table [{}.NAME], is {}", section, describe(node)),
                    "every one has a name of its own in its heading");
  }
}

void SceneReader::read_material(const toml::table& table, const std::string& path, const std::string& name) {
  Material& material = scene_.materials.emplace_back();
  material.name = name;
  reader_.read(table, keys(material), path);
}

void SceneReader::read_look(const toml::table& table, const std::string& path, const std::string& name) {
  Look& look = scene_.looks.emplace_back();
  look.name = name;
  reader_.read(table, keys(look), path);
  if (look.pattern.empty())
    reject(table, path, {"pattern_size"}, "has no effect without a pattern", "add a `pattern`");
  if (look.pattern.empty() && look.spots.empty())
    reject(table, path, {"color2"}, "has no effect without a pattern", "add a `pattern` or `spots`");
  if (look.spots.size() > Look::max_spots)
    reject(table, path, {"spots"}, fmt::format("are {}", look.spots.size()),
           fmt::format("at most {} can be drawn", Look::max_spots));
}

void SceneReader::read_rigid(const toml::table& table, const std::string& path) {
  RigidEntry entry;
  RigidBody& body = entry.body;
  reader_.read(table, keys(entry), path);
  check_body_name(body.name, table, path);
  shapes_.check(body, table, path);
  check_mass(body, table, path);
  check_terminal_speed(table, path);
  check_motion(body, table, path, problems_);
  if (check_rotation(entry.rotation, table, path))
    body.placement.orientation = orientation_of(entry.rotation);
  body.at = location_of(table, path);
  scene_.rigid.push_back(std::move(body));
}

void SceneReader::read_deformable(const toml::table& table, const std::string& path) {
  DeformableEntry entry;
  DeformableBody& body = entry.body;
  reader_.read(table, keys(entry), path);
  check_body_name(body.name, table, path);
  if (entry.has_attach_springs) body.attach_springs = entry.attach_springs;
  if (entry.has_skin) body.skin = std::move(entry.skin);
  check_deformable(body, table, path, shapes_, problems_);
  check_terminal_speed(table, path);
  if (check_rotation(entry.rotation, table, path))
    body.placement.orientation = orientation_of(entry.rotation);
  body.at = location_of(table, path);
  scene_.deformable.push_back(std::move(body));
}

void SceneReader::read_joint(const toml::table& table, const std::string& path) {
  JointEntry entry;
  const std::size_t before = problems_.count();
  reader_.read(table, keys(entry), path);
  Joint& joint = scene_.joints.emplace_back(std::move(entry.joint));
  check_unique(joint_names_, joint.name, table, path, "names of joints must differ");
  joint.at = location_of(table, path);
  if (problems_.count() == before) check_joint(joint, scene_, table, path, problems_);
}

void SceneReader::read_light(const toml::table& table, const std::string& path) {
  Light& light = scene_.lights.emplace_back();
  reader_.read(table, keys(light), path);
  check_unique(light_names_, light.name, table, path, "names of lights must differ");
  if (light.kind == LightKind::point) {
    reject(table, path, {"target", "radius", "shadow"}, "has no effect on a point light",
           "remove it, or use `kind = \"area\"`");
    light.shadow = false;
  } else if ((light.position - light.target).norm() == 0) {
    problems_.add(place_of(table, "target"), join_path(path, "target"), "is the light's own position",
                  "an area light faces its target");
  }
}

void SceneReader::read_solver() {
  const toml::table* solver = table("solver");
  if (!solver) return;
  // The preset is applied first, whatever the order of the keys in the file. If it is misspelled, read()
  // reports it with the other keys.
  const auto accuracy = (*solver)["accuracy"].value<std::string>();
  const auto name = std::find(std::begin(accuracy_names), std::end(accuracy_names), accuracy.value_or(""));
  if (name != std::end(accuracy_names))
    scene_.solver = preset(static_cast<Accuracy>(name - std::begin(accuracy_names)));
  reader_.read(*solver, keys(scene_.solver), "solver");
  if (scene_.solver.velocity_constraints == VelocityConstraints::before_solve &&
      scene_.solver.integration == Integration::implicit)
    problems_.add(solver->get("velocity_constraints")->source(), "solver.velocity_constraints",
                  "\"before_solve\" cannot go with integration = \"implicit\"",
                  "its elastic forces are not known before the solve; use \"semi_implicit\"");
}

void SceneReader::read_camera() {
  const toml::table* camera = table("camera");
  if (!camera) return;
  scene_.has_camera = true;
  const std::size_t before = problems_.count();
  reader_.read(*camera, keys(scene_.camera), "camera");
  if (scene_.camera.keyframes.empty())
    check_view(scene_.camera, *camera, problems_);
  else if (problems_.count() == before)
    check_moving_camera(scene_, *camera, problems_);
}

void SceneReader::read_render() {
  const toml::table* table_of_render = table("render");
  if (!table_of_render) return;
  const Render& render = scene_.render;
  reader_.read(*table_of_render, keys(scene_.render), "render");
  const int edge = std::max(render.width, render.height) * render.supersampling;
  if (edge > max_picture_edge)
    problems_.add(place_of(*table_of_render, "supersampling"), "render.supersampling",
                  fmt::format("{} times the picture's longer edge must be <= {} samples, is {}",
                              render.supersampling, max_picture_edge, edge),
                  "lower supersampling, width or height");
  const bool has_range = render.color == ColorBy::stress || render.color == ColorBy::contact;
  if (has_range && !render.color_range)
    problems_.add(place_of(*table_of_render, "color"), "render.color",
                  "needs `color_range`, the value at the yellow end of the colors",
                  "set render.color_range, in Pa");
  if (!has_range && render.color_range)
    problems_.add(place_of(*table_of_render, "color_range"), "render.color_range",
                  "has no effect unless `color` is \"stress\" or \"contact\"",
                  "remove it, or set render.color; strain has `strain_range`");
}

void SceneReader::check_body_name(const std::string& name, const toml::table& table,
                                  const std::string& path) {
  if (name == "ground")
    problems_.add(place_of(table, "name"), path + ".name", "`ground` is reserved for the ground",
                  "choose another name");
  else
    check_unique(body_names_, name, table, path, "names must differ over rigid and deformable bodies alike");
}

void SceneReader::check_unique(std::map<std::string, toml::source_region>& taken, const std::string& name,
                               const toml::table& table, const std::string& path, const std::string& hint) {
  if (name.empty()) return;
  const toml::source_region place = problems_.place(place_of(table, "name"), path + ".name");
  const auto [first, inserted] = taken.emplace(name, place);
  if (inserted) return;
  const auto line = first->second.begin.line;
  problems_.add(place, path + ".name",
                fmt::format("duplicate name `{}`, first used {}", name,
                            line > 0 ? fmt::format("in line {}", line) : "by --set"),
                hint);
}

void SceneReader::check_mass(const RigidBody& body, const toml::table& table, const std::string& path) {
  if (body.is_static) {
    reject(table, path, {"mass", "density", "velocity", "angular_velocity", "terminal_speed"},
           "has no effect on a static body", "remove it, or remove `static = true`");
    return;
  }
  if (body.is_kinematic) {
    reject(table, path, {"mass", "density", "velocity", "angular_velocity", "terminal_speed"},
           "has no effect on a body with a motion", "remove it, or remove `motion`");
    return;
  }
  const bool mass = table.contains("mass"), density = table.contains("density");
  if (mass && density)
    problems_.add(place_of(table, "density"), path + ".density", "given together with mass",
                  "give either mass or density");
  if (!mass && !density)
    problems_.add(table.source(), path, "has neither mass nor density",
                  "give one of them, or `static = true` or a `motion` for a body that nothing moves");
}

void SceneReader::check_terminal_speed(const toml::table& table, const std::string& path) {
  if (scene_.gravity.isZero(0))
    reject(table, path, {"terminal_speed"}, "has no effect where nothing has weight",
           "it is the speed at which drag carries the weight; remove it, or set `gravity`");
}

// Returns whether the table has a rotation that can be used. Reports a zero axis.
bool SceneReader::check_rotation(const Rotation& rotation, const toml::table& table,
                                 const std::string& path) {
  const toml::table* given = table["rotation"].as_table();
  if (!given) return false;
  // Eigen does not normalize a vector whose squared length is 0, which happens to tiny vectors by underflow.
  if (rotation.axis.squaredNorm() > 0) return true;
  problems_.add(place_of(*given, "axis"), path + ".rotation.axis", "has zero length",
                "any direction, for example [0, 1, 0]");
  return false;
}

void SceneReader::reject(const toml::table& table, const std::string& path,
                         std::initializer_list<std::string_view> rejected, const std::string& why,
                         const std::string& hint) {
  for (const std::string_view key : rejected)
    if (const toml::node* node = table.get(key))
      problems_.add(node->source(), join_path(path, key), why, hint);
}

// Reports names of materials or looks that do not exist, and elements that are never used.
void SceneReader::check_references(std::string_view section) {
  const toml::table* elements = document_[section].as_table();
  const std::string kind(section.substr(0, section.size() - 1));  // "materials" -> "material"
  std::vector<std::string> defined, used;
  if (elements)
    for (const auto& [name, node] : *elements) defined.emplace_back(name.str());
  for (const TableReader::Use& use : reader_.uses()) {
    if (use.section != section) continue;
    used.push_back(use.name);
    if (std::find(defined.begin(), defined.end(), use.name) != defined.end()) continue;
    const std::string hint = did_you_mean(use.name, defined);
    problems_.add(use.at, use.path, fmt::format("unknown {} `{}`", kind, use.name),
                  hint.empty() ? fmt::format("add a table [{}.{}]", section, use.name) : hint);
    // The element that was probably meant is not reported as unused in addition.
    if (const auto meant = near_miss(use.name, defined)) used.push_back(*meant);
  }
  if (!elements) return;
  for (const auto& [name, node] : *elements)
    if (node.is_table() && std::find(used.begin(), used.end(), name.str()) == used.end())
      problems_.add(name.source(), join_path(std::string(section), name),
                    fmt::format("the {} is never used", kind), "remove it, or refer to it by this name");
}

// Reports names of rigid bodies, in pins and bonds, that do not exist, and pins on bodies without a motion.
void SceneReader::check_carriers() {
  std::vector<std::string> names;
  for (const RigidBody& body : scene_.rigid) names.push_back(body.name);
  for (const TableReader::Use& use : reader_.uses()) {
    if (use.section != "rigid") continue;
    const auto found = std::find(names.begin(), names.end(), use.name);
    if (found == names.end())
      problems_.add(use.at, use.path, fmt::format("unknown rigid body `{}`", use.name),
                    did_you_mean(use.name, names));
    else if (use.path.ends_with(".body") &&
             !scene_.rigid[static_cast<std::size_t>(found - names.begin())].is_kinematic)
      problems_.add(use.at, use.path, fmt::format("`{}` has no motion", use.name),
                    "pins are carried by kinematic bodies; without `body` they never move");
  }
}

// Reports keys of materials that only finite elements of volumes use, if no volume of finite elements is made
// of the material.
void SceneReader::check_materials() {
  const auto has_tetrahedra = [](const DeformableBody& body, const Material& material) {
    return body.material == material.name && body.shape.is_volume() && !material.has_springs;
  };
  const auto is_used = [](const DeformableBody& body, const Material& material) {
    return body.material == material.name;
  };
  for (const Material& material : scene_.materials) {
    const auto some = [&](const auto& holds) {
      return std::any_of(scene_.deformable.begin(), scene_.deformable.end(),
                         [&](const DeformableBody& body) { return holds(body, material); });
    };
    if (!some(is_used) || some(has_tetrahedra)) continue;
    const toml::table* table = document_["materials"][material.name].as_table();
    if (table)
      reject(*table, "materials." + material.name, {"model", "mass_damping"},
             "has no effect on shells, rods and bodies of springs",
             "it belongs to volumes of finite elements");
  }
}

// Returns the bytes of a scene file. Throws FileError with a near miss if there is no such file.
std::string file_bytes(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored)) return io::read_file(path);
  const std::filesystem::path wanted(path), folder = wanted.parent_path();
  std::vector<std::string> scenes;
  for (const auto& entry : std::filesystem::directory_iterator(folder.empty() ? "." : folder, ignored))
    if (entry.path().extension() == ".toml") scenes.push_back(entry.path().stem().string());
  std::sort(scenes.begin(), scenes.end());
  const auto candidate = near_miss(wanted.stem().string(), scenes);
  throw FileError(path, "there is no such scene file",
                  candidate ? fmt::format("did you mean `{}`?", (folder / (*candidate + ".toml")).string())
                            : "check the path; `duet list` names the scenes that ship");
}

}  // namespace

ReadResult read_text(const std::string& text, const std::string& path,
                     const std::vector<std::string>& overrides, Meshes meshes, const FileMap& files) {
  Problems problems(path);
  toml::table document = parse_document(text, path);
  for (const std::string& assignment : overrides) apply_override(document, assignment, problems);
  const std::string as_run = overrides.empty() ? text : serialize(document);
  expand(document, problems);
  SceneReader reader(document, path, meshes, files, problems);
  Scene scene = reader.read();
  const ShapeReader& shapes = reader.shapes();
  ReadResult result{std::move(scene), text, shapes.files(), as_run, shapes.notes(), shapes.fingerprint()};
  problems.throw_if_any();
  result.scene.path = path;
  return result;
}

ReadResult read(const std::string& path, const std::vector<std::string>& overrides, Meshes meshes,
                const FileMap& files) {
  return read_text(file_bytes(path), path, overrides, meshes, files);
}

}  // namespace duet::scene
