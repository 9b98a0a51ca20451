#include "sim/scene/places.h"

#include <fmt/format.h>

namespace duet::scene {
namespace {

// Removes the last key or index from the path; the path ends empty.
void shorten(std::string& path) {
  const auto last = path.find_last_of(".[");
  path.resize(last == std::string::npos ? 0 : last);
}

}  // namespace

// Adds the source positions of `node` and of all nodes inside of it to `places`. `path` is the path of the
// table that is copied, and `below` the path from there to the node.
void CopiedPlaces::record(const toml::node& node, const std::string& path, const std::string& below,
                          Places& places) const {
  places.emplace(below, node.source().begin.line > 0 ? node.source() : find(path + below));
  if (const toml::table* table = node.as_table())
    for (auto&& [key, value] : *table) record(value, path, fmt::format("{}.{}", below, key.str()), places);
  if (const toml::array* array = node.as_array())
    for (std::size_t i = 0; i < array->size(); ++i)
      record((*array)[i], path, fmt::format("{}[{}]", below, i), places);
}

std::shared_ptr<const Places> CopiedPlaces::of(const toml::table& original, const std::string& path) const {
  auto places = std::make_shared<Places>();
  record(original, path, "", *places);
  return places;
}

void CopiedPlaces::add(const std::string& path, std::shared_ptr<const Places> places) {
  copies_.insert_or_assign(path, std::move(places));
}

toml::source_region CopiedPlaces::find(const std::string& path) const {
  for (std::string outer = path; !outer.empty(); shorten(outer)) {
    const auto copy = copies_.find(outer);
    if (copy == copies_.end()) continue;
    for (std::string below = path.substr(outer.size());; shorten(below)) {
      const auto place = copy->second->find(below);
      if (place != copy->second->end()) return place->second;
    }
  }
  return {};
}

}  // namespace duet::scene
