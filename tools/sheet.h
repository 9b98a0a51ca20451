// Sheets of small pictures: `duet preview --moments`, and contact sheets of variations.
#pragma once

#include <vector>

#include "render/picture.h"

namespace duet::tools {

// A sheet of pictures of one size in rows from the top left, with gaps of 4 pixels between them.
class Sheet {
 public:
  // Makes a sheet for `count` pictures of `width` x `height` pixels. Throws Error (usage) if it is too large.
  Sheet(int count, int width, int height);
  // Adds the next picture: 8-bit RGB, rows from the top.
  void add(const std::vector<unsigned char>& rgb);
  // Returns the sheet as it is so far.
  const render::Picture& picture() const { return picture_; }

 private:
  const int columns_, width_, height_;
  int count_ = 0;  // pictures so far
  render::Picture picture_;
};

// Returns a smaller picture, of which each pixel is the mean of factor x factor pixels. The mean is taken of
// sRGB values as they are, which is good enough to look at, but not to measure.
render::Picture shrunk(const render::Picture& picture, int factor);

}  // namespace duet::tools
