#include "sim/articulation/joint_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sim/base/assert.h"
#include "sim/base/rotation.h"
#include "sim/base/stop.h"

namespace duet {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
// Residual of a row that counts as solved, m/s or rad/s: some digits above rounding at speeds of 1 m/s.
constexpr double solved = 1e-11;
// Largest number of rounds of Newton's method for velocities. A few are enough, because joints turn little in
// a step.
constexpr int max_rounds = 12;
// Largest number of changes of the active set, which holds the bounded rows that are at a bound, by clamping
// all impulses that have left their bounds. Solves that converge need fewer; others go over to descend().
constexpr int max_revisions = 10;
// Largest number of changes of the active set in descend(). It needs about one for each row that changes
// sides, 17 for a figure of nine joints with limits and friction; each costs one factorization.
constexpr int max_descents = 200;
// Compliance of rows with bounds on both sides in descend(), as a fraction of the diagonal of J M^-1 J^T: far
// above the dependence of rows that BlockFactor drops (1e-10), so that friction yields to a limit about the
// same axis, and so small that one more round of Newton's method removes its error.
constexpr double compliance = 1e-8;
// A row held at a bound is freed if its residual leads away from the bound by more than this, m/s or rad/s:
// two digits above `solved`, so that rows that are solved do not change sides by rounding.
constexpr double release = 1e-9;
// Largest error of positions at the end of a step that counts as fitting, m or rad. Larger errors are left to
// assemble(); they are a tenth of the largest one that a step may leave (sim/step/articulate.cpp).
constexpr double fitting = 1e-7;
// Bounds of the energy that making positions fit may add to the velocities that keep the joints together: a
// fraction of their energy, and over dt^2 a constant in J s^2, for frames that are a little apart at the
// start. Larger corrections would whip bodies about; the velocities at x^n are made to fit instead.
constexpr double max_correction = 0.1, loose_correction = 1e-8;

}  // namespace

void JointSolver::analyze(const Articulation& articulation, const RigidBodies& rigid) {
  *this = JointSolver();
  std::vector<int> row_counts;
  std::vector<std::vector<int>> joints_of(rigid.size());
  for (const Joint& joint : articulation.joints) {
    const std::vector<JointRow> rows = rows_of(joint);
    rows_.insert(rows_.end(), rows.begin(), rows.end());
    row_counts.push_back(static_cast<int>(rows.size()));
    first_.push_back(rows_.size());
    const auto parent = static_cast<std::size_t>(joint.parent), child = static_cast<std::size_t>(joint.child);
    ends_.push_back({parent, child});
    const int number = static_cast<int>(ends_.size()) - 1;
    for (const std::size_t body : {parent, child})
      if (rigid.properties[body].is_dynamic())
        joints_of[body].push_back(number);
      else
        held_ = true;
    solution_.push_back(BlockFactor::Segment::Zero(row_counts.back()));
  }
  for (std::size_t body = 0; body < joints_of.size(); ++body)
    if (!joints_of[body].empty()) jointed_.push_back(body);
  saved_.resize(jointed_.size());
  std::set<std::pair<int, int>> couplings;
  for (std::size_t body = 0; body < joints_of.size(); ++body)
    for (const int i : joints_of[body])
      for (const int j : joints_of[body]) {
        if (i >= j) continue;
        couplings.insert({i, j});
        shared_.push_back({static_cast<std::size_t>(i), static_cast<std::size_t>(j), body});
      }
  system_.analyze(row_counts, {couplings.begin(), couplings.end()});
  reference_.resize(ends_.size());
  rates_.resize(ends_.size());
  for (std::vector<double>* values : {&least_, &most_, &impulse_, &residual_, &start_impulse_, &halfway_})
    values->assign(rows_.size(), 0);
  free_.assign(rows_.size(), 0);
  factored_ = start_free_ = projected_limit_ = free_;
  predicted_.resize(rigid.size());
}

void JointSolver::update(const Articulation& articulation, const RigidBodies& rigid) {
  DUET_ASSERT(articulation.joints.size() == ends_.size() && rigid.size() == predicted_.size());
  for (std::size_t j = 0; j < ends_.size(); ++j)
    update_rows(articulation.joints[j], rigid.state[ends_[j].parent].pose, rigid.state[ends_[j].child].pose,
                rows_.data() + first_[j], first_[j + 1] - first_[j], reference_[j]);
  is_factored_ = false;
}

