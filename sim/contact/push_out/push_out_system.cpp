#include "sim/contact/push_out/push_out_system.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include <Eigen/LU>

#include "sim/contact/push_out/push_out.h"

namespace duet {
namespace {

// Mass of an outer body that cannot move, over that of the central body: it approximates the limit of
// equation 1 for K_o -> 0. A larger value would lose digits in the sums of equation 2.
constexpr double held_weight = 1e8;
// Fraction of that mass along the surface. Between two walls that face each other a body slides out of both,
// while a body that a wedge would squeeze out by a large displacement moves by a fraction of it at a time.
constexpr double held_sliding = 0.01;

// Returns K_o^-1 of an outer body that cannot move, kg, for a central body of `central_mass` (kg).
Mat3 held_mass(double central_mass, const Vec3& normal) {
  const Mat3 along = normal * normal.transpose();
  return held_weight * central_mass * (along + held_sliding * (Mat3::Identity() - along));
}

}  // namespace

void PushOutSystem::begin(const Bodies& bodies, const std::vector<char>& held) {
  bodies_ = &bodies;
  held_ = held;
  slot_of_body_.assign(bodies.rigid.size(), -1);
  slot_of_particle_.resize(bodies.particles.size(), -1);
  for (const int p : particle_) slot_of_particle_[as_index(p)] = -1;
  body_.clear();
  particle_.clear();
  inertia_.clear();
  rows_.clear();
}

int PushOutSystem::body_slot(int body) {
  if (body < 0 || !bodies_->rigid.properties[as_index(body)].is_dynamic() || is_held(as_index(body)))
    return -1;
  int& slot = slot_of_body_[as_index(body)];
  if (slot >= 0) return slot;
  const Mat3 rotation = bodies_->rigid.state[as_index(body)].pose.orientation.toRotationMatrix();
  inertia_.emplace_back(rotation * bodies_->rigid.properties[as_index(body)].inertia.asDiagonal() *
                        rotation.transpose());
  body_.push_back(body);
  return slot = static_cast<int>(body_.size()) - 1;
}

int PushOutSystem::particle_slot(int particle) {
  int& slot = slot_of_particle_[as_index(particle)];
  if (slot >= 0) return slot;
  particle_.push_back(particle);
  return slot = static_cast<int>(particle_.size()) - 1;
}

Mat3 PushOutSystem::effective_mass(int slot, const Vec3& arm) const {
  const auto b = as_index(body_[as_index(slot)]);
  return impulse_factor(bodies_->rigid.state[b], bodies_->rigid.properties[b].inverse_mass, arm).inverse();
}

void PushOutSystem::add(const ContactPoint& contact, std::size_t guest, const Vec3& apart) {
  Row row;
  row.host = moves_host(*bodies_, contact) ? body_slot(contact.host) : -1;
  row.host_arm = contact.host_arm;
  row.guest_arm = contact.guest_arm;
  row.normal = contact.normal;
  row.apart = apart;
  double guest_inertia = 0;  // kg
  if (contact.is_rigid_pair()) {
    row.guest = body_slot(contact.guest_rigid);
    if (row.guest >= 0) {
      row.guest_mass = effective_mass(row.guest, row.guest_arm);
      guest_inertia = bodies_->rigid.properties[as_index(contact.guest_rigid)].mass;
    }
  } else if (const SurfacePoint& point = surface_point(*bodies_, contact);
             !is_held(guest) && point.inverse_mass > 0) {
    // Edge contacts and contacts in faces get a number of their own, because different hosts have different
    // points.
    row.point = contact.is_on_edge()
                    ? static_cast<int>(bodies_->points.size() + bodies_->edges.size() + rows_.size())
                    : contact.feature.index;
    row.inverse_mass = point.inverse_mass;
    guest_inertia = 1 / point.inverse_mass;
    row.guest_mass = guest_inertia * Mat3::Identity();
    for (std::size_t i = 0; i < as_index(point.count); ++i) {
      row.particle[i] = particle_slot(point.particle[i]);
      row.weight[i] = point.weight[i];
      row.per_impulse[i] = point.weight[i] * bodies_->particles.inverse_mass[as_index(point.particle[i])];
    }
  }
  if (row.host < 0 && guest_inertia == 0) return;  // neither side can move
  double host_inertia = 0;
  if (row.host >= 0) {
    row.host_mass = effective_mass(row.host, row.host_arm);
    host_inertia = bodies_->rigid.properties[as_index(contact.host)].mass;
  } else {
    row.host_mass = held_mass(guest_inertia, contact.normal);
  }
  if (guest_inertia == 0) row.guest_mass = held_mass(host_inertia, contact.normal);
  rows_.push_back(row);
}

// A point of a deformable body that overlaps one movable body alone is not central: that body opens the
// overlap.
void PushOutSystem::factor(const std::vector<int>& rank) {
  enum class Side { host, guest };
  outers_.clear();
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    const int index = static_cast<int>(r);
    const auto add_body = [&](int slot, Side side) {
      if (slot < 0) return;
      const int place = rank[as_index(body_[as_index(slot)])];
      if (place >= 0) outers_.push_back({1, place, index, side == Side::guest});
    };
    add_body(row.host, Side::host);
    add_body(row.guest, Side::guest);
    if (row.point >= 0) outers_.push_back({0, row.point, index, true});
  }
  std::sort(outers_.begin(), outers_.end(), [](const Outer& a, const Outer& b) {
    return std::tie(a.kind, a.rank, a.row) < std::tie(b.kind, b.rank, b.row);
  });
  blocks_.clear();
  missing_.resize(outers_.size());
  for (std::size_t begin = 0; begin < outers_.size();) {
    std::size_t end = begin + 1;
    while (end < outers_.size() && outers_[end].kind == outers_[begin].kind &&
           outers_[end].rank == outers_[begin].rank)
      ++end;
    const Row& first = rows_[as_index(outers_[begin].row)];
    if (outers_[begin].kind == 1 || end > begin + 1 || first.host < 0) {
      factor(blocks_.emplace_back(Block{static_cast<int>(begin), static_cast<int>(end), {}}));
    }
    begin = end;
  }
}

