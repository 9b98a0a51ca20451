#include "sim/io/export/description.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include "sim/io/export/staging.h"
#include "sim/io/text_builder.h"
#include "sim/scene/camera_path.h"

namespace duet::io {
namespace {

using Json = nlohmann::ordered_json;

// Returns the array [x, y, z].
template <class Vector>
Json array(const Vector& x) {
  return Json::array({x.x(), x.y(), x.z()});
}

// Returns a point of the scene in the axes and unit of the export.
Json place(const ExportedRun& run, const Vec3& x) { return array(Vec3(run.scale() * run.turned(x))); }

Json view_of(const ExportedRun& run, const scene::Camera& camera) {
  return {{"position", place(run, camera.position)},
          {"target", place(run, camera.target)},
          {"up", array(run.turned(camera.up))},
          {"vertical_fov", camera.vertical_fov}};
}

Json camera_of(const ExportedRun& run) {
  const scene::Camera& camera = run.looks().camera;
  Json object = view_of(run, camera);
  object["width"] = run.looks().width;
  object["height"] = run.looks().height;
  if (camera.keyframes.empty()) return object;
  const scene::CameraPath path(camera);
  for (int frame = run.frames().front(); frame <= run.frames().back(); ++frame) {
    Json entry = {{"frame", frame}};
    entry.update(view_of(run, path.at(frame / run.manifest().fps)));
    object["motion"].push_back(std::move(entry));
  }
  return object;
}

Json lights_of(const ExportedRun& run) {
  Json lights = Json::array();
  for (const scene::Light& light : run.looks().lights)
    lights.push_back({{"name", light.name},
                      {"kind", light.kind == scene::LightKind::area ? "area" : "point"},
                      {"position", place(run, light.position)},
                      {"target", place(run, light.target)},
                      {"radius", run.scale() * light.radius},
                      {"power", light.power},
                      {"color", array(light.color)},
                      {"shadow", light.shadow}});
  return lights;
}

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

// Returns true for names that Windows reserves for devices, with any extension.
bool is_device(const std::string& name) {
  std::string stem = lower_case(name.substr(0, name.find('.')));
  if (stem.size() == 4 && stem[3] >= '0' && stem[3] <= '9') stem[3] = '1';
  for (const char* device : {"con", "prn", "aux", "nul", "com1", "lpt1"})
    if (stem == device) return true;
  return false;
}

// Returns a file name that resembles the name, see safe_names().
std::string safe_name(std::string name) {
  constexpr std::size_t longest = 100;  // bytes; file systems allow 255 with number and extension
  name.resize(std::min(name.size(), longest));
  for (char& c : name) {
    const bool is_safe = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
                         c == '_' || c == '-' || c == '.';
    if (!is_safe) c = '_';
  }
  if (name.empty() || name.front() == '.' || name.front() == '-' || is_device(name)) name.insert(0, "_");
  if (name.back() == '.') name.back() = '_';  // Windows drops it
  return name;
}

}  // namespace

Json description(const ExportedRun& run, std::string_view format) {
  Json object = {{"format", format},
                 {"program", program_text(run.manifest().origin)},
                 {"title", run.manifest().title},
                 {"fps", run.manifest().fps},
                 {"first_frame", run.frames().front()},
                 {"last_frame", run.frames().back()},
                 {"missing_frames", run.missing()},
                 {"up", std::string(1, run.up())},
                 {"units_per_meter", run.scale()},
                 {"bodies", Json::array()},
                 {"looks", Json::array()}};
  const std::vector<scene::Look>& looks = run.looks().looks;
  for (const ExportedBody& body : run.bodies()) {
    Json entry = {{"name", body.name}, {"kind", body.kind}};
    if (!looks.empty()) entry["look"] = looks.at(static_cast<std::size_t>(body.look)).name;
    object["bodies"].push_back(std::move(entry));
  }
  for (const scene::Look& look : looks)
    object["looks"].push_back({{"name", look.name},
                               {"color", array(look.color)},
                               {"metallic", look.metallic},
                               {"roughness", look.roughness},
                               {"opacity", look.opacity},
                               {"pattern", look.pattern},
                               {"color2", array(look.color2)},
                               {"pattern_size", run.scale() * look.pattern_size}});
  if (!looks.empty()) {
    object["camera"] = camera_of(run);
    object["lights"] = lights_of(run);
  }
  return object;
}

void write_json(const Json& object, const fs::path& path) {
  OutputFile file(path);
  file.write(object.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
  file.close();
}

std::vector<std::string> safe_names(const std::vector<std::string>& names) {
  std::set<std::string> taken;
  std::vector<std::string> safe;
  for (const std::string& name : names) {
    const std::string base = safe_name(name);
    std::string chosen = base;
    for (int next = 2; !taken.insert(lower_case(chosen)).second; ++next)
      chosen = fmt::format("{}-{}", base, next);
    safe.push_back(std::move(chosen));
  }
  return safe;
}

std::vector<std::string> safe_body_names(const ExportedRun& run) {
  std::vector<std::string> names;
  for (const ExportedBody& body : run.bodies()) names.push_back(body.name);
  return safe_names(names);
}

std::vector<std::string> material_names(const ExportedRun& run) {
  std::vector<std::string> names;
  for (const scene::Look& look : run.looks().looks) names.push_back(look.name);
  return safe_names(names);
}

void write_materials(const ExportedRun& run, const fs::path& path,
                     const std::vector<std::pair<std::string, int>>& more) {
  std::vector<std::pair<std::string, int>> all;
  for (const std::string& name : material_names(run)) all.emplace_back(name, static_cast<int>(all.size()));
  all.insert(all.end(), more.begin(), more.end());
  TextBuilder text;
  text.add("# Duet: colors in linear RGB\n");
  for (const auto& [name, index] : all) {
    const scene::Look& look = run.looks().looks.at(static_cast<std::size_t>(index));
    text.add("\nnewmtl " + name + "\nKd");
    text.numbers(' ', look.color);
    // Ns = 1000 (1 - roughness)^2: the specular exponent by which Blender writes and reads roughness.
    const double smooth = 1 - look.roughness;
    for (const auto& [keyword, value] : {std::pair{"\nKs ", 0.5},
                                         {"\nNs ", 1000 * smooth * smooth},
                                         {"\nd ", look.opacity},
                                         {"\nPr ", look.roughness},
                                         {"\nPm ", look.metallic}}) {
      text.add(keyword);
      text.number(value);
      if (std::string_view(keyword) == "\nKs ") text.add(" 0.5 0.5");
    }
    text.add("\nillum 2\n");
  }
  OutputFile file(path);
  file.write(text.view());
  file.close();
}

std::vector<std::string> notes_on_looks(const ExportedRun& run) {
  std::set<std::string> patterned;
  const std::vector<scene::Look>& looks = run.looks().looks;
  for (const ExportedBody& body : run.bodies()) {
    if (looks.empty()) break;
    const scene::Look& look = looks.at(static_cast<std::size_t>(body.look));
    if (!look.pattern.empty() || !look.spots.empty()) patterned.insert(look.name);
  }
  if (patterned.empty()) return {};
  std::string names;
  for (const std::string& name : patterned) names += (names.empty() ? "" : ", ") + name;
  return {fmt::format(
      "patterns and spots are not in the materials, which have the first color alone: looks {}", names)};
}

}  // namespace duet::io
