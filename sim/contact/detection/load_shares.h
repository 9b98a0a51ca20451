// Which part of an even load each of a few points of a flat face stands for.
#pragma once

#include <span>

#include <Eigen/Core>

namespace duet {

// Of a convex polygon that is loaded evenly, seen from its middle.
struct EvenLoad {
  Eigen::Vector2d middle{0, 0};          // centre of area, m
  double area = 0;                       // m^2
  double mean_distance = 0;              // of its points from the middle, m
  Eigen::Vector2d mean_direction{0, 0};  // of the unit vectors to them
};

// For corners (m) that follow each other counter-clockwise.
EvenLoad even_load(std::span<const Eigen::Vector2d> corners);

// Changes the shares, as little as that allows, so that points at `places` (m) with these parts of the load
// make the same force and the same moments as the even load, and the same friction when the face spins about
// its middle: the sums of 1, x, |x| and x/|x| over points with these shares are the means over the polygon.
// None becomes negative. Where the places do not allow for all of that it comes as near as they do.
void share_load(const EvenLoad& load, std::span<const Eigen::Vector2d> places, std::span<double> shares);

}  // namespace duet
