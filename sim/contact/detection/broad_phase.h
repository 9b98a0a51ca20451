// The broad phase: which bodies are so near each other that their points have to be looked at.
#pragma once

#include <cstdint>
#include <vector>

#include "sim/contact/detection/body_bounds.h"
#include "sim/geometry/queries/box_tree.h"

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

// Pairs persist: every body has a roomy box around the one that is asked about, and as long as it stays in
// there, so do the pairs whose roomy boxes meet. A call tests only those; of bodies that have left their
// boxes it finds the pairs anew, in a tree of all boxes. (A tree instead of sorted axes: its cost grows as N
// log N however the bodies lie, also in tall columns and next to huge or far bodies, and its queries run in
// parallel.) Storage is kept from call to call.
class BroadPhase {
 public:
  // Bounds of all rigid and then all deformable bodies now, and the margin that each box is grown by before
  // find() (m, of as many bodies): to be set in between.
  std::vector<BodyBounds> bounds;
  std::vector<double> margin;

  // The pairs whose grown boxes meet, as far as the filter has them: first those of rigid bodies of which at
  // least one is dynamic, in the order of (host, guest), where the host is the half space if there is one and
  // else the first of the two; then those with deformable bodies in the order of (deformable, host). The
  // result does not depend on earlier calls.
  const std::vector<BodyPair>& find(const CandidateFilter& filter);

  // Over all calls, of the pairs whose roomy boxes meet: those that stayed from the call before, and those
  // that had to be found.
  struct Counts {
    std::int64_t kept = 0, found = 0;
  };
  const Counts& counts() const { return counts_; }

 private:
  struct Chunk {  // what the bodies or pairs of one range gave
    std::vector<BodyPair> pairs;
    std::size_t begin = 0;  // where they go
  };
  void start_anew(const CandidateFilter& filter);
  void find_those_who_left();
  void update_tree();
  void update_near();
  void query(int body, std::vector<BodyPair>& found) const;
  bool is_wanted(std::size_t a, std::size_t b) const;
  BodyPair pair_of(int a, int b) const;
  std::size_t guest_index(const BodyPair& pair) const;
  bool meet(const BodyPair& pair) const;
  template <class Visit>
  void collect(std::size_t count, std::size_t grain, std::vector<BodyPair>& all, Visit&& visit);

  CandidateFilter filter_;
  std::vector<char> kind_;  // of every body; roomy boxes and pairs are of bodies of these kinds
  std::size_t rigid_count_ = 0;
  std::vector<int> bounded_, half_spaces_;
  std::vector<Eigen::AlignedBox3d> box_, roomy_;
  BoxTree tree_;              // of the roomy boxes
  std::size_t refitted_ = 0;  // boxes, since the tree was built
  std::vector<char> anew_;    // of every body: its pairs have to be found
  std::vector<int> those_anew_;
  std::vector<BodyPair> near_;  // whose roomy boxes meet
  std::vector<BodyPair> found_, merged_, pairs_;
  std::vector<Chunk> chunks_;
  Counts counts_;
};

}  // namespace duet
