#include "sim/contact/push_out/pinching.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>

namespace duet {
namespace {

// Largest cosine of the angle between the normals of two hosts that face each other.
constexpr double facing = -0.5;
// Additional yield of the guest, over its thickness. The points of a face share particles, and without
// play the targets of the two hosts, which contradict each other by rounding, would push without end. A
// larger value leaves more room between the guest and its hosts.
constexpr double play = 0.005;
// Least cosine of the angle between the normals of a sheet and of a host at which the normal of the host
// tells on which side of the sheet the host is.
constexpr double tells_side = 0.2;

// Adds a pinch to the list, or lowers the room of the one between the same bodies.
void note(const Pinch& pinch, std::vector<Pinch>& pinches) {
  for (Pinch& known : pinches)
    if (std::tie(known.guest_deformable, known.first, known.second) ==
        std::tie(pinch.guest_deformable, pinch.first, pinch.second)) {
      known.room = std::min(known.room, pinch.room);
      return;
    }
  pinches.push_back(pinch);
}

// Computes how much one guest yields between its hosts.
class Pincher {
 public:
  Pincher(const Bodies& bodies, double dt, int guest, std::vector<Vec3>& normals, std::vector<Pinch>* pinches)
      : bodies_(bodies),
        dt_(dt),
        guest_(guest),
        thickness_(bodies.deformable[as_index(guest)].thickness),
        is_sheet_(bodies.deformable[as_index(guest)].triangle_count > 0),
        normals_(normals),
        pinches_(pinches) {
    if (is_sheet_) find_normals(bodies.deformable[as_index(guest)]);
  }

  // By how much the guest yields at a contact.
  struct Yield {
    double amount = 0;            // m
    bool face_each_other = true;  // false: the hosts are on either side of a rim
  };

  // Returns the yield at a contact between the host of the contact and the host `other`.
  Yield between(const ContactPoint& contact, int other) const {
    const RigidState &host = bodies_.rigid.state[as_index(contact.host)],
                     &second = bodies_.rigid.state[as_index(other)];
    const LevelSet& shape = bodies_.rigid.properties[as_index(other)].shape;
    const Pose other_pose = shape_pose(bodies_.rigid, as_index(other));
    const Vec3 x = host.pose.position + contact.host_arm, in_other = other_pose.to_body(x);
    const Vec3 v = point_velocity(host, contact.host_arm),
               v_other = point_velocity(second, x - second.pose.position);
    const double to_host = contact.gap - contact.yielded - surface_point(bodies_, contact).contact_offset,
                 to_other = shape.distance(in_other);  // m, both from the middle surface of the guest
    if (to_host + to_other - dt_ * (v.norm() + v_other.norm()) >= thickness_) return {};
    const Vec3 normal = other_pose.orientation * shape.normal(in_other);
    const double end = to_host - dt_ * v.dot(contact.normal),
                 other_end = to_other - dt_ * v_other.dot(normal);
    const double room = end + other_end;
    if (room >= thickness_) return {};
    const bool face_each_other = normal.dot(contact.normal) <= facing;
    if (!face_each_other &&
        !(is_sheet_ && std::max(end, other_end) < thickness_ / 2 &&
          side(contact, x, contact.host, contact.normal) * side(contact, x, other, normal) < 0))
      return {};
    if (pinches_ && face_each_other)
      note({guest_, std::min(contact.host, other), std::max(contact.host, other), room}, *pinches_);
    const double amount = face_each_other ? (thickness_ - room) / 2 : thickness_ / 2 - end;
    return {amount + play * thickness_, face_each_other};
  }

 private:
  // Computes a normal for every particle of a sheet, whose length is twice the area of the triangles around
  // it.
  void find_normals(const DeformableBody& sheet) {
    const std::vector<Vec3>& x = bodies_.particles.x;
    normals_.resize(x.size());
    for_each_particle(sheet, [&](std::size_t p) { normals_[p].setZero(); });
    for (int t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const Triangle& triangle = bodies_.triangles[as_index(t)];
      const Vec3& a = x[as_index(triangle[0])];
      const Vec3 area = (x[as_index(triangle[1])] - a).cross(x[as_index(triangle[2])] - a);
      for (const int p : triangle) normals_[as_index(p)] += area;
    }
  }

