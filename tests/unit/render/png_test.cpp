#include <gtest/gtest.h>

#define STB_IMAGE_IMPLEMENTATION
#define STB_IMAGE_STATIC
#define STBI_ONLY_PNG
#include <filesystem>
#include <fstream>
#include <sstream>

#include <stb/stb_image.h>

#include "render/picture.h"
#include "render/sequence.h"
#include "sim/base/error.h"
#include "sim/base/scratch_folder.h"

namespace duet::render::png_test {
namespace {

class Png : public testing::Test {
 protected:
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

 private:
  const ScratchFolder folder_;
};

std::vector<unsigned char> noise(int width, int height) {
  std::vector<unsigned char> rgb(3 * static_cast<std::size_t>(width * height));
  unsigned state = 1;
  for (unsigned char& byte : rgb)
    byte = static_cast<unsigned char>((state = 1664525 * state + 1013904223) >> 24);
  return rgb;
}

std::string bytes_of(const std::string& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

TEST_F(Png, IsReadBackExactly) {
  for (const auto& [width, height] : {std::pair(1, 1), std::pair(37, 5), std::pair(64, 48)}) {
    const std::vector<unsigned char> rgb = noise(width, height);
    write_png(file("a.png"), width, height, rgb);
    int w = 0, h = 0, channels = 0;
    unsigned char* read = stbi_load(file("a.png").c_str(), &w, &h, &channels, 0);
    ASSERT_NE(read, nullptr) << stbi_failure_reason();
    EXPECT_EQ(w, width);
    EXPECT_EQ(h, height);
    EXPECT_EQ(channels, 3);
    EXPECT_TRUE(std::equal(rgb.begin(), rgb.end(), read));
    stbi_image_free(read);
  }
}

TEST_F(Png, SaysThatItIsSrgbAndIsTheSameEveryTime) {
  write_png(file("a.png"), 20, 10, noise(20, 10));
  write_png(file("b.png"), 20, 10, noise(20, 10));
  const std::string bytes = bytes_of(file("a.png"));
  EXPECT_EQ(bytes, bytes_of(file("b.png")));
  EXPECT_NE(bytes.find("sRGB"), std::string::npos);
}

TEST_F(Png, BadSizesAndFoldersAreErrors) {
  EXPECT_THROW(write_png(file("a.png"), 20, 10, noise(20, 9)), FileError);
  EXPECT_THROW(write_png(file("missing/a.png"), 20, 10, noise(20, 10)), FileError);
}

// Without the bound, 18000 x 18000 pixels take 1 GB.
TEST_F(Png, PicturesWithoutRoomForTheirPixelsAreRefused) {
  std::string bytes = png_bytes(file("a.png"), 1, 1, {1, 2, 3});
  for (const std::size_t at : {16U, 20U})
    bytes.replace(at, 4, std::string("\0\0\x46\x50", 4));  // width, height
  std::ofstream(file("a.png"), std::ios::binary) << bytes;
  try {
    read_picture(file("a.png"));
    ADD_FAILURE() << "the picture was accepted";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("has no room for its pixels"), std::string::npos)
        << error.what();
  }
}

// Before version 2.28, stb_image writes such a table beyond its arrays.
TEST_F(Png, JpegTablesOfTooManyCodesAreRefused) {
  const std::string start = "\xff\xd8\xff\xe0" + std::string("\0\4ab", 4);
  const std::string counts(16, 17);  // of the codes of each length: 272 in all
  std::ofstream(file("a.jpg"), std::ios::binary)
      << start << std::string("\xff\xc4\1\x23\0", 5) << counts << std::string(272, 1);
  try {
    read_picture(file("a.jpg"));
    ADD_FAILURE() << "the picture was accepted";
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("a table of codes is too long"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace duet::render::png_test
