// JSON from files that may be damaged or forged.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include <nlohmann/json.hpp>

#include "sim/base/json_depth.h"

namespace duet::io {

/// Returns the value that the text holds. Returns a discarded value, which is neither an object nor anything
/// else, if the text is malformed or nests deeper than `max_json_depth`.
template <class Json = nlohmann::json>
Json parse_json(std::string_view text) {
  if (json_depth(text) > max_json_depth) return Json(nlohmann::json::value_t::discarded);
  return Json::parse(text, nullptr, false);
}

/// Returns the value as an integer; none if it is no integer or `Integer` cannot hold it. Json::get() would
/// convert any number, with undefined behavior if it is out of range.
template <class Integer, class Json>
std::optional<Integer> integer_of(const Json& value) {
  if (!value.is_number_integer()) return std::nullopt;
  if (value.is_number_unsigned()) {
    const auto number = value.template get<std::uint64_t>();
    if (number > static_cast<std::uint64_t>(std::numeric_limits<Integer>::max())) return std::nullopt;
    return static_cast<Integer>(number);
  }
  const auto number = value.template get<std::int64_t>();
  if (number < static_cast<std::int64_t>(std::numeric_limits<Integer>::min())) return std::nullopt;
  return static_cast<Integer>(number);
}

/// Returns the text object[key]; empty if there is none or it is no text.
template <class Json>
std::string text_in(const Json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->template get<std::string>() : std::string();
}

}  // namespace duet::io