  // Returns a number that is positive if the host is behind the sheet and negative if it is in front. The
  // normal of the host tells, or its center if that normal leads along the sheet, as at a rim.
  double side(const ContactPoint& contact, const Vec3& x, int host, const Vec3& normal) const {
    const Vec3 m = weighted(surface_point(bodies_, contact), normals_).normalized();
    if (std::abs(normal.dot(m)) >= tells_side) return normal.dot(m);
    return (x - shape_pose(bodies_.rigid, as_index(host)).position).dot(m);
  }

  const Bodies& bodies_;
  double dt_;
  int guest_;
  double thickness_;
  bool is_sheet_;
  std::vector<Vec3>& normals_;
  std::vector<Pinch>* pinches_;
};

// Calls visit(contact, host) for the contacts of the pairs with static and kinematic hosts.
template <class Visit>
void for_each_fixed(const Bodies& bodies, std::span<const ContactPair> hosts,
                    std::vector<ContactPoint>& points, Visit&& visit) {
  for (const ContactPair& pair : hosts)
    if (!bodies.rigid.properties[as_index(pair.host)].is_dynamic())
      for (int i = pair.begin; i < pair.end; ++i) visit(points[as_index(i)], pair.host);
}

// Calls visit(particle, weight) for the particles of a contact's place on its guest.
template <class Visit>
void for_each_particle_of(const Bodies& bodies, const ContactPoint& contact, Visit&& visit) {
  const SurfacePoint& point = surface_point(bodies, contact);
  for (std::size_t k = 0; k < as_index(point.count); ++k) visit(as_index(point.particle[k]), point.weight[k]);
}

// Lets pinched faces and edges yield as wholes. `yields` (m) holds for each particle the largest yield of a
// place on its faces and edges. If the corners did not yield, which only one host touches, they would stay
// at their whole distance from that one, and the place between the hosts would turn the face about them.
void yield_as_whole(const Bodies& bodies, std::span<const ContactPair> hosts,
                    const std::vector<double>& yields, std::vector<ContactPoint>& points) {
  for_each_fixed(bodies, hosts, points, [&](ContactPoint& contact, int) {
    double yielded = 0;
    for_each_particle_of(bodies, contact,
                         [&](std::size_t p, double weight) { yielded += weight * yields[p]; });
    if (yielded <= contact.yielded) return;
    contact.gap += yielded - contact.yielded;
    contact.yielded = yielded;
    contact.is_pinched = true;
  });
}

}  // namespace

void yield_where_pinched(const Bodies& bodies, double dt, ContactSet& contacts, std::vector<Pinch>* pinches) {
  std::vector<ContactPair>& pairs = contacts.pairs;
  for (std::size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
    const int guest = pairs[begin].guest_deformable;
    while (end < pairs.size() && pairs[end].guest_deformable == guest) ++end;
    if (guest < 0 || end == begin + 1 || !(bodies.deformable[as_index(guest)].thickness > 0)) continue;
    const std::span<const ContactPair> hosts(pairs.data() + begin, end - begin);
    const auto is_fixed = [&](const ContactPair& pair) {
      return !bodies.rigid.properties[as_index(pair.host)].is_dynamic();
    };
    if (std::count_if(hosts.begin(), hosts.end(), is_fixed) < 2) continue;
    const Pincher pincher(bodies, dt, guest, contacts.sheet_normals, pinches);
    std::vector<double>& yields = contacts.sheet_yields;
    yields.resize(bodies.particles.size());
    for_each_particle(bodies.deformable[as_index(guest)], [&](std::size_t p) { yields[p] = 0; });
    for_each_fixed(bodies, hosts, contacts.points, [&](ContactPoint& contact, int host) {
      double yielded = 0, facing_yield = 0;
      for (const ContactPair& other : hosts) {
        if (other.host == host || !is_fixed(other)) continue;
        const Pincher::Yield yield = pincher.between(contact, other.host);
        yielded = std::max(yielded, yield.amount);
        if (yield.face_each_other) facing_yield = std::max(facing_yield, yield.amount);
      }
      contact.gap += yielded - contact.yielded;
      contact.yielded = yielded;
      contact.is_pinched = yielded > 0;
      for_each_particle_of(bodies, contact,
                           [&](std::size_t p, double) { yields[p] = std::max(yields[p], facing_yield); });
    });
    yield_as_whole(bodies, hosts, yields, contacts.points);
    // The particles of a pinched face hold it already; friction at the samples between them would repeat it.
    for_each_fixed(bodies, hosts, contacts.points, [&](ContactPoint& contact, int) {
      if (contact.is_pinched && surface_point(bodies, contact).count > 1) contact.friction = 0;
    });
  }
}

}  // namespace duet
