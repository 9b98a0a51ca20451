#include "sim/contact/response/contact_projection.h"

#include <algorithm>

#include "sim/base/dense_solvers.h"
#include "sim/contact/response/row_velocity.h"

namespace duet {

namespace {

// Returns the index of the deformable body that a particle belongs to.
std::size_t body_of(const Bodies& bodies, int particle) {
  const auto after =
      std::upper_bound(bodies.deformable.begin(), bodies.deformable.end(), particle,
                       [](int p, const DeformableBody& body) { return p < body.first_particle; });
  return static_cast<std::size_t>(after - bodies.deformable.begin()) - 1;
}

}  // namespace

void ContactProjection::begin(const Bodies& bodies, int sweeps, const ArticulatedResponse* linked) {
  bodies_ = &bodies;
  linked_ = linked;
  inverse_mass_ = nullptr;
  repulsions_ = nullptr;
  joints_ = nullptr;
  islands_ = nullptr;
  sweeps_ = sweeps;
  used_ = bodies.rigid.size();
  block_rows_ = 0;
  held_ = false;
  rows_.clear();
  blocks_.resize(std::max(blocks_.size(), used_));
  for (Block& block : blocks_) block.rows.clear();
}

namespace {

// Returns whether the friction impulse (N s) of a contact uses less than `share` of its cone.
bool sticks(const ContactPoint& contact, const Vec3& friction, double share) {
  const double most = contact.friction * contact.impulse.dot(contact.normal);
  return friction.norm() < share * most;
}

// Returns the velocity along its normal that a row is projected to, m/s.
template <class Row>
double target_of(const Row& row, ProjectTo goal) {
  return goal == ProjectTo::targets ? row.target : 0;
}

}  // namespace

void ContactProjection::add(const ContactPoint& contact, StickingRows rows, double cone_share) {
  Row row;
  row.host = contact.host;
  row.guest_rigid = contact.guest_rigid;
  row.normal = contact.normal;
  row.host_arm = contact.host_arm;
  row.guest_arm = contact.guest_arm;
  row.friction = contact.impulse - contact.impulse.dot(contact.normal) * contact.normal;
  if (!contact.is_rigid_pair()) row.point = surface_point(*bodies_, contact);
  held_ = held_ || !bodies_->rigid.properties[as_index(contact.host)].is_dynamic() ||
          (contact.is_rigid_pair() && !bodies_->rigid.properties[as_index(contact.guest_rigid)].is_dynamic());
  const bool is_held = !contact.is_rigid_pair() && row.point.inverse_mass == 0;
  held_ = held_ || is_held;
  add_row(row, contact, is_held);
  if (rows == StickingRows::normal || !sticks(contact, row.friction, cone_share)) return;
  row.friction.setZero();
  row.normal = contact.normal.unitOrthogonal();
  add_row(row, contact, is_held);
  row.normal = contact.normal.cross(row.normal);
  add_row(row, contact, is_held);
}

void ContactProjection::add_row(Row& row, const ContactPoint& contact, bool is_held) {
  // A block treats its guests as independent of each other, which is right for particles, but not for face
  // samples that share particles. Held particles cannot be in a block, because they have no mass to divide
  // by.
  if (!contact.is_rigid_pair() && row.point.count == 1 && !is_held) {
    row.mass = 1 / row.point.inverse_mass;
    Block& block = blocks_[as_index(contact.host)];
    block.host = contact.host;
    block.rows.push_back(row);
    ++block_rows_;
  } else {
    const bool is_normal = row.normal == contact.normal;
    row.mass = is_normal ? contact.response.normal_mass : 1 / row.normal.dot(contact.response.K * row.normal);
    if (!contact.is_rigid_pair()) row.of_host = std::max(1 / row.mass - row.point.inverse_mass, 0.0);
    rows_.push_back(row);
  }
}

void ContactProjection::factor_blocks() {
  for (std::size_t b = 0; b < used_; ++b)
    if (!blocks_[b].rows.empty()) factor(blocks_[b]);
}

void ContactProjection::build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph,
                              int sweeps, SelfRepulsion* repulsions, const ArticulatedResponse* linked,
                              const StickingBodies& sticking) {
  begin(bodies, sweeps, linked);
  repulsions_ = repulsions;
  for (int p : graph.schedule.order()) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const bool rests = sticking.rests && !sticking.rests->empty() && pair.guest_deformable >= 0 &&
                       (*sticking.rests)[as_index(pair.guest_deformable)];
    const StickingRows rows = rests ? StickingRows::normal_and_tangents : StickingRows::normal;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (!contact.impulse.isZero(0)) add(contact, rows, sticking.cone_share);
    }
  }
  factor_blocks();
}

