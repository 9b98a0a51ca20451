// Bounds on where bodies are and how fast their surfaces move: what tells, without looking at any surface
// point, that two bodies are apart and for how long they will be.
#pragma once

#include <vector>

#include "sim/state/bodies.h"

namespace duet {

// A box with rounded edges around a body: all points no farther than `radius` from the box of the half sizes
// `half` along `axes` about `center`. Balls and capsules fill theirs. The half space y <= 0 of its axes about
// `center` if `is_half_space`.
struct BodyBounds {
  Vec3 center = Vec3::Zero();         // m
  Mat3 axes = Mat3::Identity();       // columns
  Vec3 half = Vec3::Zero();           // m
  double radius = 0;                  // m
  Vec3 velocity = Vec3::Zero();       // m/s, in the middle of the velocities of its points
  Vec3 velocity_half = Vec3::Zero();  // m/s, of deformable bodies: how far theirs lie off, along world axes
  Vec3 spin = Vec3::Zero();           // rad/s, of rigid bodies: the part that moves their surface
  double arm = 0;                     // m, of rigid bodies: lever arm on which `spin` moves their surface
  double thickness = 0;               // m, of rigid bodies: LevelSet::smallest_size()
  bool is_half_space = false;
  bool is_static = false;  // never moves
  bool is_dynamic = true;  // moves as forces make it
  bool is_deformable = false;
};

// Of all rigid bodies, then of all deformable ones, as they are and move now.
void bound_bodies(const Bodies& bodies, std::vector<BodyBounds>& bounds);

// The axis-aligned box around the body, grown by `margin` (m); not for half spaces.
Eigen::AlignedBox3d world_box(const BodyBounds& body, double margin);

// No point of the body moves faster than that, m/s.
double fastest(const BodyBounds& body);

// A lower bound on the distance of two bodies, m; negative where it finds no plane between them. Exact for
// balls, and for bodies that face each other with the faces of their boxes.
double separation(const BodyBounds& a, const BodyBounds& b);

// How long two bodies surely do not overlap by more than `depth` (m), s: as long as a plane along which they
// are apart, or overlap by no more, finds them so. While they are farther apart than `depth` that time ends
// before they touch. Within it either may fall while something holds the other: a step of t takes them up to
// |e . gravity| t^2 farther along e.
double time_apart(const BodyBounds& a, const BodyBounds& b, double depth, const Vec3& gravity);

}  // namespace duet