const Vec3& PushOutSystem::central_arm(const Outer& outer) const {
  const Row& row = rows_[as_index(outer.row)];
  return outer.reversed ? row.guest_arm : row.host_arm;
}

// Factors the matrix of equation 2. The arms of a central point are zero.
void PushOutSystem::factor(Block& block) const {
  Mat6 system = Mat6::Zero();
  const Outer& first = outers_[as_index(block.begin)];
  const Row& row = rows_[as_index(first.row)];
  if (first.kind == 0) {
    system.topLeftCorner<3, 3>() = row.guest_mass;
    system.bottomRightCorner<3, 3>().setIdentity();
  } else {
    const auto slot = as_index(first.reversed ? row.guest : row.host);
    system.topLeftCorner<3, 3>().diagonal().setConstant(
        bodies_->rigid.properties[as_index(body_[slot])].mass);
    system.bottomRightCorner<3, 3>() = inertia_[slot];
  }
  for (int i = block.begin; i < block.end; ++i) {
    const Outer& outer = outers_[as_index(i)];
    const Mat3& mass =
        outer.reversed ? rows_[as_index(outer.row)].host_mass : rows_[as_index(outer.row)].guest_mass;
    const Mat3 cross = skew(central_arm(outer));
    const Mat3 weighted_arm = cross * mass;
    system.topLeftCorner<3, 3>() += mass;
    system.bottomLeftCorner<3, 3>() += weighted_arm;
    system.topRightCorner<3, 3>() += weighted_arm.transpose();
    system.bottomRightCorner<3, 3>() += weighted_arm * cross.transpose();
  }
  block.system.compute(system);
}

// Returns the displacement of the guest relative to the host at a contact, m.
Vec3 PushOutSystem::displacement(const Row& row, const Vector& u) const {
  const std::size_t bodies_begin = particle_.size();
  const auto of_body = [&](int slot, const Vec3& arm) {
    const std::size_t at = bodies_begin + 2 * as_index(slot);
    return Vec3(u[at] + u[at + 1].cross(arm));
  };
  Vec3 sum = Vec3::Zero();
  if (row.guest >= 0) sum = of_body(row.guest, row.guest_arm);
  if (row.point >= 0)
    for (std::size_t i = 0; i < 4; ++i)
      if (row.weight[i] != 0) sum += row.weight[i] * u[as_index(row.particle[i])];
  if (row.host >= 0) sum -= of_body(row.host, row.host_arm);
  return sum;
}

void PushOutSystem::move_body(int slot, const Vec3& arm, const Vec3& impulse, Vector& u) const {
  const auto b = as_index(body_[as_index(slot)]);
  const std::size_t at = particle_.size() + 2 * as_index(slot);
  u[at] += bodies_->rigid.properties[b].inverse_mass * impulse;
  u[at + 1] += bodies_->rigid.state[b].inverse_inertia * arm.cross(impulse);
}

void PushOutSystem::move_point(const Row& row, const Vec3& impulse, Vector& u) const {
  for (std::size_t i = 0; i < 4; ++i)
    if (row.weight[i] != 0) u[as_index(row.particle[i])] += row.per_impulse[i] * impulse;
}

