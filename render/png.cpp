// PNG files by zlib. The filter "up" at compression level 1 is 5 times faster than stb_image_write, and the
// files are no larger. The sRGB chunk states the color space of the bytes.
#include <cstdint>
#include <string_view>

#include <fmt/format.h>
#include <zlib.h>

#include "render/sequence.h"
#include "sim/base/error.h"
#include "sim/base/files.h"

namespace duet::render {
namespace {

// Keyword of the text chunk that names the maker of a picture, with the zero byte at its end.
constexpr std::string_view maker_key("Software\0", 9);

// Appends four bytes, the most significant first.
void append_u32(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>((value >> shift) & 0xff));
}

// Appends a chunk: length, type, data, and the checksum of type and data.
void append_chunk(std::string& png, const std::string& type, const std::string& data) {
  append_u32(png, static_cast<std::uint32_t>(data.size()));
  const std::string body = type + data;
  png += body;
  append_u32(png, static_cast<std::uint32_t>(
                      crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()))));
}

// Returns each row as the number of its filter and the differences from the row above; those of the first row
// are from zero.
std::string filter_rows(int width, int height, const std::vector<unsigned char>& rgb) {
  constexpr char up = 2;
  const std::size_t row_bytes = 3 * static_cast<std::size_t>(width);
  std::string rows;
  rows.reserve((row_bytes + 1) * static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    rows.push_back(up);
    const unsigned char* row = rgb.data() + y * row_bytes;
    for (std::size_t i = 0; i < row_bytes; ++i)
      rows.push_back(static_cast<char>(y == 0 ? row[i] : row[i] - *(row + i - row_bytes)));
  }
  return rows;
}

// Compresses by zlib at level 1. Throws FileError that names `path`.
std::string compress_rows(const std::string& rows, const std::string& path) {
  uLongf size = compressBound(static_cast<uLong>(rows.size()));
  std::string packed(size, '\0');
  const int status =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
                static_cast<uLong>(rows.size()), 1);
  if (status != Z_OK)
    throw FileError(path, fmt::format("zlib cannot compress the picture (status {})", status));
  packed.resize(size);
  return packed;
}

}  // namespace

std::string png_bytes(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb,
                      const std::string& maker) {
  if (width < 1 || height < 1 ||
      rgb.size() != 3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height))
    throw FileError(path,
                    fmt::format("{} bytes are no picture of {} x {} pixels", rgb.size(), width, height));
  std::string header;
  append_u32(header, static_cast<std::uint32_t>(width));
  append_u32(header, static_cast<std::uint32_t>(height));
  header += std::string("\x08\x02\x00\x00\x00",
                        5);  // 8 bits, RGB; the only compression and filter kinds; no interlace

  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk(png, "IHDR", header);
  append_chunk(png, "sRGB", std::string(1, '\0'));  // perceptual intent
  if (!maker.empty()) append_chunk(png, "tEXt", std::string(maker_key) + maker);
  append_chunk(png, "IDAT", compress_rows(filter_rows(width, height, rgb), path));
  append_chunk(png, "IEND", "");
  return png;
}

void write_png(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb,
               const std::string& maker) {
  io::write_atomically(path, png_bytes(path, width, height, rgb, maker));
}

bool is_made_by(const std::filesystem::path& file, const std::string& maker) {
  constexpr std::size_t before = 8 + 25 + 13 + 4;  // bytes of the signature, IHDR, sRGB, and a length
  const std::string mark = "tEXt" + std::string(maker_key) + maker;
  std::string start;
  io::read_pieces(file, [&](std::string_view piece) {
    start += piece;
    return start.size() < before + mark.size();
  });
  return start.size() >= before && std::string_view(start).substr(before).starts_with(mark);
}

bool is_whole_png(std::string_view bytes, int width, int height) {
  constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";
  constexpr std::size_t around = 12;  // bytes of a chunk besides its data: length, type and checksum
  const auto number_at = [&](std::size_t at) {  // big-endian
    std::uint32_t number = 0;
    for (std::size_t i = at; i < at + 4; ++i) number = number << 8 | static_cast<unsigned char>(bytes[i]);
    return number;
  };
  if (!bytes.starts_with(signature)) return false;
  for (std::size_t at = signature.size(); at + around <= bytes.size();) {
    const std::size_t length = number_at(at);
    if (length > bytes.size() - at - around) return false;
    const std::string_view body = bytes.substr(at + 4, length + 4);  // type and data
    if (crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size())) !=
        number_at(at + 8 + length))
      return false;
    if (body.starts_with("IHDR") && (length < 8 || number_at(at + 8) != static_cast<std::uint32_t>(width) ||
                                     number_at(at + 12) != static_cast<std::uint32_t>(height)))
      return false;
    if (body.starts_with("IEND")) return true;
    at += around + length;
  }
  return false;
}

}  // namespace duet::render