void ContactProjection::build(const Bodies& bodies, const ContactCache& cache, double duration, int sweeps,
                              const ArticulatedResponse* linked, const std::vector<char>& left_out,
                              const StickingBodies& sticking) {
  begin(bodies, sweeps, linked);
  ContactPoint contact;
  for (const CachedContact& remembered : cache) {
    contact.host = remembered.host;
    contact.guest_rigid = remembered.guest_rigid;
    contact.feature = remembered.feature;
    contact.edge = remembered.edge;
    if (contact.is_on_edge() && !contact.is_rigid_pair()) put_on_surface(bodies, contact);
    const auto is_marked = [&](const std::vector<char>& deformable) {
      return !deformable.empty() && !contact.is_rigid_pair() &&
             deformable[body_of(bodies, surface_point(bodies, contact).particle[0])];
    };
    if (is_marked(left_out)) continue;
    update_geometry(bodies, contact);
    if (linked && linked->takes_part(contact)) contact.response = linked->response(contact, bodies);
    contact.impulse = duration / remembered.duration * remembered.impulse;
    contact.friction = bodies.rigid.properties[as_index(contact.host)].friction;
    const bool rests = sticking.rests && is_marked(*sticking.rests);
    add(contact, rests ? StickingRows::normal_and_tangents : StickingRows::normal, sticking.cone_share);
  }
  factor_blocks();
}

void ContactProjection::build(const Bodies& bodies) { begin(bodies, 1, nullptr); }

void ContactProjection::add_repulsions(SelfRepulsion& repulsions, const std::vector<char>& left_out) {
  repulsions_ = &repulsions;
  if (left_out.empty()) return;
  const auto is_left_out = [&](int particle) { return left_out[body_of(*bodies_, particle)] != 0; };
  repulsions.choose_rows_among([&](const RepulsionPair& pair) {
    return !is_left_out(pair.particle.front()) && !is_left_out(pair.particle.back());
  });
}

void ContactProjection::factor(Block& block) const {
  const RigidProperties& properties = bodies_->rigid.properties[as_index(block.host)];
  if (!properties.is_dynamic()) return;
  block.weight.setZero();
  for (const Row& row : block.rows) {
    if (!row.active) continue;
    const Vec6 wrench = wrench_of(row.host_arm, row.normal);
    block.weight += row.mass * wrench * wrench.transpose();
  }
  if (const ArticulatedResponse* links = links_of(block.host)) {
    // (1 + R W)^-1 R with the response R and the weight W: unlike (R^-1 + W)^-1 it exists if joints hold the
    // host.
    const Mat6 response = links->response_of(block.host, block.host);
    block.inverse = solve_general<6>(Mat6::Identity() + response * block.weight, response);
    return;
  }
  const Mat3 rotation = bodies_->rigid.state[as_index(block.host)].pose.orientation.toRotationMatrix();
  Mat6 system = block.weight;
  system.topLeftCorner<3, 3>().diagonal().array() += properties.mass;
  system.bottomRightCorner<3, 3>() += rotation * properties.inertia.asDiagonal() * rotation.transpose();
  block.inverse = SymmetricFactor<6>(system).inverse();
}

double ContactProjection::inverse_mass_of_guest(const Row& row) const {
  if (!inverse_mass_) return row.point.inverse_mass;
  double sum = 0;
  for (std::size_t i = 0; i < as_index(row.point.count); ++i) {
    const SymmetricBlock& inverse = (*inverse_mass_)[as_index(row.point.particle[i])];
    sum += row.point.weight[i] * row.point.weight[i] * row.normal.dot(inverse * row.normal);
  }
  return sum;
}

void ContactProjection::use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass) {
  inverse_mass_ = inverse_mass;
  const auto update_mass = [&](Row& row) {
    if (row.guest_rigid < 0 && (!inverse_mass || takes(row)))
      row.mass = 1 / (row.of_host + inverse_mass_of_guest(row));
  };
  for (std::size_t b = 0; b < used_; ++b)
    for (Row& row : blocks_[b].rows) update_mass(row);
  for (Row& row : rows_) update_mass(row);
  factor_blocks();
  if (repulsions_) repulsions_->use_inverse_masses(inverse_mass);
}

