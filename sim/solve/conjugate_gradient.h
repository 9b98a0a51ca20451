// Conjugate gradients for systems that are self-adjoint and positive definite in an inner product of their
// own.
#pragma once

#include <cmath>

#include "sim/base/stop.h"

namespace duet {

struct CgResult {
  int iterations = 0;
  double residual = 0;  // in the system's norm
  bool converged = false;
};

// Solves P A P x = P b starting from `x`, which must satisfy the constraints that P projects onto. System has
//   apply(v, out)   out = A v           project(v)      v = P v
//   inner(u, v)     the inner product   measure(v)      inner(v, v), and in `norm` what the tolerance bounds
//   accumulate(a)   takes note that x holds a times the last vector that A was applied to
// and, if it likes, expect_reduction(factor): is told by what the first residual is to fall. What follows are
// products with search directions, which need to be just exact enough for that.
// `r`, `s`, `q` are scratch of x's size. Every residual is projected again, as rounding would otherwise leave
// the constrained space (Baraff, Witkin 1998). The first one is projected several times: where P is sweeps
// that have not converged, what is left of the forces that the constraints bear may be more than all the rest
// of a good start's residual, and keeps the search out of the space it should stay in.
template <class System, class Vector>
CgResult conjugate_gradient(System& system, const Vector& b, double tolerance, int max_iterations, Vector& x,
                            Vector& r, Vector& s, Vector& q) {
  constexpr int first_projections = 4;
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
