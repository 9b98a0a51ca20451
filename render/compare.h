// Differences between two pictures of the same size. All values are those of the sRGB bytes divided by 255,
// as a viewer sees them.
#pragma once

#include <string>

#include "render/picture.h"

namespace duet::render {

/// Measures of how much two pictures differ. The default is the result for equal pictures.
struct Difference {
  double maximum = 0;  ///< largest difference of a channel, 0 to 1
  double mean = 0;     ///< mean difference over all channels of all pixels, 0 to 1
  double rmse = 0;     ///< root mean square difference over all channels of all pixels, 0 to 1
  double share = 0;    ///< fraction of pixels that differ, i.e. have a channel off by more than the tolerance
  /// Number of pixels in the largest connected group of pixels that differ; corners connect.
  int max_patch = 0;
  /// Mean structural similarity of the luma (Wang et al. 2004), -1 to 1; 1 for equal pictures.
  double ssim = 1;
};

/// Bounds within which two pictures count as equal. The defaults lie between the rounding of another
/// processor (RMSE 9e-5, single pixels off by up to 17/255; tests/PROTOCOL.md) and the smallest real change
/// that was measured (a mesh of 21 instead of 20 thousand triangles: RMSE 0.0076, 7 % of the pixels). Larger
/// bounds let such changes pass; smaller ones fail on other processors.
struct DifferenceBounds {
  int tolerance = 4;     ///< in steps of 1/255: a pixel differs if one of its channels is off by more
  double rmse = 0.0005;  ///< largest RMSE
  double share = 0.001;  ///< largest fraction of pixels that differ
  int max_patch = 7;     ///< largest number of pixels in a connected group of pixels that differ
  double min_ssim = -1;  ///< smallest structural similarity; -1: any
};

/// Measures how much `a` and `b` differ. `tolerance` is that of DifferenceBounds (steps of 1/255). Throws
/// Error (usage) if the sizes differ.
Difference compare(const Picture& a, const Picture& b, int tolerance = DifferenceBounds().tolerance);

/// Lists the bounds that `difference` breaks, in words: "RMSE 0.0123 > 0.0005, ...". The text is empty if
/// there are none. NaN breaks a bound.
std::string broken_bounds(const Difference& difference, const DifferenceBounds& bounds);

/// Draws where and how much `a` and `b` differ. Equal pixels show `a` in dark gray. The others take a color
/// by the logarithm of the difference of their worst channel: from blue (1/255) over red (16/255) and orange
/// (128/255) to pale yellow (1). Throws Error (usage) if the sizes differ.
Picture difference_picture(const Picture& a, const Picture& b);

}  // namespace duet::render
