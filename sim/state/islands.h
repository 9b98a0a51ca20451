// Which bodies move each other in a velocity solve. Each island of them is a system by itself: a heap need
// not wait for, nor work on, what flies above it.
#pragma once

#include <vector>

#include "sim/deformable/particle_mask.h"
#include "sim/state/bodies.h"

namespace duet {

// Bodies are numbered as in guest_node: rigid ones first, then deformable ones. Rigid bodies that are not
// dynamic belong to no island: they pass nothing on.
class Islands {
 public:
  // Particles of one body, few enough to be one of many tasks.
  struct Range {
    std::size_t begin = 0, end = 0, island = 0;
  };

  // Each body by itself, but for those that joints or bones hold together.
  void begin(const Bodies& bodies);
  void join_rigid(int a, int b) { join(static_cast<std::size_t>(a), static_cast<std::size_t>(b)); }
  void join_particle(int rigid, int particle) { join(static_cast<std::size_t>(rigid), node_of(particle)); }
  void join_particles(int a, int b) { join(node_of(a), node_of(b)); }
  // After the last join: all islands are searched.
  void finish();

  std::size_t size() const { return searched_.size(); }
  // Of a rigid body: -1 for those of none.
  int of_rigid(std::size_t body) const { return island_[body]; }
  int of_particle(int particle) const { return island_[node_of(particle)]; }

  // Whether a joint holds a body of an island, and whether it does so on any that is searched.
  bool has_joints(std::size_t island) const { return jointed_[island] != 0; }
  bool has_joints() const;

  // The islands that a solve still works on.
  bool is_searched(std::size_t island) const { return searched_[island]; }
  bool is_searched_rigid(std::size_t body) const {
    return island_[body] >= 0 && searched_[static_cast<std::size_t>(island_[body])];
  }
  std::size_t searched() const { return left_; }
  // Leaves an island out, once; to be followed by update(), before what is said below is so.
  void leave(std::size_t island) {
    searched_[island] = false;
    --left_;
  }
  void update();
  const std::vector<Range>& ranges() const { return ranges_; }  // of those that are searched
  const ParticleMask& mask() const { return mask_; }

 private:
  std::size_t node_of(int particle) const {
    return static_cast<std::size_t>(node_of_[static_cast<std::size_t>(particle)]);
  }
  void find_structure(const Bodies& bodies);
  std::size_t root(std::size_t node);
  void join(std::size_t a, std::size_t b);

  std::size_t left_ = 0;
  std::vector<std::size_t> parent_;  // of every body in a tree of its island
  std::vector<char> is_fixed_;       // of every body: it is of infinite mass
  std::vector<char> body_jointed_;   // of every body
  std::vector<char> jointed_;        // of every island
  std::vector<int> island_;          // of every body
  std::vector<int> node_of_;         // of every particle: its body, or that of the flesh it is tethered to
  std::vector<Range> bodies_;        // the particles of every body, whose number is in place of its island
  std::vector<char> searched_;       // of every island
  std::size_t in_ranges_ = 0;        // islands that are in ranges_
  std::vector<Range> ranges_;
  ParticleMask mask_;
};

}  // namespace duet
