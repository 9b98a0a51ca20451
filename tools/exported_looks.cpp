#include "tools/exported_looks.h"

#include <set>

#include <fmt/format.h>

#include "render/default_view.h"
#include "render/looks.h"

namespace duet::tools {
namespace {

// A name that no look has had yet.
std::string unused_name(const std::string& wanted, std::set<std::string>& names) {
  std::string name = wanted;
  for (int next = 2; !names.insert(name).second; ++next) name = fmt::format("{}-{}", wanted, next);
  return name;
}

}  // namespace

io::ExportedLooks looks_of(const scene::Scene& described, const io::Manifest& manifest) {
  scene::Scene scene = render::with_default_view(described, manifest);
  scene.render.color = scene::ColorBy::look;  // colors of strain are for pictures
  const render::LookTable table = render::assign_looks(scene, manifest);
  io::ExportedLooks looks;
  looks.camera = scene.camera;
  looks.lights = scene.lights;
  looks.width = scene.render.width;
  looks.height = scene.render.height;
  std::vector<int> place(table.looks.size(), -1);  // in `looks`
  std::vector<bool> is_worn(table.looks.size());
  for (const auto& [body, look] : table.of_body) is_worn[static_cast<std::size_t>(look)] = true;
  std::set<std::string> names;
  for (const scene::Look& look : scene.looks) names.insert(look.name);
  int palette = 0;
  for (std::size_t i = 0; i < table.looks.size(); ++i) {
    if (!is_worn[i]) continue;
    place[i] = static_cast<int>(looks.looks.size());
    looks.looks.push_back(table.looks[i]);
    std::string& name = looks.looks.back().name;
    if (name.empty())
      name = unused_name(
          i == render::LookTable::plain ? std::string("default") : fmt::format("palette-{}", ++palette),
          names);
  }
  for (const io::ManifestBody& body : manifest.bodies)
    looks.of_body.push_back(place[static_cast<std::size_t>(table.of_body.at(body.name))]);
  return looks;
}

}  // namespace duet::tools
