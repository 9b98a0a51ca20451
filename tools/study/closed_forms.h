// Motions that are known on paper.
#pragma once

#include "sim/base/types.h"

namespace duet::study {

// m, the way after `t` seconds of what starts at `speed` (m/s) down a slope (degrees) with Coulomb friction
// under `gravity` (m/s^2); it stops where friction wins.
double way_down_slope(double slope, double friction, double gravity, double speed, double t);

// rad, the angle from the vertical of a pendulum let go at rest at `amplitude` (rad, in (0, pi)); `rate`:
// rad/s of small swings, the root of m g l / I.
double pendulum_angle(double amplitude, double rate, double t);

// m, the sag of the centre of mass of a beam that is clamped at one end, under its weight: bending and shear
// by Timoshenko with the shear coefficient 5/6 of a rectangle and Poisson's ratio 0. `load`: N/m^3 (density
// times gravity); `length` and `height` in m; `modulus` in Pa.
double mean_sag_of_cantilever(double load, double length, double height, double modulus);

// m, the mean displacement after `t` seconds of a bar that is clamped at one end, at rest at first and then
// pulled along its axis by `gravity` (m/s^2); `speed` of sound in m/s. The wave equation by its modes.
double mean_stretch_of_bar(double length, double speed, double gravity, double t);

}  // namespace duet::study
