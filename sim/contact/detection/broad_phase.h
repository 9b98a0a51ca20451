// The broad phase: finds the pairs of bodies that are so near each other that their points have to be looked
// at.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/base/parallel.h"
#include "sim/contact/detection/body_bounds.h"
#include "sim/geometry/queries/box_tree.h"

namespace duet {

/// Says which kinds of contacts a search looks for.
struct CandidateFilter {
  bool rigid_pairs = true;       ///< Pairs of rigid bodies: the effect rigid_contact.
  bool rigid_deformable = true;  ///< Rigid and deformable bodies: the effect rigid_deformable_contact.
  bool reduce_contacts = true;   ///< True if reduce_contacts() drops points that others stand for.
};

/// Two bodies that may touch: a rigid host and a guest of either kind.
struct BodyPair {
  int host = -1;                                     ///< Index of the rigid body with the level set.
  int guest_rigid = -1;                              ///< Index of a rigid guest; -1: the guest is deformable.
  int guest_deformable = -1;                         ///< Index of a deformable guest; -1: the guest is rigid.
  bool operator==(const BodyPair&) const = default;  ///< Compares all members.
};

/// Finds the pairs of bodies whose boxes meet, and keeps what it found from call to call.
///
/// Every body has a roomy box around the box that is asked about. As long as the latter stays inside, the
/// pairs of bodies whose roomy boxes meet stay known, and a call tests only those. For bodies that have left
/// their roomy boxes a call searches a tree of all roomy boxes. A tree is used instead of sorted axes because
/// its cost grows as N log N however the bodies lie, also in tall columns and next to huge or far bodies, and
/// because its queries run in parallel. Storage is kept from call to call.
class BroadPhase {
 public:
  /// Input of find(): bounds of all rigid and then all deformable bodies, as bound_bodies() gives them.
  std::vector<BodyBounds> bounds;

  /// Input of find(): m, by how much it grows the box of each body of `bounds`; as many as these.
  std::vector<double> margin;

  /// Finds the pairs that `filter` wants and whose grown boxes meet. Pairs of rigid bodies, at least one of
  /// which is dynamic, come first, in the order of (host, guest). Their host is the half space if there is
  /// one, and otherwise the body with the smaller index. Pairs with deformable bodies follow, in the order of
  /// (deformable body, host). The result does not depend on earlier calls, and is valid until the next one.
  const std::vector<BodyPair>& find(const CandidateFilter& filter);

  /// Numbers of pairs whose roomy boxes meet, summed over all calls.
  struct Counts {
    std::int64_t kept = 0,  ///< Pairs that were known from the call before.
        found = 0;          ///< Pairs that had to be searched for.
  };

  /// Returns the numbers of pairs kept and found since construction.
  const Counts& counts() const { return counts_; }

 private:
  void reset_if_changed(const CandidateFilter& filter);
  void update_boxes();
  void update_tree();
  void update_near();
  void query(int body, std::vector<BodyPair>& found) const;
  bool is_wanted(std::size_t a, std::size_t b) const;
  BodyPair pair_of(int a, int b) const;
  std::size_t guest_index(const BodyPair& pair) const;
  bool meet(const BodyPair& pair) const;

  CandidateFilter filter_;                // of the last call
  std::vector<char> kind_;                // kind_of() of each body, when `roomy_` and `near_` were made
  std::size_t rigid_count_ = 0;           // bodies of `bounds` that are rigid
  std::vector<int> bounded_,              // bodies with boxes
      half_spaces_;                       // bodies without boxes
  std::vector<Eigen::AlignedBox3d> box_,  // m, world: box of each body, grown by its margin
      roomy_;                             // m, world: roomy box around `box_`
  BoxTree tree_;                          // over `roomy_`
  std::size_t refitted_ = 0;              // roomy boxes that changed since the tree was built
  std::vector<char> anew_;                // for each body: whether its pairs have to be searched for
  std::vector<int> those_anew_;           // the bodies that `anew_` marks
  std::vector<BodyPair> near_;            // sorted pairs whose roomy boxes meet
  std::vector<BodyPair> found_,           // pairs that this call searched for
      merged_,                            // scratch: the next `near_`
      pairs_;                             // result of find()
  CollectScratch<BodyPair> ranges_;       // scratch
  Counts counts_;
};

}  // namespace duet
