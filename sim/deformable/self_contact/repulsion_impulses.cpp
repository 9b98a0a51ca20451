// The impulses of self-repulsions: projected Gauss-Seidel sweeps over the pairs.
#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "sim/base/assert.h"
#include "sim/deformable/self_contact/self_repulsion.h"

namespace duet {
namespace {

// Sweeps end when none changes a velocity by more than this fraction of the first sweep's largest change.
constexpr double settled = 1e-3;
constexpr int most_sweeps = 20;
// Least part of the friction between two elements that is taken to be left when its couple is removed.
// Between edges that are nearly parallel, and between small elements, less is left.
constexpr double least_kept = 0.5;

// A rotation of the four particles of a pair: v += angular_velocity x (x - center).
struct Rotation {
  Vec3 angular_velocity = Vec3::Zero();  // rad/s
  Vec3 center = Vec3::Zero();            // m: center of mass of the particles
  Vec3 impulse = Vec3::Zero();           // N s: given to the first element, and taken from the second
};

// Returns the rotation that removes an angular momentum (N m s) from a pair; none if a particle is held,
// because held particles take up the momentum.
Rotation rotation_against(const RepulsionPair& pair, const Vec3& angular_momentum, const std::vector<Vec3>& x,
                          const std::vector<double>& inverse_mass) {
  std::array<double, 4> mass;
  double total = 0;
  Rotation result;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    if (!(inverse_mass[p] > 0)) return {};
    mass[i] = 1 / inverse_mass[p];
    total += mass[i];
    result.center += mass[i] * x[p];
  }
  result.center /= total;
  Mat3 inertia = Mat3::Zero();
  Vec3 first = Vec3::Zero();  // kg m: mass moment of the first element about the center
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 arm = x[as_index(pair.particle[i])] - result.center;
    inertia += mass[i] * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
    if (i < as_index(pair.first)) first += mass[i] * arm;
  }
  // Keeps the inertia of particles on a line invertible; no angular momentum about the line needs to be
  // removed.
  inertia.diagonal().array() += 1e-14 * inertia.trace();
  result.angular_velocity = -(inertia.inverse() * angular_momentum);
  result.impulse = result.angular_velocity.cross(first);
  return result;
}

// Adds an impulse (N s) on a pair, with its part `along_normal` (N s) along the normal, to the sums of its
// particles. Both elements are pressed.
void add_to(ContactImpulses& tally, const RepulsionPair& pair, const Vec3& impulse, double along_normal) {
  for (std::size_t i = 0; i < 4; ++i)
    tally.add(as_index(pair.particle[i]), pair.weight[i] * impulse, std::abs(pair.weight[i]) * along_normal);
}

// Gives the first element of a pair an impulse of friction (N s, along the surface) and the second one its
// opposite, at the positions `x` (m). The two act at a distance from each other, so they form a couple. A
// rotation of the four particles removes its angular momentum, but gives a part of the tangential momentum
// back: 1 % if the surfaces are a tenth of an element apart. The impulses are that much larger, so that what
// is left is what is asked for. Adds the impulses on particles to `friction`, and to `tally` unless it is
// null.
void apply_friction(const RepulsionPair& pair, const Vec3& impulse, const std::vector<Vec3>& x,
                    const std::vector<double>& inverse_mass, std::vector<Vec3>& v,
                    std::vector<Vec3>& friction, ContactImpulses* tally) {
  const double size = impulse.norm();
  const Vec3 direction = impulse / size;
  const Rotation back =
      rotation_against(pair, (pair.distance * pair.normal).cross(direction), x, inverse_mass);
  const Vec3 left = direction + back.impulse;  // of an impulse of 1
  const double kept = std::max((left - left.dot(pair.normal) * pair.normal).norm(), least_kept);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    const Vec3 turn = size / kept * back.angular_velocity.cross(x[p] - back.center);
    Vec3 push = size / kept * pair.weight[i] * direction;
    v[p] += inverse_mass[p] * push + turn;
    if (inverse_mass[p] > 0) push += turn / inverse_mass[p];
    friction[p] += push;
    if (tally) tally->add(p, push, 0);
  }
}

}  // namespace