double JointSolver::row_velocity(const RigidBodies& rigid, std::size_t joint, const JointRow& row) const {
  const RigidState &parent = rigid.state[ends_[joint].parent], &child = rigid.state[ends_[joint].child];
  return row.linear.dot(child.velocity - parent.velocity) + row.child_moment.dot(child.angular_velocity) -
         row.parent_moment.dot(parent.angular_velocity);
}

void JointSolver::give(RigidBodies& rigid, std::size_t body, const Vec3& linear, const Vec3& angular) {
  const RigidProperties& properties = rigid.properties[body];
  RigidState& state = rigid.state[body];
  if (!properties.is_dynamic()) {
    outside_.linear -= linear;
    outside_.angular -= state.pose.position.cross(linear) + angular;
    return;
  }
  state.velocity += properties.inverse_mass * linear;
  state.angular_momentum += angular;
  state.angular_velocity += state.inverse_inertia * angular;
}

void JointSolver::push(RigidBodies& rigid, std::size_t joint, const JointRow& row, double impulse) {
  give(rigid, ends_[joint].child, impulse * row.linear, impulse * row.child_moment);
  give(rigid, ends_[joint].parent, -impulse * row.linear, -impulse * row.parent_moment);
}

// Entry (r, c) is the velocity of row r of the joint per unit impulse on row c of the other joint, through
// the shared body alone. Entries of rows that are not free are zero.
BlockFactor::Block JointSolver::coupling(const RigidBodies& rigid, const Shared& shared) const {
  const std::size_t i = first_[shared.joint], j = first_[shared.other];
  BlockFactor::Block block(static_cast<Eigen::Index>(first_[shared.joint + 1] - i),
                           static_cast<Eigen::Index>(first_[shared.other + 1] - j));
  const bool is_child = ends_[shared.joint].child == shared.body,
             is_others_child = ends_[shared.other].child == shared.body;
  const double sign = is_child == is_others_child ? 1 : -1;
  const double inverse_mass = rigid.properties[shared.body].inverse_mass;
  const Mat3& inverse_inertia = rigid.state[shared.body].inverse_inertia;
  for (Eigen::Index c = 0; c < block.cols(); ++c) {
    const JointRow& other = rows_[j + static_cast<std::size_t>(c)];
    const bool other_is_free = free_[j + static_cast<std::size_t>(c)];
    const Vec3 velocity = sign * inverse_mass * other.linear;
    const Vec3 spin = sign * (inverse_inertia * (is_others_child ? other.child_moment : other.parent_moment));
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      const JointRow& row = rows_[i + static_cast<std::size_t>(r)];
      block(r, c) =
          other_is_free && free_[i + static_cast<std::size_t>(r)]
              ? row.linear.dot(velocity) + (is_child ? row.child_moment : row.parent_moment).dot(spin)
              : 0;
    }
  }
  return block;
}

void JointSolver::factor(const RigidBodies& rigid, double softness) {
  if (is_factored_ && factored_ == free_ && softness == 0) return;
  system_.set_zero();
  for (std::size_t j = 0; j < ends_.size(); ++j)
    for (const std::size_t body : {ends_[j].parent, ends_[j].child})
      if (rigid.properties[body].is_dynamic())
        system_.diagonal(static_cast<int>(j)) += coupling(rigid, {j, j, body});
  if (yields_)
    for_each_row([&](std::size_t j, std::size_t r) {
      const auto i = static_cast<Eigen::Index>(r - first_[j]);
      if (std::isfinite(most_[r])) system_.diagonal(static_cast<int>(j))(i, i) *= 1 + compliance;
    });
  for (const Shared& shared : shared_)
    system_.add_coupling(static_cast<int>(shared.joint), static_cast<int>(shared.other),
                         coupling(rigid, shared));
  system_.factor(softness);
  factored_ = free_;
  is_factored_ = softness == 0;
}

void JointSolver::free_structure_only() {
  std::fill(projected_limit_.begin(), projected_limit_.end(), 0);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    free_[r] = rows_[r].role == RowRole::structure;
    least_[r] = free_[r] ? -infinite : 0;
    most_[r] = free_[r] ? infinite : 0;
    impulse_[r] = 0;
  }
}

void JointSolver::find_changes(const RigidBodies& rigid) {
  factor(rigid);
  for_each_row([&](std::size_t j, std::size_t r) {
    solution_[j](static_cast<Eigen::Index>(r - first_[j])) = free_[r] ? residual_[r] : 0;
  });
  system_.solve(solution_);
}

void JointSolver::solve_free(RigidBodies& rigid) {
  find_changes(rigid);
  for_each_row([&](std::size_t j, std::size_t r) {
    if (!free_[r]) return;
    const double impulse = solution_[j](static_cast<Eigen::Index>(r - first_[j]));
    push(rigid, j, rows_[r], impulse);
    impulse_[r] += impulse;
  });
}

