// Computes which fraction of an even load on a flat face each of a few of its points stands for.
#pragma once

#include <span>

#include <Eigen/Core>

namespace duet {

/// Moments of a convex polygon that is loaded evenly. They are means over its area, of the displacement from
/// its middle.
struct EvenLoad {
  Eigen::Vector2d middle{0, 0};          ///< m: center of the area.
  double area = 0;                       ///< m^2: area of the polygon.
  double mean_distance = 0;              ///< m: mean distance of its points from the middle.
  Eigen::Vector2d mean_direction{0, 0};  ///< Mean of the unit vectors (1) from the middle to its points.
};

/// Returns the moments of the convex polygon with the given corners (m), which follow each other
/// counter-clockwise. Its area must not be zero.
EvenLoad even_load(std::span<const Eigen::Vector2d> corners);

/// Changes the fractions `shares` of the load that points at `places` (m) carry, so that they act as the even
/// load does.
///
/// With the new shares the points make the same force and moments as the even load, and the same friction
/// when the face spins about its middle: the sums of 1, x, |x| and x/|x| over the points, weighted with the
/// shares, are the means over the polygon. The shares change as little as that allows. None becomes negative,
/// and their sum becomes 1. If the places do not allow all of these conditions, they are met as nearly as
/// possible.
void share_load(const EvenLoad& load, std::span<const Eigen::Vector2d> places, std::span<double> shares);

}  // namespace duet
