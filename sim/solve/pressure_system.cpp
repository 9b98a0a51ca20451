#include "sim/solve/pressure_system.h"

#include <algorithm>
#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/solve/conjugate_residual.h"

namespace duet {
namespace {

constexpr std::size_t rings_at_once = 2048;  // one-rings of one task

// Least diagonal entry of a one-ring, over its value at rest. A one-ring that is compressed to less has no
// direction left in which pressure could act.
constexpr double min_diagonal = 1e-12;

void set_zero(GeneralizedVelocity& v) {
  for (std::vector<Vec3>* values : {&v.particle, &v.linear, &v.angular})
    std::fill(values->begin(), values->end(), Vec3::Zero());
}

// The operator y = s D P M^-1 D^T s x with s = 1/sqrt(diagonal): Jacobi's preconditioner, applied from both
// sides. It takes the sizes and densities of bodies and elements out of the problem.
class PressureSystem {
 public:
  PressureSystem(const Bodies& bodies, const ContactProjection* projection, PressureScratch& scratch)
      : bodies_(bodies), projection_(projection), scratch_(scratch) {}

  // Sets scratch.change to the change of the velocities by the pressures s x, and scratch.scaled to s x.
  void change_velocities(const std::vector<double>& x) {
    scale(x, scratch_.scaled);
    GeneralizedVelocity& change = scratch_.change;
    if (projection_) set_zero(change);
    pressure_change(bodies_, scratch_.scaled, scratch_.held_impulse, change);
    if (!projection_) return;
    projection_->project(change);
    follow_twists(bodies_.bound, change.linear, change.angular, change.particle);
  }
  void apply(const std::vector<double>& x, std::vector<double>& out) {
    change_velocities(x);
    bodies_.nodal_volumes.divergence(scratch_.change.particle, out);
    scale(out, out);
  }
  double inner(const std::vector<double>& a, const std::vector<double>& b) const {
    return parallel_sum(a.size(), rings_at_once, [&](std::size_t i, double& sum) { sum += a[i] * b[i]; });
  }
  // Returns the largest error of a one-ring's rate over the error that the tolerance allows.
  double norm(const std::vector<double>& r) const {
    double largest = 0;
    for (std::size_t i = 0; i < r.size(); ++i) {
      const double here = std::abs(r[i]) * scratch_.tolerance[i];
      if (!(here <= largest)) largest = here;  // also takes a NaN, which ends the solve
    }
    return largest;
  }
  void scale(const std::vector<double>& x, std::vector<double>& out) const {
    for_each(x, out, [&](std::size_t i, double a, double) { return scratch_.scale[i] * a; });
  }
  static void clear(std::vector<double>& x) { std::fill(x.begin(), x.end(), 0.0); }
  static void axpy(double alpha, const std::vector<double>& x, std::vector<double>& y) {
    for_each(x, y, [alpha](std::size_t, double a, double b) { return b + alpha * a; });
  }
  static void xpay(const std::vector<double>& x, double beta, std::vector<double>& y) {
    for_each(x, y, [beta](std::size_t, double a, double b) { return a + beta * b; });
  }

 private:
  template <class Operation>
  static void for_each(const std::vector<double>& x, std::vector<double>& y, Operation&& operation) {
    parallel_for(x.size(), rings_at_once, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) y[i] = operation(i, x[i], y[i]);
    });
  }

  const Bodies& bodies_;
  const ContactProjection* projection_;
  PressureScratch& scratch_;
};

// Sizes the scratch, and computes scales, tolerances and the right side.
void prepare(const Bodies& bodies, double dt, const PressureSettings& settings, PressureScratch& scratch) {
  const NodalVolumes& rings = bodies.nodal_volumes;
  const std::size_t n = rings.size();
  for (std::vector<double>* values :
       {&scratch.pressure, &scratch.scale, &scratch.tolerance, &scratch.scaled, &scratch.right_side})
    values->resize(n);
  scratch.change.particle.resize(bodies.particles.size());
  scratch.change.linear.resize(bodies.rigid.size());
  scratch.change.angular.resize(bodies.rigid.size());
  set_zero(scratch.change);  // the system writes the particles of one-rings only

  for (std::size_t i = 0; i < n; ++i) {
    const double diagonal = rings.diagonal(i);
    const bool acts = diagonal > min_diagonal * rings.rest_diagonal(i);
    scratch.scale[i] = acts ? 1 / std::sqrt(diagonal) : 0;
    scratch.tolerance[i] = acts ? std::sqrt(diagonal) * dt / (settings.tolerance * rings.rest_volume(i)) : 0;
    scratch.right_side[i] = scratch.scale[i] * scratch.rate[i];
  }
}

}  // namespace

void pressure_change(const Bodies& bodies, const std::vector<double>& q, std::vector<Vec3>& held_impulse,
                     GeneralizedVelocity& change) {
  bodies.nodal_volumes.pressure_velocity(q, change.particle);
  if (bodies.bound.empty()) return;
  held_impulse.resize(change.particle.size(), Vec3::Zero());
  bodies.nodal_volumes.impulses_on_held(q, held_impulse);
  std::fill(change.linear.begin(), change.linear.end(), Vec3::Zero());
  std::fill(change.angular.begin(), change.angular.end(), Vec3::Zero());
  add_force_twists(bodies.rigid, bodies.bound, held_impulse, 1, change.linear, change.angular);
  follow_twists(bodies.bound, change.linear, change.angular, change.particle);
}

CgResult find_pressures(const Bodies& bodies, const ContactProjection* projection, double dt,
                        const PressureSettings& settings, PressureScratch& scratch) {
  DUET_ASSERT(dt > 0 && settings.tolerance > 0);
  DUET_ASSERT(scratch.rate.size() == bodies.nodal_volumes.size());
  prepare(bodies, dt, settings, scratch);
  PressureSystem system(bodies, projection, scratch);
  const double tolerance = std::max(1.0, settings.reduction * system.norm(scratch.right_side));
  const CgResult result =
      conjugate_residual(system, scratch.right_side, tolerance, settings.iterations, scratch.pressure,
                         scratch.residual, scratch.direction, scratch.image, scratch.direction_image);
  system.change_velocities(scratch.pressure);
  std::swap(scratch.pressure, scratch.scaled);
  return result;
}

}  // namespace duet
