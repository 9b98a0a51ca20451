// Articulated response: contact of bodies that joints hold together. An impulse on one of them moves all.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/articulation/joint_solver.h"
#include "sim/contact/response/warm_start.h"

namespace duet {

/// Finds the jointed groups: dynamic bodies that joints connect. Returns for each rigid body the lowest
/// number among the members of its group; -1: it is not dynamic, has no joint, or belongs to a group of more
/// than `largest` bodies. The response of a group of n bodies is a dense matrix of 6n rows, which bounds
/// `largest`.
std::vector<int> linked_bodies(const Bodies& bodies, std::size_t largest = 16);

/// Returns the wrench (j, arm x j) of an `impulse` j (N s) that acts at `arm` (m, world axes) from the center
/// of mass: N s and N m s.
inline Vec6 wrench_of(const Vec3& arm, const Vec3& impulse) {
  Vec6 wrench;  // no operator <<: with vectors of four doubles g++ warns that it reads past their end
  wrench.head<3>() = impulse;
  wrench.tail<3>() = arm.cross(impulse);
  return wrench;
}

/// Whether the response of jointed bodies counts controlled joints as constraints.
enum class ControlledJoints {
  are_held,              ///< Their control rows are constraints: contact solves.
  are_held_with_limits,  ///< The limits that hold an impulse are constraints, too.
  are_free               ///< They turn freely about their axes: solves for damping, collisions.
};

/// Contact-space response of jointed groups (`linked` bodies): how their bodies answer impulses while their
/// joints hold. Sweeps over contacts that saw the mass of one body alone, with joint solves between them,
/// would need a number of rounds that grows with the mass ratio: 1000 kg on a plate of 0.1 kg that is welded
/// to a wall fell through it.
class ArticulatedResponse {
 public:
  /// Tells that the rows of the joints or the poses have changed, so that the next prepare() computes the
  /// responses.
  void outdate() { is_current_ = false; }
  /// Replaces ContactPoint::response of all contacts of jointed groups by the response under the present rows
  /// of the joints. Marks ill-conditioned groups, whose contacts keep the response of separate bodies.
  /// Returns `this`, or null if no contact meets a jointed group; the object must not be used then.
  ArticulatedResponse* prepare(const Bodies& bodies, JointSolver& joints, ControlledJoints controlled,
                               ContactSet& contacts);
  /// Gives contacts the responses back that they had before prepare().
  void release(ContactSet& contacts) const;
  /// Prepares for the cached contacts of the last step, at the present positions and without control. Returns
  /// `this`, or null if none of them meets a jointed group.
  const ArticulatedResponse* prepare(const Bodies& bodies, JointSolver& joints, const ContactCache& cache);
  /// Returns what the last call of prepare() returned.
  const ArticulatedResponse* prepared() const { return is_used_ ? this : nullptr; }
  /// Returns what the last call of prepare() returned.
  ArticulatedResponse* prepared() { return is_used_ ? this : nullptr; }
  /// Saves the velocities, which must satisfy the joints, for finish(), and resets the recorded impulses.
  void begin(const RigidBodies& rigid);

