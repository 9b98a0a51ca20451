#include "sim/deformable/self_repulsion.h"

#include <algorithm>

#include <Eigen/LU>

#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr std::size_t grain = 512;
constexpr int rounds = 3;
// What part of the way to the distance h a pair may go in a step, either way (Bridson et al. 2002, section
// 7.2).
constexpr double share = 0.1;

// Bounds of the two elements along the axes: cheaper than their closest points.
bool farther_than(double range, ElementPair kind, const FourPoints& x) {
  const std::size_t first = kind == ElementPair::point_triangle ? 1 : 2;
  Eigen::AlignedBox3d a, b;
  for (std::size_t i = 0; i < 4; ++i) (i < first ? a : b).extend(x[i]);
  return a.squaredExteriorDistance(b) > range * range;
}

double effective_mass(const std::array<int, 4>& particle, const std::array<double, 4>& weight,
                      const std::vector<double>& inverse_mass) {
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += weight[i] * weight[i] * inverse_mass[as_index(particle[i])];
  return sum > 0 ? 1 / sum : 0;
}

// The speed at which a pair may part at least: negative where it is farther apart than h.
double least_speed(const RepulsionPair& pair, double dt) {
  return std::min(0.0, share * (pair.thickness - pair.distance) / dt);
}

// Friction acts at two points that are a distance apart, as a couple. Its angular momentum is taken out again
// as a turn of the pair's four particles as one; those that are held fast take it up themselves.
void take_back_turn(const RepulsionPair& pair, const Vec3& angular_momentum, const std::vector<Vec3>& x,
                    const std::vector<double>& inverse_mass, std::vector<Vec3>& v) {
  std::array<double, 4> mass;
  double total = 0;
  Vec3 center = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    if (!(inverse_mass[p] > 0)) return;
    mass[i] = 1 / inverse_mass[p];
    total += mass[i];
    center += mass[i] * x[p];
  }
  center /= total;
  Mat3 inertia = Mat3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 arm = x[as_index(pair.particle[i])] - center;
    inertia += mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  // Particles on a line do not turn about it, and nothing asks them to.
  inertia.diagonal().array() += 1e-14 * inertia.trace();
  const Vec3 turn = inertia.inverse() * angular_momentum;
  for (const int p : pair.particle) v[as_index(p)] -= turn.cross(x[as_index(p)] - center);
}

}  // namespace

Vec3 relative_velocity(const RepulsionPair& pair, const std::vector<Vec3>& v) {
  return weighted(pair.weight, corners(pair.particle, v));
}

void apply_impulse(const RepulsionPair& pair, const Vec3& impulse, const std::vector<double>& inverse_mass,
                   std::vector<Vec3>& v) {
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    v[p] += pair.weight[i] * inverse_mass[p] * impulse;
  }
}

void SelfRepulsion::find(const CollisionCandidates& candidates, const std::vector<Vec3>& x,
                         const std::vector<double>& inverse_mass) {
  const std::vector<CandidatePair>& near = candidates.near();
  const std::size_t chunks = (near.size() + grain - 1) / grain;
  if (chunks_.size() < chunks) chunks_.resize(chunks);
  parallel_for(near.size(), grain, [&](std::size_t begin, std::size_t end) {
    std::vector<RepulsionPair>& found = chunks_[begin / grain].pairs;
    found.clear();
    for (std::size_t c = begin; c < end; ++c) {
      const CandidatePair& candidate = near[c];
      const double range = repulsion_range * candidate.thickness;
      const FourPoints at = corners(candidate.particle, x);
      if (!candidate.repels || farther_than(range, candidate.kind, at)) continue;
      const ClosestPoints closest = closest_points(candidate.kind, at);
      const double distance = closest.difference.norm();
      if (distance >= range || !(distance > 0)) continue;
      RepulsionPair pair{candidate.particle, closest.weight,      closest.difference / distance,
                         distance,           candidate.thickness, candidate.friction};
      pair.mass = pair.row_mass = effective_mass(pair.particle, pair.weight, inverse_mass);
      found.push_back(pair);
    }
  });
  pairs_.clear();
  for (std::size_t c = 0; c < chunks; ++c)
    pairs_.insert(pairs_.end(), chunks_[c].pairs.begin(), chunks_[c].pairs.end());
}

