// The implicit velocity system over particles and rigid twists together: A v = v - dt M^-1 F_damping(v), and
// with implicit elasticity A v = v - dt M^-1 (F_damping(v) + dt dF(v)), where dF(v) is the change of the
// elastic forces for displacements v.
#pragma once

#include "sim/coupling/contact_projection.h"

namespace duet {

// Masses of particles that have their own block of what damps them in them: in this inner product the
// operator is nearer to one, and conjugate gradients are preconditioned by those blocks. The projection works
// in it, too, so that it is self-adjoint there even where it is sweeps that have not converged.
struct DampedMasses {
  std::vector<SymmetricBlock> mass, inverse;  // kg, 1/kg; zero for particles that have no mass of their own
};

// Self-adjoint and positive definite in the mass inner product <u, v> = sum m u.v + sum (M u_lin.v_lin +
// u_ang.I v_ang).
class VelocitySystem {
 public:
  // `projection` may be null: no constraints. Damping forces are those of the last elastic evaluation's
  // deformation, dF those of the last linearization.
  VelocitySystem(Bodies& bodies, double dt, bool implicit_elasticity, const ContactProjection* projection,
                 std::vector<Vec3>& force_scratch, std::vector<Mat3>& inertia_scratch);
  // Before conjugate gradients: the damping forces of the solution shall be added to `force` (N), without
  // another product, from all vectors that it is made up of; as far as these took single precision they come
  // by way of `scratch`, and with finish().
  void collect_forces(std::vector<Vec3>& force, std::vector<Vec3>& scratch) {
    collected_ = &force;
    collected_in_single_ = &scratch;
  }
  void finish();

  // Works in the inner product of `masses`, as the projection must from here on, too: those of the last
  // elastic evaluation's deformation if `anew`, else as they were left. To be followed by weigh() of the
  // right side.
  void use(DampedMasses& masses, bool anew);
  void weigh(GeneralizedVelocity& right_side) const;

  void apply(const GeneralizedVelocity& v, GeneralizedVelocity& out);
  void accumulate(double share);
  // Says whether products may take single precision from here on.
  void expect_reduction(double factor);
  void project(GeneralizedVelocity& v) const;
  double inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) const;
  struct Measure {
    double inner = 0;  // of v with itself
    double norm = 0;   // m/s: the largest particle's, or body's, inertia-weighted velocity
  };
  Measure measure(const GeneralizedVelocity& v) const;
  double norm(const GeneralizedVelocity& v) const { return measure(v).norm; }

  static void subtract(const GeneralizedVelocity& a, const GeneralizedVelocity& b,
                       GeneralizedVelocity& out);  // a - b
  static void copy(const GeneralizedVelocity& from, GeneralizedVelocity& to) { to = from; }
  static void axpy(double alpha, const GeneralizedVelocity& x, GeneralizedVelocity& y);  // y += alpha x
  static void xpay(const GeneralizedVelocity& x, double beta, GeneralizedVelocity& y);   // y = x + beta y

 private:
  Bodies& bodies_;
  double dt_;
  bool implicit_elasticity_;
  bool in_single_ = false;  // precision
  const ContactProjection* projection_;
  std::vector<Vec3>& force_;
  std::vector<Vec3>*collected_ = nullptr, *collected_in_single_ = nullptr;
  const DampedMasses* masses_ = nullptr;
  std::vector<Mat3>& inertia_;  // world axes
};

// Copies the velocities of all bodies (static ones: zero).
void to_generalized(const Bodies& bodies, GeneralizedVelocity& out);

}  // namespace duet
