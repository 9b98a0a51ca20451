// Scenes for Python: reading, the values of keys, and what a scene consists of.
#include "bindings.h"
#include <pybind11/stl.h>

#include "sim/base/error.h"
#include "sim/base/near_miss.h"
#include "sim/scene/deformables.h"
#include "sim/scene/plan.h"
#include "sim/scene/schema.h"

namespace duet::python {
namespace {

using scene::Key;

template <class Vector>
py::list list_of(const Vector& vector) {
  py::list list;
  for (Eigen::Index i = 0; i < vector.size(); ++i) list.append(vector[i]);
  return list;
}

py::object value_of(const Key& key);

// Makes the value that a key is bound to a value of Python.
struct ToPython {
  py::object operator()(const bool* v) const { return py::bool_(*v); }
  py::object operator()(const int* v) const { return py::int_(*v); }
  py::object operator()(const double* v) const { return py::float_(*v); }
  py::object operator()(const std::string* v) const { return py::str(*v); }
  py::object operator()(const Vec2* v) const { return list_of(*v); }
  py::object operator()(const Vec3* v) const { return list_of(*v); }
  py::object operator()(const Eigen::Vector2i* v) const { return list_of(*v); }
  py::object operator()(const Vec3i* v) const { return list_of(*v); }
  py::object operator()(const std::optional<bool>* v) const { return if_any(*v); }
  py::object operator()(const std::optional<double>* v) const { return if_any(*v); }
  py::object operator()(const std::optional<Vec3>* v) const { return if_any(*v); }
  py::object operator()(const std::vector<Vec3>* v) const {
    py::list list;
    for (const Vec3& one : *v) list.append(list_of(one));
    return list;
  }
  py::object operator()(const scene::Name& v) const { return py::str(*v.text); }
  py::object operator()(const scene::Reference& v) const { return py::str(*v.name); }
  py::object operator()(const scene::References& v) const { return py::cast(*v.names); }
  py::object operator()(const scene::Choice& v) const { return py::str(std::string(v.names[v.selected])); }
  py::object operator()(const scene::Words& v) const { return py::cast(*v.chosen); }
  py::object operator()(const scene::Group& v) const {
    py::dict dict;
    for (const Key& one : v.keys) dict[py::str(std::string(one.name))] = value_of(one);
    return dict;
  }
  py::object operator()(const scene::List&) const { return py::none(); }
  template <class Value>
  py::object if_any(const std::optional<Value>& v) const {
    return v ? (*this)(&*v) : py::object(py::none());
  }
};

// Returns the value of a key as Python has it: numbers, booleans, strings, lists, dicts of groups, and None
// for optional values that are not set and for lists of tables.
py::object value_of(const Key& key) { return std::visit(ToPython{}, key.target); }

// Returns the value below `keys` that the names from `path[at]` on lead to. Throws KeyError.
py::object find(const std::vector<Key>& keys, const std::vector<std::string>& path, std::size_t at) {
  std::vector<std::string> known;
  for (const Key& key : keys) {
    known.emplace_back(key.name);
    if (key.name != path[at]) continue;
    if (at + 1 == path.size()) return value_of(key);
    if (const auto* group = std::get_if<scene::Group>(&key.target)) return find(group->keys, path, at + 1);
    throw py::key_error("`" + path[at] + "` has no keys");
  }
  throw py::key_error("no key `" + path[at] + "` (" + did_you_mean(path[at], known) + ")");
}

template <class Items>
auto& named(Items& items, const std::string& name, const std::string& section) {
  std::vector<std::string> known;
  for (auto& item : items) {
    if (item.name == name) return item;
    known.push_back(item.name);
  }
  throw py::key_error("no `" + name + "` in " + section + " (" + did_you_mean(name, known) + ")");
}

// Returns the value that the key `path` has in the scene, which is its default unless the file gives it.
py::object effective_value(scene::Scene& scene, const std::vector<std::string>& path) {
  if (path.empty()) throw py::key_error("the key is empty");
  const std::string& section = path[0];
  const auto below = [&](auto&& object) { return find(scene::keys(object), path, 1); };
  const auto of_item = [&](auto& items, auto make) {
    if (path.size() < 3) throw py::key_error("`" + section + "` is no key: give a name and a key of it");
    auto entry = make(named(items, path[1], section));
    return find(scene::keys(entry), path, 2);
  };
  const auto itself = [](auto& item) { return item; };
  if (path.size() > 1) {
    if (section == "solver") return below(scene.solver);
    if (section == "camera") return below(scene.camera);
    if (section == "sky") return below(scene.sky);
    if (section == "render") return below(scene.render);
    if (section == "output") return below(scene.output);
    if (section == "ground") {
      if (!scene.ground) throw py::key_error("the scene has no ground");
      return below(*scene.ground);
    }
    if (section == "materials") return of_item(scene.materials, itself);
    if (section == "lights") return of_item(scene.lights, itself);
    if (section == "looks") return of_item(scene.looks, itself);
    if (section == "rigid")
      return of_item(scene.rigid, [](auto& body) {
        scene::RigidEntry entry;
        entry.body = body;
        return entry;
      });
    if (section == "deformable")
      return of_item(scene.deformable, [](auto& body) {
        scene::DeformableEntry entry;
        entry.body = body;
        return entry;
      });
    if (section == "joints")
      return of_item(scene.joints, [](auto& joint) {
        scene::JointEntry entry;
        entry.joint = joint;
        return entry;
      });
  }
  return find(scene::keys(scene), path, 0);
}

// Returns (name, kind, material, look) of all bodies in the order of the scene.
py::list bodies_of(const scene::Scene& scene) {
  py::list list;
  for (const scene::RigidBody& body : scene.rigid)
    list.append(py::make_tuple(body.name,
                               body.is_static      ? "static"
                               : body.is_kinematic ? "kinematic"
                                                   : "rigid",
                               "", body.look));
  for (const scene::DeformableBody& body : scene.deformable)
    list.append(py::make_tuple(body.name, "deformable", scene::material_of(scene, body).name, body.look));
  return list;
}

template <class Items>
std::vector<std::string> names_of(const Items& items) {
  std::vector<std::string> names;
  for (const auto& item : items) names.push_back(item.name);
  return names;
}

}  // namespace

py::list plan_of(const scene::Scene& scene, const std::vector<std::string>& without) {
  py::list list;
  for (const scene::PlannedEffect& one : scene::plan_effects(scene, without).effects)
    list.append(py::make_tuple(std::string(name(one.effect)), one.active, one.reason));
  return list;
}

void bind_scene(py::module_& module) {
  using scene::ReadResult;
  py::class_<ReadResult>(module, "SceneData", "A scene that was read and checked.")
      .def_readonly("source", &ReadResult::source)
      .def_readonly("notes", &ReadResult::notes)
      .def_readonly("files", &ReadResult::files)
      .def_property_readonly("title", [](const ReadResult& r) { return r.scene.title; })
      .def_property_readonly("path", [](const ReadResult& r) { return r.scene.path; })
      .def_property_readonly("frames", [](const ReadResult& r) { return r.scene.frames; })
      .def_property_readonly("fps", [](const ReadResult& r) { return r.scene.fps; })
      .def_property_readonly("bodies", [](const ReadResult& r) { return bodies_of(r.scene); })
      .def_property_readonly("joints", [](const ReadResult& r) { return names_of(r.scene.joints); })
      .def_property_readonly("materials", [](const ReadResult& r) { return names_of(r.scene.materials); })
      .def_property_readonly("lights", [](const ReadResult& r) { return names_of(r.scene.lights); })
      .def("plan", [](const ReadResult& r,
                      const std::vector<std::string>& without) { return plan_of(r.scene, without); })
      .def("value", [](ReadResult& r, const std::vector<std::string>& path) {
        return effective_value(r.scene, path);
      });
  module.def(
      "read_text",
      [](const std::string& text, const std::string& path, const std::vector<std::string>& overrides,
         bool meshes, const scene::FileMap& files) {
        const py::gil_scoped_release unlocked;
        return scene::read_text(text, path, overrides, meshes ? scene::Meshes::read : scene::Meshes::leave,
                                files);
      },
      py::arg("text"), py::arg("path"), py::arg("overrides"), py::arg("meshes"), py::arg("files"));
  module.def("reference", &scene::reference, "The reference of all scene keys, as text.");
}

}  // namespace duet::python
