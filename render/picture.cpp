#include "render/picture.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <string_view>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#define STBI_ONLY_JPEG
// Without explicit vector instructions, JPEG textures have equal pixels on all processors. Unoptimized builds
// need this as well: their compiler does not take the library's shifts by a variable for shifts by a
// constant, and would not compile them.
#define STBI_NO_SIMD
#include <fmt/format.h>
#include <stb/stb_image.h>

#include "sim/base/files.h"

namespace duet::render {
namespace {

// Returns whether the file says that it has more pixels than it has room for: more than 2^24, and more than
// 1032 bytes of them for each of its bytes, the most that the compression of PNG makes of one. stb_image
// takes memory for as many as the file says. Returns false if the file cannot be understood.
bool has_impossible_size(const stbi_uc* bytes, int size) {
  constexpr std::size_t any_file = 1U << 24, bytes_of_one = 1032;
  int width = 0, height = 0, channels = 0;
  if (stbi_info_from_memory(bytes, size, &width, &height, &channels) == 0) return false;
  const std::size_t pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::size_t pixel_bytes =
      static_cast<std::size_t>(channels) * (stbi_is_16_bit_from_memory(bytes, size) != 0 ? 2 : 1);
  return pixels > any_file && pixels * pixel_bytes / bytes_of_one > static_cast<std::size_t>(size);
}

// Returns whether a table of Huffman codes in a JPEG file has more than 256 codes, which stb_image
// before 2.28 writes beyond its arrays. Markers are looked for at every byte, as stb_image finds them in
// damaged files, except in the segments of applications and comments.
bool has_impossible_codes(std::string_view bytes) {
  if (!bytes.starts_with("\xff\xd8")) return false;
  const auto byte = [&](std::size_t at) {
    return at < bytes.size() ? static_cast<unsigned char>(bytes[at]) : std::size_t{0};
  };
  for (std::size_t at = 2; at < bytes.size();) {
    const std::size_t marker = byte(at) == 0xff ? byte(at + 1) : 0;
    const std::size_t end = at + 2 + (byte(at + 2) << 8 | byte(at + 3));  // of a segment that begins here
    if (marker == 0xc4) {
      for (std::size_t table = at + 4, codes = 0; table < end && table < bytes.size(); table += 17 + codes) {
        codes = 0;
        for (std::size_t length = 1; length <= 16; ++length) codes += byte(table + length);
        if (codes > 256) return true;
      }
    }
    const bool is_of_application = (marker >= 0xe0 && marker <= 0xef) || marker == 0xfe;
    at = is_of_application ? end : at + 1;
  }
  return false;
}

}  // namespace

Picture read_picture(const std::filesystem::path& path) {
  const std::string bytes = io::read_file(path);
  constexpr std::size_t most = std::numeric_limits<int>::max();
  const auto* data = reinterpret_cast<const stbi_uc*>(bytes.data());
  const int size = static_cast<int>(std::min(bytes.size(), most));
  if (has_impossible_codes(bytes))
    throw FileError(path.string(), "is no whole PNG or JPEG picture: a table of codes is too long");
  if (has_impossible_size(data, size))
    throw FileError(path.string(), "is no whole PNG or JPEG picture: it has no room for its pixels");
  Picture picture;
  const std::unique_ptr<unsigned char, void (*)(void*)> read(
      stbi_load_from_memory(data, size, &picture.width, &picture.height, nullptr, 3), stbi_image_free);
  if (!read)
    throw FileError(path.string(), fmt::format("is no whole PNG or JPEG picture: {}", stbi_failure_reason()));
  const std::size_t rgb_bytes =
      3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  picture.rgb.assign(read.get(), read.get() + rgb_bytes);
  return picture;
}

}  // namespace duet::render
