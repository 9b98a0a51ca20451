// Abbreviations that the lists of keys are made of. Internal to the schema.
#pragma once

#include "sim/scene/schema.h"

namespace duet::scene {

inline const Bounds any{};                                     ///< All numbers.
inline const Bounds positive{.lower = 0, .lower_open = true};  ///< Numbers above 0.
inline const Bounds non_negative{.lower = 0};                  ///< Numbers from 0 on.
inline constexpr Presence required = Presence::required;       ///< Abbreviates Presence::required.
inline constexpr Presence one_of = Presence::one_of;           ///< Abbreviates Presence::one_of.

/// Returns the bounds of numbers from `lower` to `upper`, both included.
inline Bounds between(double lower, double upper) { return {.lower = lower, .upper = upper}; }
/// Returns the bounds of numbers above `lower`, up to `upper`.
inline Bounds above_up_to(double lower, double upper) {
  return {.lower = lower, .upper = upper, .lower_open = true};
}

/// Returns the choice of an enum value by its name; `names` are in the order of the enum.
template <class Enum>
Choice choice(Enum& target, std::vector<std::string_view> names) {
  return {std::move(names), static_cast<std::size_t>(target),
          [&target](std::size_t i) { target = static_cast<Enum>(i); }};
}
/// Returns the choice of a text among `names`.
inline Choice choice(std::string& target, std::vector<std::string_view> names) {
  std::size_t selected = 0;
  while (selected + 1 < names.size() && names[selected] != target) ++selected;
  return {names, selected, [&target, names](std::size_t i) { target = names[i]; }};
}

/// Returns a List that is bound to `elements`: it grows the vector as elements are read, and describes each
/// one by keys(Element&).
template <class Element>
List list(std::vector<Element>& elements) {
  return {[&elements] { return elements.size(); },
          [&elements](std::size_t i) {
            if (i >= elements.size()) elements.resize(i + 1);
            return keys(elements[i]);
          }};
}

}  // namespace duet::scene