void ContactProjection::join(Islands& islands) const {
  const auto join = [&](const Row& row) {
    if (row.guest_rigid >= 0)
      islands.join_rigid(row.host, row.guest_rigid);
    else
      islands.join_particle(row.host, row.point.particle[0]);
  };
  for (std::size_t b = 0; b < used_; ++b)
    for (const Row& row : blocks_[b].rows) join(row);
  for (const Row& row : rows_) join(row);
  if (!repulsions_) return;
  for (const RepulsionPair& pair : repulsions_->pairs())
    if (pair.active) islands.join_particles(pair.particle.front(), pair.particle.back());
}

void ContactProjection::limit_to(const Islands* islands) {
  islands_ = islands;
  if (repulsions_) repulsions_->limit_to(islands ? &islands->mask() : nullptr);
  if (!islands) return;
  const auto find = [&](Row& row) {
    row.island = row.guest_rigid < 0 ? islands->of_particle(row.point.particle[0])
                                     : islands->of_rigid(static_cast<std::size_t>(row.guest_rigid));
    if (row.island < 0) row.island = islands->of_rigid(as_index(row.host));
  };
  for (std::size_t b = 0; b < used_; ++b)
    for (Row& row : blocks_[b].rows) find(row);
  for (Row& row : rows_) find(row);
}

double ContactProjection::normal_velocity(const Row& row, const GeneralizedVelocity& v) const {
  return row_velocity(row, v).dot(row.normal);
}

void ContactProjection::push(const Row& row, const Vec3& j, GeneralizedVelocity& v) const {
  if (row.guest_rigid < 0) {
    for (std::size_t i = 0; i < as_index(row.point.count); ++i) {
      const auto p = as_index(row.point.particle[i]);
      if (inverse_mass_)
        v.particle[p] += row.point.weight[i] * ((*inverse_mass_)[p] * j);
      else
        v.particle[p] += row.point.weight[i] * bodies_->particles.inverse_mass[p] * j;
    }
    return;
  }
  push_rigid(row.guest_rigid, row.guest_arm, j, v);
}

void ContactProjection::push_rigid(int body, const Vec3& arm, const Vec3& impulse,
                                   GeneralizedVelocity& v) const {
  const auto b = as_index(body);
  if (const ArticulatedResponse* links = links_of(body)) {
    links->push(body, wrench_of(arm, impulse), v.linear, v.angular);
    return;
  }
  v.linear[b] += bodies_->rigid.properties[b].inverse_mass * impulse;
  v.angular[b] += bodies_->rigid.state[b].inverse_inertia * arm.cross(impulse);
}

void ContactProjection::push_host(const Row& row, const Vec3& j, GeneralizedVelocity& v) const {
  if (row.guest_rigid < 0 && !bodies_->push_back) return;
  push_rigid(row.host, row.host_arm, -j, v);
}

// Solves equation 4 for the change of velocity (dv, dw) of the host by the normal velocities that it has to
// take up, then equation 3 for the impulse on every particle. What it calls becomes part of it, as in
// project_row(), because conjugate gradients spend much of their time here.
[[gnu::flatten]] void ContactProjection::project_block(const Block& block, ProjectTo goal,
                                                       GeneralizedVelocity& v) const {
  Vec6 right = Vec6::Zero();
  const auto host = as_index(block.host);
  const bool moves = bodies_->rigid.properties[host].is_dynamic() && bodies_->push_back;
  Vec6 change = Vec6::Zero();
  if (moves) {
    for (const Row& row : block.rows) {
      if (!takes(row)) continue;
      const double excess = row.mass * (normal_velocity(row, v) - target_of(row, goal));
      right.head<3>() += excess * row.normal;
      right.tail<3>() += excess * row.host_arm.cross(row.normal);
    }
    change = block.inverse * right;
    if (const ArticulatedResponse* links = links_of(block.host)) {
      links->push(block.host, right - block.weight * change, v.linear, v.angular);
    } else {
      v.linear[host] += change.head<3>();
      v.angular[host] += change.tail<3>();
    }
  }
  for (const Row& row : block.rows) {
    if (!takes(row)) continue;
    push(row, -row.mass * (normal_velocity(row, v) - target_of(row, goal)) * row.normal, v);
  }
}

[[gnu::flatten]] void ContactProjection::project_row(const Row& row, ProjectTo goal,
                                                     GeneralizedVelocity& v) const {
  const Vec3 impulse = -row.mass * (normal_velocity(row, v) - target_of(row, goal)) * row.normal;
  push(row, impulse, v);
  push_host(row, impulse, v);
}

