#include "sim/geometry/files/gltf_check.h"

#include <cstdint>
#include <string_view>

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

}  // namespace

void check_gltf(const std::string& path) {
  const std::string bytes = io::read_file(path);
  const bool is_binary = bytes.starts_with("glTF");
  if (json_depth(is_binary ? json_of_glb(path, bytes) : std::string_view(bytes)) > max_json_depth)
    throw FileError(path, "nests JSON too deep for a glTF file", "export the mesh again");
}

}  // namespace duet
