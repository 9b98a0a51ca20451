// Projected conjugate gradients for systems that are self-adjoint and positive definite in an inner product
// of their own.
#pragma once

#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/stop.h"

namespace duet {

/// Outcome of an iterative solve.
struct CgResult {
  int iterations = 0;      ///< Number of iterations.
  double residual = 0;     ///< Norm of the last residual, in the unit and norm of the system.
  bool converged = false;  ///< True if `residual` is within the tolerance.
};

/// Solves P A P x = P b by conjugate gradients, starting from `x`, which must satisfy the constraints that P
/// projects onto. `System` has
///   apply(v, out)   out = A v           project(v)      v = P v
///   inner(u, v)     the inner product   measure(v)      inner(v, v), and in `norm` what the tolerance bounds
///   accumulate(a)   notes that x contains a times the last vector that A was applied to
/// with subtract(), copy(), axpy() and xpay() as in VelocitySystem, and optionally
///   expect_reduction(factor)   tells by which factor the first residual has to fall.
/// All later products are with search directions, which need to be exact enough for that reduction only.
///
/// `r`, `s` and `q` are scratch of the size of `x`. Stops when the norm of the residual is at most
/// `tolerance`, after `max_iterations`, or when only rounding or values that are not finite are left; `x` is
/// the last iterate then.
///
/// Every residual is projected again, because rounding would otherwise leave the constrained space (Baraff,
/// Witkin 1998). The first one is projected four times: if P is sweeps that have not converged, what is left
/// of the constraint forces can exceed the residual of a good start, and would keep the search out of the
/// constrained space.
template <class System, class Vector>
CgResult conjugate_gradient(System& system, const Vector& b, double tolerance, int max_iterations, Vector& x,
                            Vector& r, Vector& s, Vector& q) {
  constexpr int first_projections = 4;
  DUET_ASSERT(tolerance >= 0 && max_iterations >= 0);
  CgResult result;
  system.apply(x, q);
  system.accumulate(1);
  system.subtract(b, q, r);
  for (int i = 0; i < first_projections; ++i) system.project(r);
  auto left = system.measure(r);
  system.copy(r, s);
  if constexpr (requires { system.expect_reduction(1.0); }) system.expect_reduction(left.norm / tolerance);
  for (;; ++result.iterations) {
    stop_if_asked();
    result.residual = left.norm;
    result.converged = result.residual <= tolerance;
    if (result.converged || result.iterations >= max_iterations || !std::isfinite(result.residual))
      return result;
    system.apply(s, q);
    system.project(q);
    const double curvature = system.inner(s, q);
    if (!(curvature > 0)) return result;  // only rounding is left
    const double alpha = left.inner / curvature;
    system.axpy(alpha, s, x);
    system.accumulate(alpha);
    system.axpy(-alpha, q, r);
    system.project(r);
    const auto next = system.measure(r);
    system.xpay(r, next.inner / left.inner, s);
    left = next;
  }
}

}  // namespace duet
