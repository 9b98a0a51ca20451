#include "sim/articulation/taut_chains.h"

#include <algorithm>
#include <deque>

#include "sim/articulation/joint_rows.h"
#include "sim/base/disjoint_sets.h"

namespace duet {
namespace {

// Largest length by which a taut chain exceeds the distance of its ends, over that length. A chain with more
// slack s sags by an angle of about sqrt(2 s) = 1.4e-5, at which its rows of velocity are independent of each
// other for BlockFactor, and hold it without the line.
constexpr double max_slack = 1e-10;

// A pin as one of its bodies sees it.
struct Link {
  int joint = -1;  // number of the joint
  int to = 0;      // the rigid part at its other end
  Vec3 here, far;  // m, its place on this part, and on the other one
};

// The graph of rigid parts (bodies that are one rigid body, known by the first of them) and pins.
class PinGraph {
 public:
  PinGraph(const Articulation& articulation, const RigidBodies& rigid)
      : parts_(rigid.size()), links_(rigid.size()), above_(rigid.size()), depth_(rigid.size(), -1) {
    find_parts(articulation, rigid);
    for (std::size_t j = 0; j < articulation.joints.size(); ++j) {
      const Joint& joint = articulation.joints[j];
      const int a = parts_.first(joint.parent), b = parts_.first(joint.child);
      if (a == b || travels(joint.kind) || joint.kind == JointKind::weld) continue;
      const JointFrames frames(joint, rigid.state[as_index(joint.parent)].pose,
                               rigid.state[as_index(joint.child)].pose);
      links_[as_index(a)].push_back({static_cast<int>(j), b, frames.parent, frames.child});
      links_[as_index(b)].push_back({static_cast<int>(j), a, frames.child, frames.parent});
    }
  }

  // Calls visit(loop) for the loop of every pin that is not in the tree: the pins in their order, each as the
  // part before it sees it.
  template <class Visit>
  void for_each_loop(Visit&& visit) {
    if (fixed_ >= 0) grow_tree(fixed_);
    for (std::size_t part = 0; part < links_.size(); ++part)
      if (depth_[part] < 0 && !links_[part].empty()) grow_tree(static_cast<int>(part));
    for (std::size_t part = 0; part < links_.size(); ++part)
      for (const Link& link : links_[part])
        if (static_cast<int>(part) < link.to && above_[part].joint != link.joint &&
            above_[as_index(link.to)].joint != link.joint)
          visit(loop_of(static_cast<int>(part), link));
  }

 private:
  void find_parts(const Articulation& articulation, const RigidBodies& rigid) {
    for (std::size_t body = 0; body < rigid.size(); ++body) {
      if (rigid.properties[body].moves()) continue;
      if (fixed_ < 0) fixed_ = static_cast<int>(body);
      parts_.join(fixed_, static_cast<int>(body));
    }
    for (const Joint& joint : articulation.joints)
      if (joint.kind == JointKind::weld) parts_.join(joint.parent, joint.child);
    if (fixed_ >= 0) fixed_ = parts_.first(fixed_);
  }

  // Grows a tree of shortest paths from `root` over all parts that pins connect with it.
  void grow_tree(int root) {
    std::deque<int> next{root};
    depth_[as_index(root)] = 0;
    for (; !next.empty(); next.pop_front())
      for (const Link& link : links_[as_index(next.front())]) {
        if (depth_[as_index(link.to)] >= 0) continue;
        depth_[as_index(link.to)] = depth_[as_index(next.front())] + 1;
        above_[as_index(link.to)] = {link.joint, next.front(), link.far, link.here};
        next.push_back(link.to);
      }
  }

  // Returns the loop that `link` of `part` closes: up from its other end to the part that both ends share,
  // and down to `part`.
  std::vector<Link> loop_of(int part, const Link& link) const {
    std::vector<Link> up{link}, down;
    for (int a = part, b = link.to; a != b;) {
      if (depth_[as_index(b)] >= depth_[as_index(a)]) {
        up.push_back(above_[as_index(b)]);
        b = up.back().to;
      } else {
        const Link& climbed = above_[as_index(a)];
        down.push_back({climbed.joint, a, climbed.far, climbed.here});
        a = climbed.to;
      }
    }
    up.insert(up.end(), down.rbegin(), down.rend());
    return up;
  }

  DisjointSets parts_;
  int fixed_ = -1;                        // the part of all static bodies; -1: there are none
  std::vector<std::vector<Link>> links_;  // per part
  std::vector<Link> above_;               // per part, the pin to the part above it in its tree
  std::vector<int> depth_;                // per part, in its tree; -1: in none
};

}  // namespace

void find_taut_chains(Articulation& articulation, const RigidBodies& rigid) {
  PinGraph(articulation, rigid).for_each_loop([&](const std::vector<Link>& loop) {
    if (loop.size() < 3) return;
    double sum = 0;
    Vec3 longest = Vec3::Zero();
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Vec3 between = loop[(i + 1) % loop.size()].here - loop[i].far;
      sum += between.norm();
      if (between.squaredNorm() > longest.squaredNorm()) longest = between;
    }
    if (!(sum - longest.norm() <= (1 + max_slack) * longest.norm())) return;
    for (const Link& link : loop) {
      Joint& joint = articulation.joints[as_index(link.joint)];
      if (joint.is_taut()) continue;
      const JointFrames frames(joint, rigid.state[as_index(joint.parent)].pose,
                               rigid.state[as_index(joint.child)].pose);
      joint.parent_line = frames.parent_axes.conjugate() * longest.normalized();
      joint.child_line = frames.child_axes.conjugate() * longest.normalized();
    }
  });
}

}  // namespace duet
