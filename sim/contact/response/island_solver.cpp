#include "sim/contact/response/island_solver.h"

#include <algorithm>
#include <cmath>

#include "sim/base/stop.h"
#include "sim/contact/detection/ring_contacts.h"
#include "sim/contact/response/contact_update.h"

namespace duet {
namespace {

// How one attempt on an island is made.
struct Attempt {
  // rho in units of the effective mass of a contact. A larger value leaves a smaller error, until rounding
  // bounds it.
  double rho = 0;
  int max_in_all = 0;  // Newton steps of all rounds of this attempt and those before it, at most
};
// A second attempt is made if the first ends in a cycle of contacts that stick and slip in turn.
constexpr std::array<Attempt, 2> attempts{{{1e6, 100}, {1e3, 100}}};
constexpr int patience = 7;  // rounds without improvement that end an attempt
// Attempts on islands with ring contacts. Rings that cross at a small angle have many contacts that hardly
// differ in height. With the rho of other islands nine of ten attempts fail in stacks of four or eight rings,
// because the steps end before it is found which of these contacts carry load.
constexpr std::array<Attempt, 2> ring_attempts{{{1e4, 400}, {1e2, 400}}};
constexpr int ring_patience = 15;  // the same for them
// Newton steps of a round, and halvings of a step, at most.
constexpr int max_steps = 20, max_halvings = 12;
// Fraction of the friction cone beyond which a contact slides: on the cone but for rounding.
constexpr double on_cone = 1 - 1e-9;
// Least fall of the value, over that of its slope: the usual constant of Armijo's rule. The full step of a
// quadratic piece falls by half of it, so that only steps across many pieces are halved.
constexpr double enough_fall = 1e-4;
// Slope and fall that count as rounding, over the value: a few and some tens of units in its last place.
constexpr double no_slope = 1e-15, no_fall = 1e-14;

}  // namespace

double IslandSolver::solve(Bodies& bodies, std::span<const int> pairs, double tolerance,
                           ContactSet& contacts) {
  gather(bodies, pairs, contacts);
  double best = error(bodies, contacts), now = best;
  keep(bodies, contacts);
  int steps = 0;
  const int most_in_vain = has_rings_ ? ring_patience : patience;
  for (const auto& [scale, max_in_all] : has_rings_ ? ring_attempts : attempts) {
    for (int round = 0, last = 0; steps < max_in_all && round - last < most_in_vain && !(now < tolerance);
         ++round) {
      stop_if_asked();
      begin_round(bodies, contacts, scale, now <= best ? SlidingFriction::updated : SlidingFriction::kept);
      steps += minimize();
      end_round(bodies, contacts);
      now = error(bodies, contacts);
      if (!std::isfinite(now)) break;
      if (now >= best) continue;
      best = now;
      last = round + 1;
      keep(bodies, contacts);
    }
    if (now < tolerance) break;
    restore(bodies, contacts);
    now = best;
  }
  return best;
}

void IslandSolver::gather(const Bodies& bodies, std::span<const int> pairs, const ContactSet& contacts) {
  for (const Body& body : bodies_) place_[body.number] = -1;
  place_.resize(bodies.rigid.size(), -1);
  bodies_.clear();
  rows_.clear();
  has_rings_ = false;
  const auto add_body = [&](int number) {
    const auto b = as_index(number);
    if (!bodies.rigid.properties[b].is_dynamic() || place_[b] >= 0) return;
    place_[b] = static_cast<int>(bodies_.size());
    bodies_.push_back({b, 1 / bodies.rigid.properties[b].inverse_mass,
                       bodies.rigid.state[b].inverse_inertia.inverse(), bodies.rigid.state[b]});
  };
  for (const int p : pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    if (!pair.active) continue;
    add_body(pair.host);
    add_body(pair.guest_rigid);
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (!std::isfinite(contact.target) && contact.impulse.isZero(0)) continue;
      has_rings_ |= is_ring_contact(contact);
      rows_.push_back(row_of(contact));
      rows_.back().point = as_index(i);
    }
  }
  const std::size_t size = 6 * bodies_.size();
  for (Twists* twists : {&twists_, &trial_, &gradient_, &step_}) twists->resize(size);
  matrix_.resize(size * size);
}

