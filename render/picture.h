// Pictures in memory, and how they are read from files.
#pragma once

#include <filesystem>
#include <vector>

namespace duet::render {

/// A picture in 8-bit sRGB without alpha. Rows run from the top, with three bytes a pixel.
struct Picture {
  int width = 0,                   ///< pixels in a row
      height = 0;                  ///< rows
  std::vector<unsigned char> rgb;  ///< 3 * width * height bytes
  /// Compares size and bytes.
  bool operator==(const Picture&) const = default;
};

/// Reads a PNG or JPEG file. Alpha is dropped, and 16 bits a channel become 8. Throws FileError if the file
/// cannot be read or is no whole picture.
Picture read_picture(const std::filesystem::path& path);

}  // namespace duet::render
