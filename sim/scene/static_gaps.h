/// Hairline gaps between static bodies: a floor of pieces that are not quite flush.
#pragma once

#include <string>
#include <vector>

#include "sim/coupling/bodies.h"

namespace duet {

struct StaticGap {
  std::string first, second;  ///< names of the bodies
  double gap = 0;             ///< m, by their bounding boxes
};

/// Pairs of static bodies that are farther apart than bodies that adjoin (seams.h), and by less than a tenth
/// of the smallest size of either; none where no rigid body moves, and none with the ground.
std::vector<StaticGap> static_gaps(const Bodies& bodies);

/// What such gaps do and what helps, naming the first; empty where there is none.
std::string describe_gaps(const std::vector<StaticGap>& gaps);

}  // namespace duet
