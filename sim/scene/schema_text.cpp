// Writes types, bounds and defaults of keys as text, for messages and the reference.
#include <cmath>

#include <fmt/format.h>

#include "sim/scene/schema.h"

namespace duet::scene {
namespace {

std::string number_text(double value) { return fmt::format("{:.6g}", value); }

template <class Vector>
std::string vector_text(const Vector& value) {
  std::string text;
  for (Eigen::Index i = 0; i < value.size(); ++i)
    text += fmt::format("{}{:.6g}", i == 0 ? "[" : ", ", static_cast<double>(value[i]));
  return text + "]";
}

// Returns the type of a target as text.
struct TypeText {
  std::string operator()(bool*) const { return "boolean"; }
  std::string operator()(std::optional<bool>*) const { return "boolean"; }
  std::string operator()(int*) const { return "integer"; }
  std::string operator()(double*) const { return "number"; }
  std::string operator()(std::optional<double>*) const { return "number"; }
  std::string operator()(Vec2*) const { return "2 numbers"; }
  std::string operator()(Vec3*) const { return "3 numbers"; }
  std::string operator()(std::optional<Vec3>*) const { return "3 numbers"; }
  std::string operator()(Eigen::Vector2i*) const { return "2 integers"; }
  std::string operator()(Vec3i*) const { return "3 integers"; }
  std::string operator()(std::vector<Vec3>*) const { return "points"; }
  std::string operator()(std::string*) const { return "text"; }
  std::string operator()(const Name&) const { return "name"; }
  std::string operator()(const Reference& reference) const {
    if (reference.section == "rigid") return "name of a rigid body";
    return fmt::format("name of a {}", reference.section.substr(0, reference.section.size() - 1));
  }
  std::string operator()(const References&) const { return "names of rigid bodies"; }
  std::string operator()(const Choice&) const { return "word"; }
  std::string operator()(const Words&) const { return "words"; }
  std::string operator()(const Group&) const { return "table"; }
  std::string operator()(const List&) const { return "tables"; }
};

// Returns the value of a target as text.
struct ValueText {
  std::string operator()(const bool* value) const { return *value ? "true" : "false"; }
  std::string operator()(const std::optional<bool>* value) const {
    return *value ? (*this)(&**value) : "none";
  }
  std::string operator()(const int* value) const { return std::to_string(*value); }
  std::string operator()(const double* value) const { return number_text(*value); }
  std::string operator()(const std::optional<double>* value) const {
    return *value ? number_text(**value) : "none";
  }
  std::string operator()(const Vec2* value) const { return vector_text(*value); }
  std::string operator()(const Vec3* value) const { return vector_text(*value); }
  std::string operator()(const std::optional<Vec3>* value) const {
    return *value ? vector_text(**value) : "none";
  }
  std::string operator()(const Eigen::Vector2i* value) const { return vector_text(*value); }
  std::string operator()(const Vec3i* value) const { return vector_text(*value); }
  std::string operator()(const std::vector<Vec3>*) const { return "none"; }
  std::string operator()(const std::string* value) const { return fmt::format("\"{}\"", *value); }
  std::string operator()(const Name& name) const { return fmt::format("\"{}\"", *name.text); }
  std::string operator()(const Reference& reference) const {
    return reference.name->empty() ? "none" : fmt::format("\"{}\"", *reference.name);
  }
  std::string operator()(const References&) const { return "none"; }
  std::string operator()(const Words&) const { return "none"; }
  std::string operator()(const Choice& value) const {
    return fmt::format("\"{}\"", value.names[value.selected]);
  }
  std::string operator()(const Group&) const { return "none"; }
  std::string operator()(const List&) const { return "none"; }
};

}  // namespace

bool Bounds::contains(double value) const {
  return (lower_open ? value > lower : value >= lower) && (upper_open ? value < upper : value <= upper);
}

std::string Bounds::text() const {
  if (std::isinf(lower) && std::isinf(upper)) return {};
  if (std::isinf(upper)) return fmt::format("{} {:.7g}", lower_open ? ">" : ">=", lower);
  if (std::isinf(lower)) return fmt::format("{} {:.7g}", upper_open ? "<" : "<=", upper);
  return fmt::format("in {}{:.7g}, {:.7g}{}", lower_open ? '(' : '[', lower, upper, upper_open ? ')' : ']');
}

std::string type_text(const Key& key) { return std::visit(TypeText{}, key.target); }

std::string default_text(const Key& key) {
  if (key.presence == Presence::required) return "required";
  if (key.presence == Presence::one_of) return "one of";
  return std::visit(ValueText{}, key.target);
}

std::string Section::heading() const {
  switch (layout) {
    case Layout::table:
      return fmt::format("[{}]", name);
    case Layout::named:
      return fmt::format("[{}.NAME]", name);
    case Layout::list:
      return fmt::format("[[{}]]", name);
    case Layout::root:
      break;
  }
  return "before the first table";
}

}  // namespace duet::scene