// If articulated response contains all jointed bodies, contact impulses keep the joints, which are then
// projected once before the sweeps instead of within each sweep.
void ContactProjection::sweep_all(ProjectTo goal, GeneralizedVelocity& v) const {
  const bool keeps_joints = linked_ && linked_->is_complete();
  if (joints_ && keeps_joints) joints_->project(bodies_->rigid, v.linear, v.angular);
  for (int i = 0; i < sweeps_; ++i) sweep(goal, keeps_joints ? nullptr : joints_, v);
}

void ContactProjection::sweep(ProjectTo goal, const JointSolver* joints, GeneralizedVelocity& v) const {
  if (joints) joints->project(bodies_->rigid, v.linear, v.angular);
  for (std::size_t b = 0; b < used_; ++b)
    if (!blocks_[b].rows.empty()) project_block(blocks_[b], goal, v);
  for (const Row& row : rows_)
    if (takes(row)) project_row(row, goal, v);
  if (repulsions_) repulsions_->sweep(goal, bodies_->particles.inverse_mass, v.particle);
  for (std::size_t i = rows_.size(); i-- > 0;)
    if (takes(rows_[i])) project_row(rows_[i], goal, v);
  for (std::size_t b = used_; b-- > 0;)
    if (!blocks_[b].rows.empty()) project_block(blocks_[b], goal, v);
  if (joints) joints->project(bodies_->rigid, v.linear, v.angular);
}

namespace {

// Calls change(row) for the rows of the first `used` blocks and for `rows`. Calls factor(block) for the
// blocks of which it has changed a row, and returns whether it has changed any row.
template <class Blocks, class Rows, class Change, class Factor>
bool change_rows(Blocks& blocks, std::size_t used, Rows& rows, Change&& change, Factor&& factor) {
  bool any = false;
  for (std::size_t b = 0; b < used; ++b) {
    bool changed = false;
    for (auto& row : blocks[b].rows) changed = change(row) || changed;
    if (changed) factor(blocks[b]);
    any = any || changed;
  }
  for (auto& row : rows) any = change(row) || any;
  return any;
}

}  // namespace

bool ContactProjection::choose(double dt, double at, const GeneralizedVelocity& start,
                               const GeneralizedVelocity& velocity) {
  bool all = true;
  const auto decide = [&](Row& row) {
    row.target = (1 - at) * normal_velocity(row, start);
    row.active = normal_velocity(row, velocity) <= row.target;
    all = all && row.active;
    return true;
  };
  change_rows(blocks_, used_, rows_, decide, [&](Block& block) { factor(block); });
  if (repulsions_) all = repulsions_->activate_rows(dt, at, start.particle, velocity.particle) && all;
  return all;
}

bool ContactProjection::activate_violated(double dt, double at, const GeneralizedVelocity& start,
                                          const GeneralizedVelocity& velocity) {
  const auto decide = [&](Row& row) {
    const bool is_violated = !row.active && normal_velocity(row, velocity) < row.target;
    if (is_violated) row.active = true;
    return is_violated;
  };
  bool any = change_rows(blocks_, used_, rows_, decide, [&](Block& block) { factor(block); });
  if (repulsions_) any = repulsions_->activate_more_rows(dt, at, start.particle, velocity.particle) || any;
  return any;
}

void ContactProjection::satisfy(GeneralizedVelocity& velocity) const {
  sweep_all(ProjectTo::targets, velocity);
}

void ContactProjection::add_friction(double share, GeneralizedVelocity& velocity) const {
  const auto add = [&](const Row& row) {
    if (!row.active) return;
    push(row, share * row.friction, velocity);
    push_host(row, share * row.friction, velocity);
  };
  for (std::size_t b = 0; b < used_; ++b)
    for (const Row& row : blocks_[b].rows) add(row);
  for (const Row& row : rows_) add(row);
}

bool ContactProjection::release(const GeneralizedVelocity& change, double tolerance) {
  const auto decide = [&](Row& row) {
    const bool pulls = row.active && normal_velocity(row, change) > tolerance;
    if (pulls) row.active = false;
    return pulls;
  };
  bool any = change_rows(blocks_, used_, rows_, decide, [&](Block& block) { factor(block); });
  if (repulsions_) any = repulsions_->deactivate_rows(change.particle, tolerance) || any;
  return any;
}

void ContactProjection::project(GeneralizedVelocity& velocity) const { sweep_all(ProjectTo::zero, velocity); }

}  // namespace duet
