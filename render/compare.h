// How much two pictures of the same size differ. Values are those of the sRGB bytes divided by 255, as a
// viewer sees them.
#pragma once

#include <string>

#include "render/picture.h"

namespace duet::render {

struct Difference {
  double maximum = 0;     // largest difference of a channel, in [0, 1]
  double mean = 0;        // mean of the differences of all channels of all pixels
  double rmse = 0;        // root of the mean of their squares
  double share = 0;       // of the pixels: those with a channel off by more than the tolerance
  int largest_patch = 0;  // pixels of the largest connected group of these; corners connect
  double ssim = 1;        // mean structural similarity of the luma (Wang et al. 2004), 1 for equal pictures
};

// What still counts as the same picture. The defaults lie between what another processor's rounding makes of
// a picture (RMSE 9e-5, single pixels off by up to 17/255; tests/PROTOCOL.md) and the smallest real change
// measured (a mesh of 21 instead of 20 thousand triangles: RMSE 0.0076, 7 % of the pixels).
struct Bounds {
  int tolerance = 4;       // of a channel, in steps of 1/255: pixels beyond it count as different
  double rmse = 0.0005;    // largest RMSE
  double share = 0.001;    // largest share of different pixels
  int largest_patch = 7;   // largest group of different pixels
  double least_ssim = -1;  // smallest SSIM; -1: any
};

// Throws Error (usage) when the sizes differ.
Difference compare(const Picture& a, const Picture& b, int tolerance = Bounds().tolerance);

// The bounds that the difference breaks, in words: "RMSE 0.0123 > 0.0005, ..."; empty when there are none.
std::string broken_bounds(const Difference& difference, const Bounds& bounds);

// Where and how much they differ: equal pixels in dark grey after `a`, different ones by their channel that
// is off most, from blue (1/255) over red (1/16) to pale yellow (1), by its logarithm. Throws Error (usage)
// when the sizes differ.
Picture difference_picture(const Picture& a, const Picture& b);

}  // namespace duet::render