IslandSolver::Row IslandSolver::row_of(const ContactPoint& contact) const {
  Row row;
  row.place = {place_[as_index(contact.guest_rigid)], place_[as_index(contact.host)]};
  row.arm = {contact.guest_arm, contact.host_arm};
  row.normal = contact.normal;
  row.target = contact.target;
  row.friction = contact.friction;
  row.normal_mass = contact.response.normal_mass;
  row.tangent_mass = 2 / (contact.response.K.trace() - 1 / contact.response.normal_mass);
  return row;
}

// Decides for each contact whether it sticks, from a Gauss-Seidel update of it alone. A contact that slides
// gets the friction of that update; after a round that increased the error it keeps its friction, because the
// velocities of such a round say little.
void IslandSolver::begin_round(const Bodies& bodies, const ContactSet& contacts, double scale,
                               SlidingFriction sliding) {
  for (Row& row : rows_) {
    const ContactPoint& contact = contacts.points[row.point];
    row.normal_rho = scale * row.normal_mass;
    row.tangent_rho = scale * row.tangent_mass;
    row.velocity = relative_velocity(bodies, contact);
    row.pressure = contact.impulse.dot(row.normal);
    row.tangent = contact.impulse - row.pressure * row.normal;
    const Vec3 next = updated_impulse(contact, contact.response, row.velocity);
    const double pressure = next.dot(row.normal), most = on_cone * row.friction * pressure;
    const Vec3 beside = next - pressure * row.normal;
    row.sticks = row.pressure > 0 && most > 0 && beside.norm() < most;
    row.sliding = sliding == SlidingFriction::updated ? beside : row.tangent;
  }
}

// Applies the impulses of the round, cut to their cones, to the bodies.
void IslandSolver::end_round(Bodies& bodies, ContactSet& contacts) const {
  for (const Row& row : rows_) {
    ContactPoint& contact = contacts.points[row.point];
    const Vec3 velocity = row.velocity + change(row, twists_);
    const double pressed = pressure(row, velocity), most = row.friction * pressed;
    Vec3 beside = tangent(row, velocity);
    if (const double length = beside.norm(); length > most) beside *= most / length;
    const Vec3 impulse = pressed * row.normal + beside;
    apply_impulse(bodies, contact, impulse - contact.impulse);
    contact.impulse = impulse;
  }
}

double IslandSolver::error(const Bodies& bodies, const ContactSet& contacts) const {
  double largest = 0;
  for (const Row& row : rows_) {
    const ContactPoint& contact = contacts.points[row.point];
    const Vec3 velocity = relative_velocity(bodies, contact);
    if (contact.impulse.isZero(0) && velocity.dot(contact.normal) >= contact.target) continue;
    const Vec3 push = updated_impulse(contact, contact.response, velocity) - contact.impulse;
    const double off = (contact.response.K * push).norm() / contact.precision;
    if (!(off <= largest)) largest = off;  // also takes a NaN
  }
  return largest;
}

void IslandSolver::keep(const Bodies& bodies, const ContactSet& contacts) {
  for (Row& row : rows_) row.best = contacts.points[row.point].impulse;
  for (Body& body : bodies_) body.best = bodies.rigid.state[body.number];
}

void IslandSolver::restore(Bodies& bodies, ContactSet& contacts) const {
  for (const Row& row : rows_) contacts.points[row.point].impulse = row.best;
  for (const Body& body : bodies_) bodies.rigid.state[body.number] = body.best;
}

