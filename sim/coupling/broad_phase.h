// The broad phase: which bodies are so near each other that their points have to be looked at.
#pragma once

#include <vector>

#include "sim/coupling/body_bounds.h"
#include "sim/geometry/box_tree.h"

namespace duet {

struct CandidateFilter {
  bool rigid_pairs = true;       // effect rigid_contact
  bool rigid_deformable = true;  // effect rigid_deformable_contact
  bool reduce_contacts = true;   // see contact_reduction.h
};

struct BodyPair {
  int host = -1;              // rigid body with the level set
  int guest_rigid = -1;       // or -1
  int guest_deformable = -1;  // or -1
  bool operator==(const BodyPair&) const = default;
};

// A tree of boxes instead of sorted axes: its cost grows as N log N however the bodies lie, also in tall
// columns and next to huge or far bodies, and its queries run in parallel. Storage is kept from call to call.
class BroadPhase {
 public:
  // Bounds of all rigid and then all deformable bodies now, and the margin that each box is grown by before
  // find() (m, of as many bodies): to be set in between.
  std::vector<BodyBounds> bounds;
  std::vector<double> margin;

  // The pairs whose grown boxes meet, as far as the filter has them: every two rigid bodies that are not both
  // static appear twice, once with either one as the host (a half space is always the host), in the order of
  // (host, guest); then follow the pairs with deformable bodies in the order of (deformable, host). The
  // result does not depend on earlier calls.
  const std::vector<BodyPair>& find(const CandidateFilter& filter);

 private:
  struct Chunk {  // what the hosts or deformable bodies of one range found
    std::vector<BodyPair> pairs;
    std::size_t begin = 0;  // in pairs_
  };
  void query_host(int host, std::vector<BodyPair>& found) const;
  void query_deformable(int body, std::vector<BodyPair>& found) const;
  bool meets_half_space(int plane, std::size_t body) const;
  template <class Query>
  void query_all(std::size_t count, std::size_t first_chunk, Query&& query);

  BoxTree tree_;
  std::vector<Eigen::AlignedBox3d> boxes_;
  std::vector<int> bounded_, half_spaces_;  // rigid bodies
  std::size_t rigid_count_ = 0;
  std::vector<Chunk> chunks_;
  std::vector<BodyPair> pairs_;
};

}  // namespace duet
