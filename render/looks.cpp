#include "render/looks.h"

#include <array>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/base/near_miss.h"

namespace duet::render {
namespace {

// Colors of bodies without a look, in turn, so that they can be told apart. They are dull (linear RGB), and
// neighbors in the list differ in brightness as well.
constexpr std::array<std::array<double, 3>, 8> palette{{{0.72, 0.24, 0.06},
                                                        {0.06, 0.20, 0.48},
                                                        {0.70, 0.47, 0.07},
                                                        {0.05, 0.30, 0.22},
                                                        {0.55, 0.55, 0.50},
                                                        {0.42, 0.06, 0.10},
                                                        {0.30, 0.48, 0.60},
                                                        {0.20, 0.12, 0.34}}};

// Returns the place of the look called `name`: that of the default look if the name is empty, -1 if there is
// no such look.
int find_look(const std::vector<scene::Look>& looks, const std::string& name) {
  if (name.empty()) return LookTable::plain;
  for (std::size_t i = LookTable::ground + 1; i < looks.size(); ++i)
    if (looks[i].name == name) return static_cast<int>(i);
  return -1;
}

// Returns the advice for a look that the scene does not define, with the most similar name if there is one.
std::string remedy(const std::vector<scene::Look>& looks, const std::string& name) {
  std::vector<std::string> known;
  for (std::size_t i = LookTable::ground + 1; i < looks.size(); ++i) known.push_back(looks[i].name);
  const std::string hint = did_you_mean(name, known);
  return fmt::format("add [looks.{}] to the scene{}{}", name, hint.empty() ? "" : "; ", hint);
}

// Returns a look that shows values. It is rough, so that highlights are not taken for values.
scene::Look plain_look(const Vec3& color, const Vec3& color2) {
  scene::Look look;
  look.color = color;
  look.color2 = color2;
  look.roughness = 0.8;
  look.pattern = value_pattern;
  return look;
}

// Gives the colors of the palette to moving bodies without a look. Static ones keep the default look.
void wear_palette(LookTable& table, const io::Manifest& manifest) {
  const std::size_t first = table.looks.size();
  std::size_t worn = 0;
  for (const io::ManifestBody& body : manifest.bodies) {
    if (!body.look.empty() || body.kind == "static") continue;
    const std::size_t color = worn++ % palette.size();
    if (first + color == table.looks.size()) {
      table.looks.emplace_back().color = Eigen::Map<const Vec3>(palette[color].data());
      table.looks.back().roughness = 0.6;
    }
    table.of_body[body.name] = static_cast<int>(first + color);
  }
}

// Adds the two looks that show values and gives the first to all deformable bodies that have the quantity.
// Bodies without elements have no strain and no stress.
void wear_values(LookTable& table, scene::ColorBy color, const io::Manifest& manifest) {
  table.of_values = static_cast<int>(table.looks.size());
  table.looks.push_back(plain_look(low_color, high_color));
  table.looks.push_back(plain_look(inverted_color, inverted_color));
  for (const io::ManifestBody& body : manifest.bodies)
    if (body.is_deformable() && (body.has_strain || color == scene::ColorBy::contact))
      table.of_body[body.name] = table.of_values;
}

}  // namespace

LookTable assign_looks(const scene::Scene& scene, const io::Manifest& manifest) {
  LookTable table;
  table.looks.resize(LookTable::ground + 1);
  table.looks.insert(table.looks.end(), scene.looks.begin(), scene.looks.end());
  // Looks that no scene defines: default, ground, the palette, values and inverted.
  constexpr int own_looks = LookTable::ground + 1 + static_cast<int>(palette.size()) + 2;
  if (scene.looks.size() > static_cast<std::size_t>(max_looks - own_looks))
    throw Error(ExitStatus::usage,
                fmt::format("{}: {} looks are more than the renderer holds ({}): let bodies share looks",
                            scene.path, scene.looks.size(), max_looks - own_looks));
  const auto place_of = [&](const std::string& wearer, const std::string& look) {
    const int place = find_look(table.looks, look);
    if (place < 0)
      throw FileError(scene.path,
                      fmt::format("{} wears the look `{}`, which the scene does not have", wearer, look),
                      remedy(table.looks, look));
    return place;
  };
  if (scene.ground) {
    const int place = place_of("the ground", scene.ground->look);
    table.looks[LookTable::ground] = table.looks[static_cast<std::size_t>(place)];
  }
  for (const io::ManifestBody& body : manifest.bodies)
    table.of_body[body.name] = place_of(fmt::format("body `{}`", body.name), body.look);
  wear_palette(table, manifest);
  if (scene.render.color != scene::ColorBy::look) wear_values(table, scene.render.color, manifest);
  return table;
}

}  // namespace duet::render
