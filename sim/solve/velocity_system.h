// The implicit velocity system over particles and rigid twists together: A v = v - dt M^-1 F_damping(v), and
// with implicit elasticity A v = v - dt M^-1 (F_damping(v) + dt dF(v)), where dF(v) is the change of the
// elastic forces for displacements v.
#pragma once

#include <cmath>

#include "sim/contact/response/contact_projection.h"

namespace duet {

// Masses of particles that have their own block of what damps them in them: in this inner product the
// operator is nearer to one, and conjugate gradients are preconditioned by those blocks. The projection works
// in it, too, so that it is self-adjoint there even where it is sweeps that have not converged.
struct DampedMasses {
  std::vector<SymmetricBlock> mass, inverse;  // kg, 1/kg; zero for particles that have no mass of their own
  ParticleMask known, wanted;                 // the particles whose blocks have been found; scratch
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
  // elastic evaluation's deformation if `anew`, else as they were left as far as they were found then. To be
  // followed by weigh() of the right side, or of a residual.
  void use(DampedMasses& masses, bool anew);
  static void forget(DampedMasses& masses) { masses.known.clear(); }
  void weigh(GeneralizedVelocity& right_side) const;
  // Works on the particles of islands that are searched, from here on until null: what functions make of all
  // others is of no use. use() finds what blocks it needs.
  void limit_to(const Islands* islands);

  void apply(const GeneralizedVelocity& v, GeneralizedVelocity& out);
  void accumulate(double share);
  // Says whether products may take single precision from here on.
  void expect_reduction(double factor);
  void project(GeneralizedVelocity& v) const;
  double inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) const;
  struct Measure {
    double inner = 0;  // of v with itself
    double norm = 0;   // m/s: the largest particle's, or body's, inertia-weighted velocity
    Measure& add(const Measure& other) {
      inner += other.inner;
      if (!(other.norm <= norm || std::isnan(norm))) norm = other.norm;  // a NaN stays, and ends the solve
      return *this;
    }
  };
  Measure measure(const GeneralizedVelocity& v) const;
  double norm(const GeneralizedVelocity& v) const { return measure(v).norm; }

  // What these sum up, of one particle and of one rigid body; their norms are squares.
  double particle_inner(std::size_t p, const Vec3& u, const Vec3& v) const {
    return masses_ ? u.dot(masses_->mass[p] * v) : bodies_.particles.mass[p] * u.dot(v);
  }
  double rigid_inner(std::size_t i, const GeneralizedVelocity& u, const GeneralizedVelocity& v) const {
    return bodies_.rigid.properties[i].mass * u.linear[i].dot(v.linear[i]) +
           u.angular[i].dot(inertia_[i] * v.angular[i]);
  }
  Measure particle_measure(std::size_t p, const GeneralizedVelocity& v) const {
    const Vec3& here = v.particle[p];
    const Vec3 momentum = masses_ ? Vec3(masses_->mass[p] * here) : Vec3(bodies_.particles.mass[p] * here);
    // With damped masses, what is left of the forces over the particle's own mass.
    const double inverse = masses_ ? bodies_.particles.inverse_mass[p] : 0;
    return {here.dot(momentum), (inverse > 0 ? Vec3(inverse * momentum) : here).squaredNorm()};
  }
  Measure rigid_measure(std::size_t i, const GeneralizedVelocity& v) const {
    const RigidProperties& properties = bodies_.rigid.properties[i];
    const double turning = v.angular[i].dot(inertia_[i] * v.angular[i]), squared = v.linear[i].squaredNorm();
    return {properties.mass * squared + turning,
            properties.is_dynamic() ? squared + turning / properties.mass : 0};
  }
  std::size_t rigid_count() const { return inertia_.size(); }
  // The damping forces of the last product, and where their sum is collected; null if it is not.
  std::vector<Vec3>& forces() { return force_; }
  std::vector<Vec3>* collected() { return in_single_ ? collected_in_single_ : collected_; }

  static void subtract(const GeneralizedVelocity& a, const GeneralizedVelocity& b,
                       GeneralizedVelocity& out);  // a - b
  static void copy(const GeneralizedVelocity& from, GeneralizedVelocity& to);
  static void axpy(double alpha, const GeneralizedVelocity& x, GeneralizedVelocity& y);  // y += alpha x
  static void xpay(const GeneralizedVelocity& x, double beta, GeneralizedVelocity& y);   // y = x + beta y

 private:
  // Calls work(begin, end) in parallel for all of `particles` that are worked on.
  template <class Work>
  void for_each_range(std::size_t particles, Work&& work) const;

  Bodies& bodies_;
  double dt_;
  bool implicit_elasticity_;
  bool in_single_ = false;  // precision
  const ContactProjection* projection_;
  const Islands* islands_ = nullptr;
  std::vector<Vec3>& force_;
  std::vector<Vec3>*collected_ = nullptr, *collected_in_single_ = nullptr;
  const DampedMasses* masses_ = nullptr;
  std::vector<Mat3>& inertia_;  // world axes
};

// Copies the velocities of all bodies (static ones: zero).
void to_generalized(const Bodies& bodies, GeneralizedVelocity& out);

}  // namespace duet
