// What the lists of keys are made of. Internal to the schema.
#pragma once

#include "sim/scene/schema.h"

namespace duet::scene {

inline const Bounds any{};
inline const Bounds positive{.lower = 0, .lower_open = true};
inline const Bounds non_negative{.lower = 0};
inline constexpr Presence required = Presence::required;
inline constexpr Presence one_of = Presence::one_of;

template <class Element>
List list(std::vector<Element>& elements) {
  return {[&elements] { return elements.size(); },
          [&elements](std::size_t i) {
            if (i >= elements.size()) elements.resize(i + 1);
            return keys(elements[i]);
          }};
}

}  // namespace duet::scene
