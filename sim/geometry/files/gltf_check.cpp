#include "sim/geometry/files/gltf_check.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <string_view>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/json_depth.h"

namespace duet {
namespace {

// Returns the number at a byte, little-endian.
std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 4; i-- > 0;) number = number << 8 | static_cast<unsigned char>(bytes[at + i]);
  return number;
}

// Returns the JSON of a .glb file: a header of 12 bytes ("glTF", version, length of the file) and chunks of
// length, type and data, of which the first one has the JSON. Throws FileError if the lengths are wrong.
std::string_view json_of_glb(const std::string& path, std::string_view bytes) {
  constexpr std::size_t header = 12, around = 8;  // bytes of the header, and of a chunk besides its data
  const auto fail = [&](const char* what) { throw FileError(path, what, "export the mesh again"); };
  if (bytes.size() < header + around) fail("is too short for a glTF file");
  if (number_at(bytes, 8) != bytes.size()) fail("has another length than its header says");
  const bool has_chunks = number_at(bytes, 4) > 1;  // version 1: the data after the JSON have no header
  for (std::size_t at = header; at < bytes.size(); at = has_chunks ? at : bytes.size()) {
    if (bytes.size() - at < around || number_at(bytes, at) > bytes.size() - at - around)
      fail("ends within one of its chunks");
    at += around + number_at(bytes, at);
  }
  return bytes.substr(header + around, number_at(bytes, header));
}

// Largest number of nodes on the way from a root of a glTF file down to a leaf. Exporters write some tens of
// them; Assimp overflows a stack of 8 MB between 5,000 and 20,000.
constexpr std::size_t max_node_depth = 1000;
// Largest number of nodes that Assimp makes of those of a file: nodes with several parents count several
// times.
constexpr double max_nodes = 1e6;

// What is known of a node of a glTF file.
struct GltfNode {
  std::vector<std::string> children;  // their keys in the file: numbers, or names in version 1
  std::vector<GltfNode*> parents;     // one for each time that it is listed as a child
  std::size_t pending = 0;            // children that have not been measured yet
  std::size_t depth = 1;              // nodes on the longest way down from it
  double below = 1;                   // nodes below it, and itself
};

// Returns the nodes of a glTF file by their keys. Children that do not exist are left out.
std::map<std::string, GltfNode> nodes_of(const nlohmann::json& document) {
  std::map<std::string, GltfNode> nodes;
  const auto list = document.find("nodes");
  if (list == document.end() || !list->is_structured()) return nodes;
  for (const auto& [key, value] : list->items()) {
    GltfNode& node = nodes[key];
    const auto children = value.is_object() ? value.find("children") : value.end();
    if (!value.is_object() || children == value.end() || !children->is_array()) continue;
    for (const nlohmann::json& child : *children)
      node.children.push_back(child.is_string() ? child.get<std::string>() : child.dump());
  }
  for (auto& [key, node] : nodes)
    for (const std::string& child : node.children)
      if (const auto found = nodes.find(child); found != nodes.end()) {
        found->second.parents.push_back(&node);
        ++node.pending;
      }
  return nodes;
}

// Throws FileError if nodes nest too deep, contain themselves, or are used again and again so that there are
// too many. It measures all nodes from the leaves up, without recursion.
void check_nodes(const std::string& path, const nlohmann::json& document) {
  std::map<std::string, GltfNode> nodes = nodes_of(document);
  std::vector<GltfNode*> measured;
  for (auto& [key, node] : nodes)
    if (node.pending == 0) measured.push_back(&node);
  for (std::size_t i = 0; i < measured.size(); ++i) {
    const GltfNode& node = *measured[i];
    if (node.depth > max_node_depth)
      throw FileError(path, fmt::format("nests nodes more than {} levels deep", max_node_depth),
                      "apply or flatten the hierarchy of the objects, and export the mesh again");
    if (node.below > max_nodes)
      throw FileError(path,
                      fmt::format("makes more than {:g} nodes by using some again and again", max_nodes),
                      "export the mesh again as one object");
    for (GltfNode* parent : node.parents) {
      parent->depth = std::max(parent->depth, node.depth + 1);
      parent->below += node.below;
      if (--parent->pending == 0) measured.push_back(parent);
    }
  }
  if (measured.size() < nodes.size())
    throw FileError(path, "has a node that is below itself", "export the mesh again");
}

}  // namespace

void check_gltf(const std::string& path) {
  const std::string bytes = io::read_file(path);
  if (bytes.starts_with("\xef\xbb\xbf"))
    throw FileError(path, "begins with a byte order mark, which glTF does not allow",
                    "save it as UTF-8 without the mark, or export the mesh again");
  const bool is_binary = bytes.starts_with("glTF");
  const std::string_view json = is_binary ? json_of_glb(path, bytes) : std::string_view(bytes);
  if (json_depth(json) > max_json_depth)
    throw FileError(path, "nests JSON too deep for a glTF file", "export the mesh again");
  // Assimp reports malformed JSON. It takes bytes that are no UTF-8, and zeros at the end, which this parser
  // does not.
  std::string plain(json.substr(0, json.find_last_not_of('\0') + 1));
  for (char& c : plain)
    if (static_cast<unsigned char>(c) > 127) c = '?';
  if (const nlohmann::json document = nlohmann::json::parse(plain, nullptr, false); document.is_object())
    check_nodes(path, document);
}

}  // namespace duet
