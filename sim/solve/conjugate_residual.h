// Conjugate residuals for symmetric positive semi-definite systems.
#pragma once

#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/stop.h"
#include "sim/solve/conjugate_gradient.h"

namespace duet {

/// Solves A x = b by conjugate residuals, starting from x = 0. Each iterate minimizes the residual over the
/// spaces in which conjugate gradients minimize the energy (Saad 2003, algorithm 6.20). The residual never
/// grows from one iteration to the next, even if A is singular and b outside of its range, so that the
/// iteration may stop anywhere. `System` has
///   apply(v, out)   out = A v           inner(u, v)     the inner product
///   norm(v)         what the tolerance bounds
/// with clear(), axpy() and xpay(). Stops when norm(residual) is at most `tolerance`, after `max_iterations`,
/// or when the rest of the residual is outside of the range of A. `r`, `s`, `Ar` and `As` are scratch.
template <class System, class Vector>
CgResult conjugate_residual(System& system, const Vector& b, double tolerance, int max_iterations, Vector& x,
                            Vector& r, Vector& s, Vector& Ar, Vector& As) {
  DUET_ASSERT(tolerance >= 0 && max_iterations >= 0);
  CgResult result;
  r = b;
  system.clear(x);
  double rho = 0;
  for (;; ++result.iterations) {
    stop_if_asked();
    result.residual = system.norm(r);
    result.converged = result.residual <= tolerance;
    if (result.converged || result.iterations >= max_iterations || !std::isfinite(result.residual))
      return result;
    system.apply(r, Ar);
    const double next = system.inner(r, Ar);
    if (!(next > 0)) return result;  // the rest of the residual is outside of the range of A
    if (result.iterations == 0) {
      s = r;
      As = Ar;
    } else {
      system.xpay(r, next / rho, s);
      system.xpay(Ar, next / rho, As);
    }
    rho = next;
    const double alpha = rho / system.inner(As, As);
    system.axpy(alpha, s, x);
    system.axpy(-alpha, As, r);
  }
}

}  // namespace duet
