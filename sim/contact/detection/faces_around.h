// Finds the faces of a mesh that a body touches beside the nearest one, as in a groove or a corner.
#pragma once

#include <vector>

#include "sim/contact/detection/candidate_search.h"

namespace duet {

/// Appends contacts of the support points of `guest` with several faces of its host. Does nothing unless
/// `host` is a mesh. `in_host` is the pose of the guest in the host's shape space.
///
/// A support point touches each plane of the host that turns by more than 5 degrees from the nearest surface,
/// if it is less than `margin` (m) above a face in that plane, opposite that face, and not at the end of it
/// (ends_at()), over which the guest slides. If there is such a plane, the plane of the nearest surface is
/// added as face 0. In the middle of a groove rounding decides which side is the nearest one, and each side
/// has to keep its contact for the step. Face 0 is left out if another point of the guest is the support
/// point towards that plane. An example is a rim beside an edge of the host: most of it may be below the
/// host's top. Each contact is appended to `touches`, and its plane to `places`.
void find_faces_around(const LevelSet& host, const LevelSet& guest, const Pose& in_host, double margin,
                       std::vector<NearPoint>& touches, std::vector<EdgeContact>& places);

/// Appends contacts of a sample of `guest` with the faces of a sharp concave crease of its host. Does nothing
/// unless `host` is a mesh whose crease is near the sample. `in_host` is the pose of the guest in the host's
/// shape space.
///
/// `touches[touch]` is the touch of the sample. If faces rise from its plane less than `margin` (m) away, it
/// is replaced by one with that plane, and one touch is appended for each of these faces; their planes are
/// appended to `places`. There are at most four planes, each with a FeatureId of its own. Each has to keep
/// its contact for the step: all samples of a box that stands in a groove with one edge are as near to one
/// side as to the other.
void find_faces_around_sample(const LevelSet& host, const RigidProperties& guest, const Pose& in_host,
                              double margin, std::size_t touch, std::vector<NearPoint>& touches,
                              std::vector<EdgeContact>& places);

}  // namespace duet