void apply_impulse(const RepulsionPair& pair, const Vec3& impulse, const std::vector<double>& inverse_mass,
                   std::vector<Vec3>& v) {
  DUET_ASSERT(is_unit(pair.normal));
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    v[p] += pair.weight[i] * inverse_mass[p] * impulse;
  }
}

double min_speed(const RepulsionPair& pair, double dt) {
  return (pair.active ? parted_share : 1) * std::min(0.0, (pair.thickness - pair.distance) / dt);
}

template <class Visit>
void SelfRepulsion::sweep_impulses(Visit&& visit) {
  impulses_.assign(pairs_.size(), {});
  double first = 0;  // m/s
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    double most = 0;  // m/s
    for (std::size_t k = 0; k < pairs_.size(); ++k)
      if (pairs_[k].mass > 0) most = std::max(most, visit(pairs_[k], impulses_[k]));
    if (sweep == 0) first = most;
    if (!(most > settled * first)) return;
  }
}

// A visit makes the pair's normal velocity the least that it may have, and its friction takes the tangential
// velocity away, as far as the sums of the pair's impulses remain in the friction cone. So a later visit
// takes back what neighbors have made superfluous. Without that, pairs on the same particles would together
// push too much: surfaces that press each other would rebound, with energy from nothing.
void SelfRepulsion::apply(double dt, const std::vector<Vec3>& x, const std::vector<double>& inverse_mass,
                          std::vector<Vec3>& v, std::vector<Vec3>& friction, ContactImpulses* tally) {
  DUET_ASSERT(dt > 0 && x.size() == v.size() && inverse_mass.size() == v.size());
  friction.assign(v.size(), Vec3::Zero());
  sweep_impulses([&](const RepulsionPair& pair, PairImpulse& sum) {
    const Vec3 relative = relative_velocity(pair, v);
    const double speed = relative.dot(pair.normal);
    const double normal = std::max(sum.normal + pair.mass * (min_speed(pair, dt) - speed), 0.0),
                 change = normal - sum.normal;
    if (normal == 0 && change == 0) return 0.0;
    sum.normal = normal;
    apply_impulse(pair, change * pair.normal, inverse_mass, v);
    if (tally) add_to(*tally, pair, change * pair.normal, change);
    if (!(pair.friction > 0)) return std::abs(change) / pair.mass;
    Vec3 tangential = sum.friction - pair.mass * (relative - speed * pair.normal);
    const double wanted = tangential.norm(), limit = pair.friction * normal;
    if (wanted > limit) tangential *= limit / wanted;
    const Vec3 more = tangential - sum.friction;
    sum.friction = tangential;
    if (!more.isZero(0)) apply_friction(pair, more, x, inverse_mass, v, friction, tally);
    return std::max(std::abs(change), more.norm()) / pair.mass;
  });
}

// In step I this changes positions alone, because the velocities of time n are resumed afterwards. So it adds
// no kinetic energy, and no spring constant is needed to bound it.
void SelfRepulsion::apply_elastic(double dt, const std::vector<double>& inverse_mass, std::vector<Vec3>& v) {
  DUET_ASSERT(dt > 0 && inverse_mass.size() == v.size());
  sweep_impulses([&](const RepulsionPair& pair, PairImpulse& sum) {
    if (pair.distance >= pair.thickness) return 0.0;
    const double parting = parted_share * (pair.thickness - pair.distance) / dt,
                 speed = relative_velocity(pair, v).dot(pair.normal),
                 normal = std::max(sum.normal + pair.mass * (parting - speed), 0.0);
    const double change = normal - sum.normal;
    sum.normal = normal;
    apply_impulse(pair, change * pair.normal, inverse_mass, v);
    return std::abs(change) / pair.mass;
  });
}

}  // namespace duet