// Active-set step: clamps impulses that have left their bounds and holds their rows there, and frees the rows
// at a bound whose residual leads back inside. Returns whether any row has changed.
template <class Residual>
bool JointSolver::revise_bounds(RigidBodies& rigid, Residual&& residual) {
  bool changed = false;
  for_each_row([&](std::size_t j, std::size_t r) {
    const JointRow& row = rows_[r];
    if (row.role == RowRole::structure) return;
    if (free_[r]) {
      const double bounded = std::clamp(impulse_[r], least_[r], most_[r]);
      if (bounded == impulse_[r]) return;
      push(rigid, j, row, bounded - impulse_[r]);
      impulse_[r] = bounded;
      free_[r] = 0;
      changed = true;
    } else if (leads_back(j, r, residual)) {
      free_[r] = 1;
      changed = true;
    }
  });
  return changed;
}

template <class Residual>
bool JointSolver::leads_back(std::size_t j, std::size_t r, Residual&& residual) const {
  if (!(least_[r] < most_[r])) return false;
  const double lacking = residual(j, r);
  return (impulse_[r] <= least_[r] && lacking > release) || (impulse_[r] >= most_[r] && lacking < -release);
}

// Fills residual_ with the residuals of free rows, and returns the largest one.
template <class Residual>
double JointSolver::find_residuals(Residual&& residual) {
  double largest = 0;
  for_each_row([&](std::size_t j, std::size_t r) {
    residual_[r] = free_[r] ? residual(j, r) : 0;
    largest = std::max(largest, std::abs(residual_[r]));
  });
  return largest;
}

// Each round calls take() for the residuals in residual_; the rounds end if it returns false. Redundant rows
// of loops may ask for what they cannot have; their residual stays, as rounding does.
template <class Prepare, class Residual, class Take>
double JointSolver::solve_rounds(Prepare&& prepare, Residual&& residual, Take&& take) {
  double first = 0, before = infinite;
  for (int round = 0; round < max_rounds; ++round) {
    stop_if_asked();
    prepare();
    const double largest = find_residuals(residual);
    if (round == 0) first = largest;
    if (largest <= solved || !(largest < 0.5 * before)) break;
    before = largest;
    if (!take()) break;
  }
  prepare();
  return first;
}

template <class Prepare, class Residual>
double JointSolver::satisfy(RigidBodies& rigid, Prepare&& prepare, Residual&& residual) {
  start_impulse_ = impulse_;
  double first = 0;
  bool changed = true;
  for (int revision = 0; changed && revision <= max_revisions; ++revision) {
    const double off = solve_rounds(prepare, residual, [&] {
      solve_free(rigid);
      return true;
    });
    if (revision == 0) first = off;
    changed = revise_bounds(rigid, residual);
  }
  if (changed) descend(rigid, prepare, residual);
  return first;
}

bool JointSolver::step_to_bound(RigidBodies& rigid) {
  find_changes(rigid);
  const auto change = [&](std::size_t j, std::size_t r) {
    return solution_[j](static_cast<Eigen::Index>(r - first_[j]));
  };
  const auto room = [&](std::size_t r, double d) { return (d > 0 ? most_[r] : least_[r]) - impulse_[r]; };
  double fraction = 1;
  for_each_row([&](std::size_t j, std::size_t r) {
    const double d = change(j, r);
    if (free_[r] && std::abs(room(r, d)) < fraction * std::abs(d)) fraction = room(r, d) / d;
  });
  bool is_blocked = false;
  for_each_row([&](std::size_t j, std::size_t r) {
    if (!free_[r]) return;
    const double d = change(j, r), left = room(r, d);
    double step = fraction * d;
    if (fraction < 1 && d != 0 && std::abs(left) <= std::abs(step)) {
      step = left;
      free_[r] = 0;
      is_blocked = true;
    }
    push(rigid, j, rows_[r], step);
    impulse_[r] = free_[r] ? impulse_[r] + step : d > 0 ? most_[r] : least_[r];
  });
  return is_blocked;
}

