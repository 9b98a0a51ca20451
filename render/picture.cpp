#include "render/picture.h"

#include <algorithm>
#include <limits>
#include <memory>

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

Picture read_picture(const std::filesystem::path& path) {
  const std::string bytes = io::read_file(path);
  constexpr std::size_t most = std::numeric_limits<int>::max();
  Picture picture;
  const std::unique_ptr<unsigned char, void (*)(void*)> read(
      stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(bytes.data()),
                            static_cast<int>(std::min(bytes.size(), most)), &picture.width, &picture.height,
                            nullptr, 3),
      stbi_image_free);
  if (!read)
    throw FileError(path.string(), fmt::format("is no whole PNG or JPEG picture: {}", stbi_failure_reason()));
  const std::size_t size =
      3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
  picture.rgb.assign(read.get(), read.get() + size);
  return picture;
}

}  // namespace duet::render
