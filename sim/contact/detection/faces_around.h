// The faces of a mesh that a body touches beside the nearest one, as in a groove or a corner.
#pragma once

#include <vector>

#include "sim/contact/detection/candidate_search.h"

namespace duet {

// Appends the places where deepest points of `guest`, at the pose `in_host` in the space of its host, a mesh,
// are less than `margin` (m) above a face that turns away from the nearest surface by more than 5 degrees,
// and opposite which they are: one for each such plane. For a deepest point that has such places the plane of
// the nearest surface is among them, as face 0: in the middle of a groove rounding decides which of its sides
// that is, and each has to keep its contact for the step. Not so where another point of the guest is deepest
// towards that plane, as of a rim beside an edge of the host, below whose top most of it may be.
void find_faces_around(const LevelSet& host, const LevelSet& guest, const Pose& in_host, double margin,
                       std::vector<NearPoint>& touches, std::vector<EdgeContact>& places);

// The same for a sample of the guest, in sharp creases that go inwards: replaces the touch number `touch`,
// that of the sample, by one for its plane and appends those of the faces that rise from it, if there are
// any, with places of their own numbers (ContactPoint::guest_point). Each has to keep its plane for the step:
// of a box that stands in a groove with one edge, all samples are as near to one side as to the other.
void find_faces_around_sample(const LevelSet& host, const RigidProperties& guest, const Pose& in_host,
                              double margin, std::size_t touch, std::vector<NearPoint>& touches,
                              std::vector<EdgeContact>& places);

}  // namespace duet