// The impulses y minimize
//
//     f(y) = 1/2 y . S y - y . r,   S = J M^-1 J^T,   least <= y <= most
//
// for the residuals r without them. If all rows are to have velocity zero, f is the kinetic energy that the
// impulses add. Clamping impulses that have left their bounds can raise f without bound where rows are nearly
// dependent, as a limit of swing and two axes of friction: the limit keeps a huge impulse that friction would
// have balanced. Here y stays within the bounds and f never rises, because each step ends at the first bound
// that it meets (primal active-set method; Nocedal, Wright 2006, section 16.5). Rows with bounds on both
// sides yield a little, so that the rows of S that may conflict are never dependent.
template <class Prepare, class Residual>
void JointSolver::descend(RigidBodies& rigid, Prepare&& prepare, Residual&& residual) {
  for_each_row([&](std::size_t j, std::size_t r) {
    push(rigid, j, rows_[r], start_impulse_[r] - impulse_[r]);
    impulse_[r] = start_impulse_[r];
    if (rows_[r].role != RowRole::structure) free_[r] = least_[r] < impulse_[r] && impulse_[r] < most_[r];
  });
  yields_ = true;
  is_factored_ = false;
  bool changed = true;
  for (int step = 0; changed && step < max_descents; ++step) {
    changed = false;
    solve_rounds(prepare, residual, [&] {
      changed = step_to_bound(rigid);
      return !changed;
    });
    if (changed) continue;
    for_each_row([&](std::size_t j, std::size_t r) {
      if (free_[r] || !leads_back(j, r, residual)) return;
      free_[r] = 1;
      changed = true;
    });
  }
  yields_ = false;
  is_factored_ = false;
  if (!changed) return;
  // The steps were not enough: the structure rows hold in any case.
  for_each_row([&](std::size_t, std::size_t r) { free_[r] = rows_[r].role == RowRole::structure; });
  solve_rounds(prepare, residual, [&] {
    solve_free(rigid);
    return true;
  });
}

double JointSolver::stabilize(RigidBodies& rigid) {
  free_structure_only();
  outside_ = {};
  return satisfy(
      rigid, [] {}, [&](std::size_t j, std::size_t r) { return -row_velocity(rigid, j, rows_[r]); });
}

void JointSolver::begin_impulses(const Articulation& articulation, double seconds) {
  DUET_ASSERT(articulation.joints.size() == ends_.size() && seconds >= 0);
  free_structure_only();
  fits_ = is_first_ = true;
  outside_ = {};
  for_each_row([&](std::size_t j, std::size_t r) {
    const Joint& joint = articulation.joints[j];
    const RowRole role = rows_[r].role;
    if (role == RowRole::structure) return;
    free_[r] = role != RowRole::limit;
    const Bounds bounds = drive_bounds(joint, role, seconds);
    least_[r] = bounds.least;
    most_[r] = bounds.most;
  });
}

void JointSolver::plan_control(const Articulation& articulation, const RigidBodies& rigid, double time,
                               double dt, std::vector<double>& angle) {
  DUET_ASSERT(articulation.joints.size() == ends_.size() && dt > 0);
  DUET_ASSERT(angle.empty() || angle.size() == ends_.size());
  for (std::size_t j = 0; j < ends_.size(); ++j) {
    const Joint& joint = articulation.joints[j];
    if (!joint.control.on) continue;
    const RigidState &parent = rigid.state[ends_[j].parent], &child = rigid.state[ends_[j].child];
    const JointFrames frames(joint, parent.pose, child.pose);
    Vec3 rate = frames.parent_axes.conjugate() * (child.angular_velocity - parent.angular_velocity);
    if (joint.kind == JointKind::prismatic)
      for (std::size_t r = first_[j]; r < first_[j + 1]; ++r)
        if (rows_[r].role == RowRole::control) rate = row_velocity(rigid, j, rows_[r]) * Vec3::UnitX();
    double none = 0;
    rates_[j] = control_rates(joint, frames, rate, time, dt, angle.empty() ? none : angle[j]);
  }
}

double JointSolver::wanted(const JointRow& row, const Vec3& rate, const Quat& parent_axes) {
  if (row.role != RowRole::control) return 0;
  return row.motion == RowMotion::travel ? rate.x() : row.child_moment.dot(parent_axes * rate);
}