// Friction takes as much tangential momentum as the normal impulse of the same visit allows (Coulomb), so
// that the rounds together stay within the cone.
void SelfRepulsion::apply(double dt, const std::vector<Vec3>& x, const std::vector<double>& inverse_mass,
                          std::vector<Vec3>& v) const {
  for (int round = 0; round < rounds; ++round)
    for (const RepulsionPair& pair : pairs_) {
      const Vec3 relative = relative_velocity(pair, v);
      const double speed = relative.dot(pair.normal);
      const double change = least_speed(pair, dt) - speed;
      if (change <= 0) continue;
      apply_impulse(pair, pair.mass * change * pair.normal, inverse_mass, v);
      const Vec3 tangential = relative - speed * pair.normal;
      const double slip = tangential.norm();
      if (!(slip > 0) || !(pair.friction > 0)) continue;
      const Vec3 friction = -pair.mass * std::min(1.0, pair.friction * change / slip) * tangential;
      apply_impulse(pair, friction, inverse_mass, v);
      take_back_turn(pair, (pair.distance * pair.normal).cross(friction), x, inverse_mass, v);
    }
}

// In step I this changes positions alone, as the velocities of time n are taken up again after them: so it
// adds no kinetic energy, and needs no spring constant to be bounded by.
void SelfRepulsion::apply_elastic(double dt, const std::vector<double>& inverse_mass,
                                  std::vector<Vec3>& v) const {
  for (const RepulsionPair& pair : pairs_) {
    if (pair.distance >= pair.thickness) continue;
    const double change =
        share * (pair.thickness - pair.distance) / dt - relative_velocity(pair, v).dot(pair.normal);
    if (change > 0) apply_impulse(pair, pair.mass * change * pair.normal, inverse_mass, v);
  }
}

void SelfRepulsion::choose_rows(const std::vector<Vec3>& start, const std::vector<Vec3>& velocity) {
  for (RepulsionPair& pair : pairs_) {
    pair.target = 0.5 * relative_velocity(pair, start).dot(pair.normal);
    pair.active =
        pair.distance < pair.thickness && relative_velocity(pair, velocity).dot(pair.normal) <= pair.target;
  }
}

bool SelfRepulsion::release_rows(const std::vector<Vec3>& change, double tolerance) {
  bool any = false;
  for (RepulsionPair& pair : pairs_) {
    if (!pair.active || relative_velocity(pair, change).dot(pair.normal) <= tolerance) continue;
    pair.active = false;
    any = true;
  }
  return any;
}

void SelfRepulsion::use_inverse_masses(const std::vector<SymmetricBlock>* inverse_mass) {
  row_inverse_mass_ = inverse_mass;
  for (RepulsionPair& pair : pairs_) {
    pair.row_mass = pair.mass;
    if (!inverse_mass || !takes(pair)) continue;
    double sum = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const SymmetricBlock& inverse = (*inverse_mass)[as_index(pair.particle[i])];
      sum += pair.weight[i] * pair.weight[i] * pair.normal.dot(inverse * pair.normal);
    }
    pair.row_mass = sum > 0 ? 1 / sum : 0;
  }
}

void SelfRepulsion::sweep(bool with_target, const std::vector<double>& inverse_mass,
                          std::vector<Vec3>& v) const {
  const auto project = [&](const RepulsionPair& pair) {
    if (!takes(pair)) return;
    const double speed = relative_velocity(pair, v).dot(pair.normal);
    const Vec3 impulse = pair.row_mass * ((with_target ? pair.target : 0) - speed) * pair.normal;
    if (!row_inverse_mass_) {
      apply_impulse(pair, impulse, inverse_mass, v);
      return;
    }
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = as_index(pair.particle[i]);
      v[p] += pair.weight[i] * ((*row_inverse_mass_)[p] * impulse);
    }
  };
  std::for_each(pairs_.begin(), pairs_.end(), project);
  std::for_each(pairs_.rbegin(), pairs_.rend(), project);
}

}  // namespace duet
