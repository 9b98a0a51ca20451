// Motions in closed form.
#pragma once

#include "sim/base/types.h"

namespace duet::study {

// Returns the distance (m) that a body has slid down a slope after `t` (s) from `speed` (m/s), with Coulomb
// friction: v t + a t^2/2 with a = g (sin - mu cos). It stops where friction wins. `slope` is in degrees,
// `gravity` in m/s^2.
double slide_distance(double slope, double friction, double gravity, double speed, double t);

// Returns the angle of a pendulum from the vertical (rad) at time `t` (s), released at rest from `amplitude`
// (rad, between 0 and pi). `rate` is the angular frequency of small swings, sqrt(m g l / I) (rad/s).
double pendulum_angle(double amplitude, double rate, double t);

// Returns the sag (m) of the center of mass of a beam that is clamped at one end, under its own weight:
// bending and shear by Timoshenko, with the shear coefficient 5/6 of a rectangle and a Poisson ratio of 0.
// `load` is density times gravity (N/m^3); `length` and `height` are in m, `modulus` in Pa.
double mean_sag_of_cantilever(double load, double length, double height, double modulus);

// Returns the mean displacement (m) of a bar after `t` (s). It is clamped at one end, at rest at first, and
// then pulled along its axis by `gravity` (m/s^2). `speed` is that of sound (m/s). The solution of the wave
// equation is a sum over its modes.
double mean_stretch_of_bar(double length, double speed, double gravity, double t);

}  // namespace duet::study