double JointSolver::pre_stabilize(const Articulation& articulation, RigidBodies& rigid,
                                  const std::vector<Pose>& end_pose, double dt,
                                  OrientationUpdate orientation) {
  DUET_ASSERT(end_pose.size() == rigid.size() && dt > 0);
  const auto axes = [&](std::size_t j) {
    return rigid.state[ends_[j].parent].pose.orientation * articulation.joints[j].parent_frame.orientation;
  };
  const auto predict = [&] {
    for (const Ends& ends : ends_)
      for (const std::size_t body : {ends.parent, ends.child})
        predicted_[body] = rigid.properties[body].is_dynamic()
                               ? evolved_pose(rigid.state[body], dt, orientation)
                               : end_pose[body];
  };
  const auto slack_now = [&](std::size_t j, std::size_t r) {
    const Pose &parent = rigid.state[ends_[j].parent].pose, &child = rigid.state[ends_[j].child].pose;
    const Joint& joint = articulation.joints[j];
    return limit_slack(joint, rows_[r], JointFrames(joint, parent, child));
  };
  const auto lacking = [&](std::size_t j, std::size_t r) {
    const Joint& joint = articulation.joints[j];
    const JointRow& row = rows_[r];
    if (row.role == RowRole::control || row.role == RowRole::friction)
      return wanted(row, rates_[j].mean, axes(j)) - row_velocity(rigid, j, row);
    const JointFrames frames(joint, predicted_[ends_[j].parent], predicted_[ends_[j].child]);
    if (row.role == RowRole::structure) return -structure_error(joint, row, frames, reference_[j]) / dt;
    const double slack = slack_now(j, r), aim = slack < 0 ? slack + dt * limit_rate(slack, dt) : 0;
    return (aim - limit_slack(joint, row, frames)) / dt;
  };
  const auto lacking_now = [&](std::size_t j, std::size_t r) {
    const JointRow& row = rows_[r];
    double rate = wanted(row, rates_[j].mean, axes(j));
    if (row.role == RowRole::limit) rate = limit_rate(slack_now(j, r), dt);
    return rate - row_velocity(rigid, j, row);
  };
  const auto fit_now = [&] {
    return satisfy(
        rigid, [] {}, lacking_now);
  };
  double off = is_first_ || !fits_ ? fit_now() : 0;
  is_first_ = false;
  if (fits_) {
    save_states(rigid);
    const double off_ahead = satisfy(rigid, predict, lacking);
    predict();
    double worst = 0;
    for_each_row([&](std::size_t j, std::size_t r) {
      if (rows_[r].role == RowRole::structure) worst = std::max(worst, dt * std::abs(lacking(j, r)));
    });
    const double most = jointed_energy(rigid) * max_correction + loose_correction / (dt * dt);
    fits_ = worst <= fitting && changed_energy(rigid) <= most;
    if (!fits_) restore_states(rigid);
    off = std::max(off, fits_ ? off_ahead : fit_now());
  }
  dt_ = dt;
  for_each_row([&](std::size_t, std::size_t r) {
    if (rows_[r].role == RowRole::limit) halfway_[r] = rows_[r].side * impulse_[r];
  });
  return off;
}

void JointSolver::save_states(const RigidBodies& rigid) {
  for (std::size_t i = 0; i < jointed_.size(); ++i) saved_[i] = rigid.state[jointed_[i]];
  saved_impulse_ = impulse_;
  saved_outside_ = outside_;
}

void JointSolver::restore_states(RigidBodies& rigid) {
  for (std::size_t i = 0; i < jointed_.size(); ++i) rigid.state[jointed_[i]] = saved_[i];
  impulse_ = saved_impulse_;
  outside_ = saved_outside_;
}

double JointSolver::changed_energy(const RigidBodies& rigid) const {
  double energy = 0;
  for (std::size_t i = 0; i < jointed_.size(); ++i) {
    const RigidState &now = rigid.state[jointed_[i]], &then = saved_[i];
    const Vec3 turn = now.angular_velocity - then.angular_velocity;
    energy += rigid.properties[jointed_[i]].mass * (now.velocity - then.velocity).squaredNorm() / 2 +
              turn.dot(now.angular_momentum - then.angular_momentum) / 2;
  }
  return energy;
}

double JointSolver::jointed_energy(const RigidBodies& rigid) const {
  double energy = 0;
  for (std::size_t i = 0; i < jointed_.size(); ++i)
    energy += kinetic_energy(saved_[i], rigid.properties[jointed_[i]]);
  return energy;
}

double JointSolver::stabilize_and_control(const Articulation& articulation, RigidBodies& rigid) {
  return satisfy(
      rigid, [] {},
      [&](std::size_t j, std::size_t r) {
        const Joint& joint = articulation.joints[j];
        const JointRow& row = rows_[r];
        const Pose &parent = rigid.state[ends_[j].parent].pose, &child = rigid.state[ends_[j].child].pose;
        const double rate =
            row.role == RowRole::limit
                ? end_rate(r, limit_slack(joint, row, JointFrames(joint, parent, child)))
                : wanted(row, rates_[j].end, parent.orientation * joint.parent_frame.orientation);
        return rate - row_velocity(rigid, j, row);
      });
}

}  // namespace duet
