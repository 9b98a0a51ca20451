// Abbreviations that the lists of keys are made of. Internal to the schema.
#pragma once

#include "sim/scene/schema.h"

namespace duet::scene {

inline const Bounds any{};                                     ///< All numbers.
inline const Bounds positive{.lower = 0, .lower_open = true};  ///< Numbers above 0.
inline const Bounds non_negative{.lower = 0};                  ///< Numbers from 0 on.
inline constexpr Presence required = Presence::required;       ///< Abbreviates Presence::required.
inline constexpr Presence one_of = Presence::one_of;           ///< Abbreviates Presence::one_of.

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
