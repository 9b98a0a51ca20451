#include "sim/scene/reader/lengths.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace duet::scene {
namespace {

// All keys whose values are lengths (m), and the scale of a mesh. Keys of velocities are handled by
// scale_lengths().
constexpr std::array<std::string_view, 27> lengths = {"position",
                                                      "box",
                                                      "sphere",
                                                      "radius",
                                                      "length",
                                                      "height",
                                                      "tube",
                                                      "scale",
                                                      "spacing",
                                                      "size",
                                                      "pitch",
                                                      "points",
                                                      "particle",
                                                      "from",
                                                      "to",
                                                      "lower",
                                                      "upper",
                                                      "thickness",
                                                      "collision_thickness",
                                                      "place",
                                                      "wavelength",
                                                      "bend",
                                                      "sample_spacing",
                                                      "rolling_friction",
                                                      "spinning_friction",
                                                      "travel",
                                                      "amplitude"};

// Multiplies all numbers inside of an array or table by `factor`. Integers become floating-point numbers.
void multiply(toml::node& node, double factor) {
  if (toml::array* array = node.as_array()) {
    for (std::size_t i = 0; i < array->size(); ++i)
      if (toml::node& item = (*array)[i]; item.is_number())
        array->replace(array->cbegin() + static_cast<std::ptrdiff_t>(i), factor * item.value_or(0.0));
      else
        multiply(item, factor);
  } else if (toml::table* table = node.as_table()) {
    for (auto&& [key, value] : *table)
      if (value.is_number())
        table->insert_or_assign(key, factor * value.value_or(0.0));
      else
        multiply(value, factor);
  }
}

// Multiplies all lengths inside of an array or table by `scale`.
void scale_inside(toml::node& node, double scale) {
  if (toml::array* array = node.as_array())
    for (toml::node& item : *array) scale_inside(item, scale);
  toml::table* table = node.as_table();
  if (!table) return;
  for (auto&& [key, value] : *table)
    if (std::find(lengths.begin(), lengths.end(), key.str()) == lengths.end())
      scale_inside(value, scale);
    else if (value.is_number())
      table->insert_or_assign(key, scale * value.value_or(0.0));
    else
      multiply(value, scale);
}

}  // namespace

void scale_lengths(toml::table& element, double scale) {
  if (scale == 1) return;
  scale_inside(element, scale);
  toml::table* shape = element["shape"].as_table();
  if (shape && (shape->contains("mesh") || shape->contains("tets")) && !shape->contains("scale"))
    shape->insert("scale", scale);
  if (toml::table* skin = element["skin"].as_table(); skin && !skin->contains("scale"))
    skin->insert("scale", scale);
  if (toml::table* motion = element["motion"].as_table())  // velocities between scaled keyframes
    if (toml::array* keyframes = (*motion)["keyframes"].as_array())
      for (toml::node& keyframe : *keyframes)
        if (toml::node* velocity = keyframe.is_table() ? keyframe.as_table()->get("velocity") : nullptr)
          multiply(*velocity, scale);
  if (const auto mass = element["mass"].value<double>())
    element.insert_or_assign("mass", scale * scale * scale * *mass);
}

}  // namespace duet::scene