// Returns the change of the relative velocity at a contact, m/s: J times the twists.
Vec3 IslandSolver::change(const Row& row, const Twists& twists) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = 0; k < 2; ++k) {
    if (row.place[k] < 0) continue;
    const double* t = twists.data() + 6 * row.place[k];
    const Vec3 velocity = Vec3(t[0], t[1], t[2]) + Vec3(t[3], t[4], t[5]).cross(row.arm[k]);
    sum += k == 0 ? velocity : Vec3(-velocity);
  }
  return sum;
}

double IslandSolver::pressure(const Row& row, const Vec3& velocity) {
  return std::max(0.0, row.pressure + row.normal_rho * (row.target - velocity.dot(row.normal)));
}

Vec3 IslandSolver::tangent(const Row& row, const Vec3& velocity) {
  if (!row.sticks) return row.sliding;
  return row.tangent - row.tangent_rho * (velocity - velocity.dot(row.normal) * row.normal);
}

// Returns the function of dv that a round minimizes, J:
//   dv.M dv / 2 + sum p_n^2 / (2 rho_n) + sum over sticking contacts p_t^2 / (2 rho_t) + p0.J dv - sliding
//   friction . J dv,
// with the impulses p0 that act already. Its gradient is M dv - J^T dp.
double IslandSolver::value(const Twists& twists) const {
  double sum = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const double* t = twists.data() + 6 * b;
    const Vec3 v(t[0], t[1], t[2]), w(t[3], t[4], t[5]);
    sum += (bodies_[b].mass * v.squaredNorm() + w.dot(bodies_[b].inertia * w)) / 2;
  }
  for (const Row& row : rows_) {
    const Vec3 more = change(row, twists), velocity = row.velocity + more;
    const double pressed = pressure(row, velocity);
    sum += pressed * pressed / (2 * row.normal_rho) + row.pressure * row.normal.dot(more);
    if (row.sticks)
      sum += tangent(row, velocity).squaredNorm() / (2 * row.tangent_rho) + row.tangent.dot(more);
    else
      sum -= (row.sliding - row.tangent).dot(more);
  }
  return sum;
}

void IslandSolver::find_gradient() {
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const double* t = twists_.data() + 6 * b;
    double* g = gradient_.data() + 6 * b;
    const Vec3 turn = bodies_[b].inertia * Vec3(t[3], t[4], t[5]);
    for (int i = 0; i < 3; ++i) {
      g[i] = bodies_[b].mass * t[i];
      g[3 + i] = turn[i];
    }
  }
  for (const Row& row : rows_) {
    const Vec3 velocity = row.velocity + change(row, twists_);
    const Vec3 push =
        (pressure(row, velocity) - row.pressure) * row.normal + tangent(row, velocity) - row.tangent;
    for (std::size_t k = 0; k < 2; ++k) {
      if (row.place[k] < 0) continue;
      double* g = gradient_.data() + 6 * row.place[k];
      const Vec3 on_body = k == 0 ? push : Vec3(-push), turn = row.arm[k].cross(on_body);
      for (int i = 0; i < 3; ++i) {
        g[i] -= on_body[i];
        g[3 + i] -= turn[i];
      }
    }
  }
}

// Sets the matrix to M + J^T D J, the derivative of the gradient. D is rho_n of contacts that push and rho_t
// of contacts that stick.
void IslandSolver::find_matrix() {
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    add_block(6 * b, 6 * b, bodies_[b].mass * Mat3::Identity());
    add_block(6 * b + 3, 6 * b + 3, bodies_[b].inertia);
  }
  for (const Row& row : rows_) {
    const Mat3 along = row.normal * row.normal.transpose();
    Mat3 D = Mat3::Zero();
    if (pressure(row, row.velocity + change(row, twists_)) > 0) D += row.normal_rho * along;
    if (row.sticks) D += row.tangent_rho * (Mat3::Identity() - along);
    if (!D.isZero(0)) add_to_matrix(row, D);
  }
}