// Solves equation 2 for the displacement (v, w) of the central body, then equation 1 for that of each outer
// body.
void PushOutSystem::project(const Block& block, double share, Vector& u) {
  Vec6 right = Vec6::Zero();
  for (int i = block.begin; i < block.end; ++i) {
    const Outer& outer = outers_[as_index(i)];
    const Row& row = rows_[as_index(outer.row)];
    const Vec3 missing = (outer.reversed ? -1 : 1) * (share * row.apart - displacement(row, u));
    const Vec3 impulse = -((outer.reversed ? row.host_mass : row.guest_mass) * missing);
    right.head<3>() += impulse;
    right.tail<3>() += central_arm(outer).cross(impulse);
    missing_[as_index(i)] = missing;
  }
  const Vec6 twist = block.system.solve(right);
  const Vec3 v = twist.head<3>(), w = twist.tail<3>();
  for (int i = block.begin; i < block.end; ++i) {
    const Outer& outer = outers_[as_index(i)];
    const Row& row = rows_[as_index(outer.row)];
    const Vec3 change = v + w.cross(central_arm(outer)) + missing_[as_index(i)];
    const Vec3 impulse = (outer.reversed ? row.host_mass : row.guest_mass) * change;
    if (outer.reversed && row.host >= 0) move_body(row.host, row.host_arm, impulse, u);
    if (!outer.reversed && row.guest >= 0) move_body(row.guest, row.guest_arm, impulse, u);
    if (!outer.reversed && row.point >= 0) move_point(row, impulse, u);
  }
  const Outer& first = outers_[as_index(block.begin)];
  const Row& row = rows_[as_index(first.row)];
  if (first.kind == 0) {
    move_point(row, v / row.inverse_mass, u);
    return;
  }
  const std::size_t at = particle_.size() + 2 * as_index(first.reversed ? row.guest : row.host);
  u[at] += v;
  u[at + 1] += w;
}

void PushOutSystem::sweep_forth(double share, Vector& u) {
  for (const Block& block : blocks_) project(block, share, u);
}

void PushOutSystem::sweep_back(double share, Vector& u) {
  for (std::size_t i = blocks_.size(); i-- > 0;) project(blocks_[i], share, u);
}

double PushOutSystem::inner(const Vector& a, const Vector& b) const {
  double sum = 0;
  for (std::size_t i = 0; i < particle_.size(); ++i)
    sum += bodies_->particles.mass[as_index(particle_[i])] * a[i].dot(b[i]);
  for (std::size_t i = 0; i < body_.size(); ++i) {
    const std::size_t at = particle_.size() + 2 * i;
    sum += bodies_->rigid.properties[as_index(body_[i])].mass * a[at].dot(b[at]) +
           a[at + 1].dot(inertia_[i] * b[at + 1]);
  }
  return sum;
}

double PushOutSystem::max_error(const Vector& u) const {
  double largest = 0;
  for (const Row& row : rows_)
    largest = std::max(largest, std::abs((row.apart - displacement(row, u)).dot(row.normal)));
  return largest;
}

// A sweep to and fro is S u = Q u + b, and its fixed point solves (1 - Q) u = b, which conjugate gradients
// find. A first sweep forth alone is enough if its error is small.
int PushOutSystem::solve(double tolerance, int sweeps) {
  const std::size_t size = particle_.size() + 2 * body_.size();
  u_.assign(size, Vec3::Zero());
  sweep_forth(1, u_);
  int done = 1;
  if (max_error(u_) <= tolerance || done >= sweeps) return done;
  sweep_back(1, u_);
  ++done;
  residual_ = u_;
  direction_ = u_;
  u_.assign(size, Vec3::Zero());
  double rho = inner(residual_, residual_);
  while (rho > 0) {
    image_ = direction_;
    sweep_forth(0, image_);
    sweep_back(0, image_);
    done += 2;
    for (std::size_t i = 0; i < size; ++i) image_[i] = direction_[i] - image_[i];
    const double curvature = inner(direction_, image_);
    if (!(curvature > 0)) break;  // only rounding is left
    const double alpha = rho / curvature;
    for (std::size_t i = 0; i < size; ++i) {
      u_[i] += alpha * direction_[i];
      residual_[i] -= alpha * image_[i];
    }
    const double next = inner(residual_, residual_);
    if (done + 2 > sweeps || max_error(u_) <= tolerance) break;
    for (std::size_t i = 0; i < size; ++i) direction_[i] = residual_[i] + next / rho * direction_[i];
    rho = next;
  }
  return done;
}

void PushOutSystem::apply(Bodies& bodies, std::vector<char>& moved) const {
  for (std::size_t i = 0; i < particle_.size(); ++i) bodies.particles.x[as_index(particle_[i])] += u_[i];
  for (std::size_t i = 0; i < body_.size(); ++i) {
    const auto b = as_index(body_[i]);
    const std::size_t at = particle_.size() + 2 * i;
    displace(bodies.rigid.state[b], bodies.rigid.properties[b], u_[at], u_[at + 1]);
    moved[b] = 1;
  }
}

}  // namespace duet
