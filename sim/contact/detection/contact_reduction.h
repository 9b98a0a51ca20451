// A box that stands on another one touches it with dozens of points where a few carry it as well.
#pragma once

#include <span>
#include <vector>

#include "sim/contact/detection/candidate_search.h"

namespace duet {

// Drops those of the touches from `begin` on, all of one rigid guest near one host, that others stand for.
// Taken together are touches above one flat face of the host. Where at least five of them lie in one plane of
// the guest below which there is none, the corners of their convex hull are kept, and up to four points
// between its middle and corners that come first and carry the load. What lies above the hull, seen along the
// host's normal, is dropped, and so is what lies beside it within 45 degrees of the normal: as long as the
// guest turns by less than these 45 degrees in a step, no dropped point can come to lie deeper below the face
// than the deepest one kept, within a few millionths of `size` (m, of the guest). All others are kept: curved
// hosts, and what touches in a point or along an edge.
// Every such plane is a patch, appended to scratch.patches; its points are told their shares of the load.
void reduce_contacts(double size, std::size_t begin, std::vector<NearPoint>& touches,
                     ReductionScratch& scratch);

// Makes the deepest points and the places on ridges among the touches from `begin` on that lie in the plane
// of a patch points of it, such as that of the rim on which a can stands, or where an edge passes a face's
// end.
void adopt_others(double size, std::size_t begin, std::vector<NearPoint>& touches,
                  const ReductionScratch& scratch);

// For the touches from `begin` on, all of a pair of rigid bodies found both ways: drops points of one body
// that lie beneath a patch of the other, whose corners carry all that they could, and makes those beside it
// points of the patch. Of two patches that lie on each other the wider one counts. `size` (m) is that of
// both bodies, `guest_in_host` the pose of the pair's guest in the space of its host.
void join_patches(double size, const Pose& guest_in_host, std::size_t begin, std::vector<NearPoint>& touches,
                  ReductionScratch& scratch);

}  // namespace duet
