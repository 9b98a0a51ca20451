// Pictures in memory, and reading them from files.
#pragma once

#include <filesystem>
#include <vector>

namespace duet::render {

// 8-bit sRGB, rows from the top, three bytes a pixel.
struct Picture {
  int width = 0, height = 0;
  std::vector<unsigned char> rgb;  // 3 * width * height
  bool operator==(const Picture&) const = default;
};

// Reads a PNG or JPEG file; transparency is left out, 16 bits a channel become 8. Throws FileError.
Picture read_picture(const std::filesystem::path& path);

}  // namespace duet::render