  /// Returns whether a rigid body belongs to a jointed group that is not ill-conditioned.
  bool contains(int body) const {
    const int group = group_of_[static_cast<std::size_t>(body)];
    return group >= 0 && !groups_[static_cast<std::size_t>(group)].is_ill_conditioned;
  }
  /// Returns whether it contains all dynamic bodies with joints.
  bool is_complete() const;
  /// Returns whether it contains the host or the guest of a contact.
  bool takes_part(const ContactPoint& contact) const {
    return contains(contact.host) || (contact.is_rigid_pair() && contains(contact.guest_rigid));
  }
  /// Applies a `wrench` (N s, and N m s about the center of mass) to a contained body: changes the velocities
  /// of all members of its group, and records the wrench for finish().
  void push(RigidBodies& rigid, int body, const Vec6& wrench);
  /// Adds the changes by a `wrench` on a contained body to the velocities of all rigid bodies, `linear` (m/s)
  /// and `angular` (rad/s). Records nothing.
  void push(int body, const Vec6& wrench, std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  /// Calls work(member) for all members of the jointed group of `body`, including itself.
  template <class Work>
  void for_each_member(int body, Work&& work) const {
    const auto group = static_cast<std::size_t>(group_of_[static_cast<std::size_t>(body)]);
    for (const std::size_t member : groups_[group].members) work(member);
  }
  /// Calls work(member, change of its twist) for all members of the group of `body`, on which `wrench` acts.
  template <class Work>
  void for_each_change(int body, const Vec6& wrench, Work&& work) const {
    const Group& group = groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(body)])];
    const auto column = first_row(static_cast<std::size_t>(body));
    for (const std::size_t moved : group.members)
      work(moved, Vec6(group.response.block<6, 6>(first_row(moved), column) * wrench));
  }
  /// Returns the change of the twist of `body` per wrench on `is_hit`: 1/kg, 1/(kg m), 1/(kg m^2). Zero if
  /// they belong to different groups. Both must have a group.
  Mat6 response_of(int body, int is_hit) const;
  /// Returns the response of a contact that takes part, and that holds the response of separate bodies.
  /// Returns a zero response if the joints leave no motion along the normal.
  ContactResponse response(const ContactPoint& contact, const Bodies& bodies) const;
  /// Applies `impulse` (N s) to the guest of a contact that takes part, and its opposite to the host. Jointed
  /// groups move as a whole.
  void apply_impulse(Bodies& bodies, const ContactPoint& contact, const Vec3& impulse);

  /// Sets the velocities of contained bodies to those of begin() changed by the recorded wrenches alone,
  /// without the answer of the joints, which a joint solve is to find again. Keeps the velocities before that
  /// for difference().
  void finish(RigidBodies& rigid);
  /// Returns the largest difference (m/s, at the farthest point of a body) between the present velocities of
  /// jointed bodies and those that finish() found. It measures by how much the joint solve disagrees with the
  /// response.
  double difference(const RigidBodies& rigid) const;

 private:
  // A jointed group.
  struct Group {
    std::vector<std::size_t> members;  // rigid bodies
    double mass = 0;                   // kg, of all members
    // Twists of all members per wrench on each: 1/kg, 1/(kg m), 1/(kg m^2). Six rows and columns for each
    // member.
    Eigen::MatrixXd response;
    // True if the group is ill-conditioned: contact and joints together leave its members hardly any motion,
    // as in a loop that lies flat. Its members then count as separate bodies, and contact and joint solves
    // alternate.
    bool is_ill_conditioned = false;
  };
  // A rigid body.
  struct Member {
    std::size_t place = 0;        // index among the members of its group
    Mat3 inertia = Mat3::Zero();  // kg m^2, world axes
    double arm = 0;               // m, half the diagonal of the bounding box
    Vec3 linear = Vec3::Zero(),   // N s, sum of the impulses since begin()
        angular = Vec3::Zero();   // N m s, sum of their moments about the center of mass
    RigidState start,             // state at begin()
        end;                      // state at finish()
  };
  void find_groups(const Bodies& bodies);
  // Computes the responses of all groups, unless they are up to date.
  void update(const Bodies& bodies, JointSolver& joints, ControlledJoints controlled);
  void respond(const RigidBodies& rigid, const JointSolver& joints);
  // Returns the first of the six rows of a body in the response of its group.
  Eigen::Index first_row(std::size_t body) const {
    return 6 * static_cast<Eigen::Index>(member_[body].place);
  }
  // Returns K, 1/kg: the change of the relative velocity at a contact per impulse there.
  Mat3 factor(const ContactPoint& contact, const Bodies& bodies) const;
  // Sets the responses of all contacts: under the joints if they take part, else those of separate bodies.
  void answer(const Bodies& bodies, ContactSet& contacts) const;
  // Marks the groups of a contact as ill-conditioned if its response `answer` shows it.
  void mark_ill_conditioned(const ContactPoint& contact, const ContactResponse& answer, const Bodies& bodies);

  bool is_current_ = false,          // true if the responses belong to the present rows and poses
      has_control_ = false,          // true if they include controlled joints
      is_used_ = false;              // true if the last prepare() found contacts of jointed groups
  std::vector<std::size_t> others_;  // dynamic bodies with joints whose group is too large
  std::vector<int> group_of_;        // for each rigid body: its group; -1: none
  std::vector<Group> groups_;
  std::vector<Member> member_;          // for each rigid body
  std::vector<ContactResponse> own_;    // for each contact: the response of separate bodies
  std::vector<Vec3> linear_, angular_;  // scratch of respond(): twists of all rigid bodies
};

}  // namespace duet
