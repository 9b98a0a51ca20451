// Contact of bodies that joints hold together: what strikes one of them moves all.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "sim/articulation/joint_solver.h"
#include "sim/contact/response/warm_start.h"

namespace duet {

// Of each rigid body the first of the dynamic ones that joints connect with it, itself included; -1 of bodies
// without a joint, and of more than `largest` bodies together.
std::vector<int> linked_bodies(const Bodies& bodies, std::size_t largest = 16);

// A wrench of an impulse (N s) at `arm` (m) from the centre of mass.
inline Vec6 wrench_of(const Vec3& arm, const Vec3& impulse) {
  Vec6 wrench;  // not by <<: where vectors are of four doubles g++ warns that it reads past the end of these
  wrench.head<3>() = impulse;
  wrench.tail<3>() = arm.cross(impulse);
  return wrench;
}

// How linked bodies answer impulses while their joints hold. Sweeps over contacts that saw the mass of one
// body by itself, with the joints put right between them, would need a number of rounds that grows with the
// ratio of the masses: 1000 kg on a plate of 0.1 kg that is welded to a wall fell through it.
class ArticulatedResponse {
 public:
  // To be called when the joints' rows or the poses have changed.
  void outdate() { is_current_ = false; }
  // Has contacts of linked bodies answer as their joints' rows let them now; impulses of the joints begin
  // anew. Returns itself, or null where there are no such contacts: then it must not be used.
  // Control is part of the joints where contact is solved for, not where damping is.
  ArticulatedResponse* prepare(const Bodies& bodies, JointSolver& joints, bool with_control,
                               ContactSet& contacts);
  // Gives contacts the responses back that the bodies by themselves have.
  void release(ContactSet& contacts) const;
  // The same as prepare() for contacts of the last step.
  const ArticulatedResponse* prepare(const Bodies& bodies, JointSolver& joints, const ContactCache& memory);
  // What the last call of prepare() returned.
  const ArticulatedResponse* prepared() const { return is_used_ ? this : nullptr; }
  ArticulatedResponse* prepared() { return is_used_ ? this : nullptr; }
  // Keeps the velocities, which satisfy the joints, for finish().
  void begin(const RigidBodies& rigid);

  bool contains(int body) const {
    const int group = group_of_[static_cast<std::size_t>(body)];
    return group >= 0 && !groups_[static_cast<std::size_t>(group)].is_cramped;
  }
  // Whether it contains all bodies with joints.
  bool is_complete() const;
  bool takes_part(const ContactPoint& contact) const {
    return contains(contact.host) || (contact.is_rigid_pair() && contains(contact.guest_rigid));
  }
  // What a wrench (N s, N m s about the centre of mass) on a linked body does to all that are linked with it.
  void push(RigidBodies& rigid, int body, const Vec6& wrench);
  // The same to velocities of all rigid bodies, m/s and rad/s.
  void push(int body, const Vec6& wrench, std::vector<Vec3>& linear, std::vector<Vec3>& angular) const;
  // Calls work(body) for all that are linked with `body`, itself included.
  template <class Work>
  void for_each_member(int body, Work&& work) const {
    const auto group = static_cast<std::size_t>(group_of_[static_cast<std::size_t>(body)]);
    for (const std::size_t member : groups_[group].members) work(member);
  }
  // Calls work(body, change of its twist) for all that are linked with `body`.
  template <class Work>
  void for_each_change(int body, const Vec6& wrench, Work&& work) const {
    const Group& group = groups_[static_cast<std::size_t>(group_of_[static_cast<std::size_t>(body)])];
    const auto column = first_row(static_cast<std::size_t>(body));
    for (const std::size_t moved : group.members)
      work(moved, Vec6(group.response.block<6, 6>(first_row(moved), column) * wrench));
  }
  // Of a linked body's twist for wrenches on `struck`, another one or itself.
  Mat6 response_of(int body, int struck) const;
  // Of a contact that takes part and holds the response of the bodies by themselves. Zero where the joints
  // leave no motion along the normal.
  ContactResponse response(const ContactPoint& contact, const Bodies& bodies) const;
  // As the function of the same name of a contact, of one that takes part.
  void apply_impulse(Bodies& bodies, const ContactPoint& contact, const Vec3& impulse);

  // Takes what the joints did since begin() away, which the joint solver is to do again. After it,
  // difference() is the largest change (m/s) against what the velocities of bodies with joints were before.
  void finish(RigidBodies& rigid);
  double difference(const RigidBodies& rigid) const;

 private:
  struct Group {
    std::vector<std::size_t> members;
    double mass = 0;           // kg
    Eigen::MatrixXd response;  // twists of all members for wrenches on all: 1/kg, 1/(kg m), 1/(kg m^2)
    // Contact and joints leave its members hardly any room together, as in a loop that lies flat: they then
    // count as not linked, and contact and joints have to come to terms in turn.
    bool is_cramped = false;
  };
  struct Member {
    std::size_t place = 0;                               // in its group
    Mat3 inertia = Mat3::Zero();                         // kg m^2, world axes
    double arm = 0;                                      // m
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();  // N s, N m s since begin()
    RigidState start, end;
  };
  void find_groups(const Bodies& bodies);
  void update(const Bodies& bodies, JointSolver& joints, bool with_control);
  void respond(const RigidBodies& rigid, const JointSolver& joints);
  Eigen::Index first_row(std::size_t body) const {  // of a group's response
    return 6 * static_cast<Eigen::Index>(member_[body].place);
  }
  Mat3 factor(const ContactPoint& contact, const Bodies& bodies) const;
  // Of all contacts that take part, as their groups let them; of the others, as bodies by themselves.
  void answer(const Bodies& bodies, ContactSet& contacts) const;
  void find_cramped(const ContactPoint& contact, const ContactResponse& answer, const Bodies& bodies);

  bool is_current_ = false, has_control_ = false, is_used_ = false;
  std::vector<std::size_t> others_;  // with joints, but not linked
  std::vector<int> group_of_;        // of every rigid body
  std::vector<Group> groups_;
  std::vector<Member> member_;          // of every rigid body
  std::vector<ContactResponse> own_;    // of every contact, by the bodies themselves
  std::vector<Vec3> linear_, angular_;  // scratch
};

}  // namespace duet
