// Reduces the contact points of flat faces: a box that stands on another one touches it with dozens of points
// where a few carry the same load.
#pragma once

#include <span>
#include <vector>

#include "sim/contact/detection/candidate_search.h"

namespace duet {

/// Drops those of the touches from `begin` on for which others stand. All of them belong to one rigid guest
/// near one host.
///
/// Touches above one flat face of the host are taken together. If at least five of them lie in one supporting
/// plane of the guest, below which it has no other touch, the corners of their convex hull are kept, and up
/// to four points between its middle and its corners. The latter come first and carry the load. Two kinds of
/// touches are dropped: those above the hull, as seen along the host's normal, and those beside the hull
/// within 45 degrees of the normal. So as long as the guest turns by less than 45 degrees in a step, no
/// dropped point can come to lie deeper below the face than the deepest one kept, to within a few millionths
/// of `size` (m, of the guest). All other touches are kept, such as those on curved hosts, at a point or
/// along an edge. Every such plane becomes a patch: it is appended to `scratch.patches`, and its touches get
/// their `patch` and their `share` of the load.
void reduce_contacts(double size, std::size_t begin, std::vector<NearPoint>& touches,
                     ReductionScratch& scratch);

/// Makes support points and edge contacts points of a patch if they lie in its plane. It looks at the touches
/// from `begin` on. Examples are the support point on the rim on which a can stands, and the place where an
/// edge passes the end of a face. `size` (m) is that of the guest.
void add_to_patches(double size, std::size_t begin, std::vector<NearPoint>& touches,
                    const ReductionScratch& scratch);

/// Joins patches that two rigid bodies found on each other. All touches from `begin` on belong to that pair,
/// found in both directions. Points of one body that lie beneath a patch of the other are dropped, because
/// the corners of the patch carry all that they could; points beside it become points of the patch. Of two
/// patches that lie on each other the wider one counts. `size` (m) is that of both bodies together,
/// `guest_in_host` the pose of the pair's guest in the shape space of its host.
void join_patches(double size, const Pose& guest_in_host, std::size_t begin, std::vector<NearPoint>& touches,
                  ReductionScratch& scratch);

}  // namespace duet
