#include "sim/deformable/self_contact/impact_zones.h"

#include <algorithm>

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"

namespace duet {
namespace {

// Rigid displacement v + w x r of a zone, with r from its reference point `center`; all in m, w in rad.
struct RigidDisplacement {
  Vec3 center = Vec3::Zero(), linear = Vec3::Zero(), angular = Vec3::Zero();
  Vec3 at(const Vec3& x) const { return linear + angular.cross(x - center); }
};

// Principal moments of inertia that are smaller, relative to the largest one, carry no rotation: the
// particles do not define a rotation about the line on which they lie.
constexpr double no_inertia = 1e-12;

// Returns the rigid displacement with the linear and angular momentum of the particles' displacements, with
// the masses weight(particle).
template <class Weight>
RigidDisplacement best_rigid(std::span<const int> particles, Weight&& weight, const std::vector<Vec3>& start,
                             const std::vector<Vec3>& end) {
  RigidDisplacement result;
  double total = 0;
  for (int i : particles) {
    const auto p = as_index(i);
    total += weight(p);
    result.center += weight(p) * start[p];
    result.linear += weight(p) * (end[p] - start[p]);
  }
  result.center /= total;
  result.linear /= total;
  Vec3 momentum = Vec3::Zero();
  Mat3 inertia = Mat3::Zero();
  for (int i : particles) {
    const auto p = as_index(i);
    const Vec3 arm = start[p] - result.center;
    momentum += weight(p) * arm.cross(end[p] - start[p] - result.linear);
    inertia += weight(p) * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  const SymmetricEigen<3> eigen = symmetric_eigen<3>(inertia);
  const Vec3& moment = eigen.values;
  for (int k = 0; k < 3; ++k) {
    if (moment[k] <= no_inertia * moment[2]) continue;
    const Vec3 axis = eigen.vectors.col(k);
    result.angular += axis.dot(momentum) / moment[k] * axis;
  }
  return result;
}

}  // namespace

void ImpactZones::clear(std::size_t particles) {
  sets_.reset(particles);
  listed_.assign(particles, 0);
  members_.clear();
  zones_.clear();
}

bool ImpactZones::join(std::span<const int> particles) {
  DUET_ASSERT(!particles.empty());
  bool joined = false;
  for (int p : particles) {
    if (!listed_[as_index(p)]) members_.push_back(p);
    listed_[as_index(p)] = 1;
    joined |= sets_.join(particles[0], p);
  }
  return joined;
}

bool ImpactZones::together(std::span<const int> particles) const {
  DUET_ASSERT(!particles.empty());
  const int first = sets_.first(particles[0]);
  return std::all_of(particles.begin(), particles.end(), [&](int p) { return sets_.first(p) == first; });
}

void ImpactZones::sort_members() {
  std::sort(members_.begin(), members_.end(), [&](int a, int b) {
    const int first_a = sets_.first(a), first_b = sets_.first(b);
    return first_a != first_b ? first_a < first_b : a < b;
  });
  zones_.clear();
  for (std::size_t i = 0; i < members_.size(); ++i) {
    const int first = sets_.first(members_[i]);
    if (zones_.empty() || zones_.back().first != first) zones_.push_back({first, static_cast<int>(i), 0});
    zones_.back().end = static_cast<int>(i) + 1;
  }
}

bool ImpactZones::move(const std::vector<Vec3>& start, const std::vector<double>& inverse_mass,
                       std::vector<Vec3>& end) {
  DUET_ASSERT(start.size() == end.size() && start.size() == inverse_mass.size());
  DUET_ASSERT(start.size() == sets_.size());
  sort_members();
  bool all_move = true;
  for (const Zone& zone : zones_) {
    const std::span<const int> particles(members_.data() + zone.begin, as_index(zone.end - zone.begin));
    const auto is_held = [&](int p) { return !(inverse_mass[as_index(p)] > 0); };
    const bool led = std::any_of(particles.begin(), particles.end(), is_held);
    const RigidDisplacement displacement =
        led ? best_rigid(
                  particles, [&](std::size_t p) { return inverse_mass[p] > 0 ? 0.0 : 1.0; }, start, end)
            : best_rigid(
                  particles, [&](std::size_t p) { return 1 / inverse_mass[p]; }, start, end);
    for (int i : particles) {
      const auto p = as_index(i);
      // A held particle that differs from the rigid displacement by more than rounding (1e-9 of its own
      // displacement) cannot be followed.
      const Vec3 target = start[p] + displacement.at(start[p]);
      if (!is_held(i))
        end[p] = target;
      else if ((end[p] - target).norm() > 1e-9 * (end[p] - start[p]).norm())
        all_move = false;
    }
  }
  return all_move;
}

}  // namespace duet