// The block of J for body k of a contact is +-(1, -[arm]x), with the plus sign for the guest.
void IslandSolver::add_to_matrix(const Row& row, const Mat3& stiffness) {
  const std::array<Mat3, 2> arm{skew(row.arm[0]), skew(row.arm[1])};
  for (std::size_t a = 0; a < 2; ++a)
    for (std::size_t b = 0; b < 2; ++b) {
      if (row.place[a] < 0 || row.place[b] < 0) continue;
      const Mat3 D = a == b ? stiffness : Mat3(-stiffness);
      const Mat3 to_turn = -D * arm[b], turn_to = arm[a] * D, turn_to_turn = arm[a] * to_turn;
      const std::size_t r = 6 * as_index(row.place[a]), c = 6 * as_index(row.place[b]);
      if (r < c) continue;  // only the lower triangle is used
      add_block(r, c, D);
      add_block(r, c + 3, to_turn);
      add_block(r + 3, c, turn_to);
      add_block(r + 3, c + 3, turn_to_turn);
    }
}

void IslandSolver::add_block(std::size_t row, std::size_t column, const Mat3& block) {
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i)
      matrix_[(column + as_index(j)) * twists_.size() + row + as_index(i)] += block(i, j);
}

// Solves matrix step = -gradient by a dense L D L^T factorization in place. Returns false if rounding leaves
// no positive pivot. The sparse factorization of the joint solver is not used, because it would order the
// bodies again in every step, and drops pivots as small as some are here.
bool IslandSolver::solve_for_step() {
  const std::size_t size = twists_.size();
  for (std::size_t j = 0; j < size; ++j) {
    double* column = &matrix_[j * size];
    if (!(column[j] > 0)) return false;
    const double inverse = 1 / column[j];
    for (std::size_t k = j + 1; k < size; ++k) {
      if (column[k] == 0) continue;  // bodies that do not touch
      const double factor = column[k] * inverse;
      double* target = &matrix_[k * size];
      for (std::size_t i = k; i < size; ++i) target[i] -= factor * column[i];
    }
    for (std::size_t i = j + 1; i < size; ++i) column[i] *= inverse;
  }
  for (std::size_t i = 0; i < size; ++i) step_[i] = -gradient_[i];
  for (std::size_t j = 0; j < size; ++j)
    for (std::size_t i = j + 1; i < size; ++i) step_[i] -= matrix_[j * size + i] * step_[j];
  for (std::size_t j = 0; j < size; ++j) step_[j] /= matrix_[j * size + j];
  for (std::size_t j = size; j-- > 0;)
    for (std::size_t i = j + 1; i < size; ++i) step_[j] -= matrix_[j * size + i] * step_[i];
  return true;
}

// Minimizes value() by Newton's method, with steps that are halved until the value falls enough. Returns the
// number of steps.
int IslandSolver::minimize() {
  const std::size_t size = twists_.size();
  std::fill(twists_.begin(), twists_.end(), 0.0);
  double now = value(twists_);
  for (int n = 0; n < max_steps; ++n) {
    find_gradient();
    find_matrix();
    if (!solve_for_step()) return n;
    double slope = 0;
    for (std::size_t i = 0; i < size; ++i) slope += gradient_[i] * step_[i];
    if (!(slope < -no_slope * std::abs(now))) return n;
    double share = 1, next = 0;
    for (int halving = 0;; ++halving) {
      for (std::size_t i = 0; i < size; ++i) trial_[i] = twists_[i] + share * step_[i];
      next = value(trial_);
      if (next <= now + enough_fall * share * slope) break;
      if (halving == max_halvings) return n;
      share /= 2;
    }
    std::swap(twists_, trial_);
    const bool is_done = now - next < no_fall * std::abs(next);
    now = next;
    if (is_done) return n + 1;
  }
  return max_steps;
}

}  // namespace duet
