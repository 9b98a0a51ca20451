// The implicit velocity system over particles and rigid twists together:
//   A v = v - dt M^-1 F_d(v),
// and with implicit elasticity A v = v - dt M^-1 (F_d(v) + dt dF(v)). F_d are the damping forces, and dF(v)
// is the change of the elastic forces for displacements v.
#pragma once

#include <cmath>

#include "sim/contact/response/contact_projection.h"

namespace duet {

/// Block-Jacobi preconditioner of the particles: their masses plus dt times the diagonal block of their
/// damping. In the inner product of these masses the operator is nearer to the identity, so that conjugate
/// gradients in it are preconditioned. The projection works in the same inner product, so that it is
/// self-adjoint there even if its sweeps have not converged.
struct BlockJacobi {
  std::vector<SymmetricBlock> mass,  ///< For each particle: m + dt C, kg.
      inverse;                       ///< For each particle: inverse of `mass`, 1/kg; zero if it is held.
  ParticleMask known,                ///< Particles whose blocks have been assembled.
      wanted;                        ///< Scratch: particles whose blocks are being assembled.
};

/// The forces that a velocity solve treats implicitly.
enum class ImplicitForces {
  damping,                ///< Damping forces alone: semi-implicit steps.
  damping_and_elasticity  ///< Elastic forces, too.
};

/// Which blocks of the block-Jacobi preconditioner are assembled for the present deformation.
enum class AssembleBlocks {
  all,     ///< All that a solve needs.
  missing  ///< Only those that have not been assembled yet; the others stay as they are.
};

/// The operator A of the velocity solves. It is self-adjoint and positive definite in the mass inner product
///   <u, v> = sum m u.v + sum (M u_lin.v_lin + u_ang.I v_ang)
/// over particles and rigid bodies, with the block-Jacobi masses in place of m after use().
class VelocitySystem {
 public:
  /// Makes the operator for a solve of `dt` (s). A null `projection` means no constraints. Damping forces are
  /// those of the deformation at the last elastic evaluation, and dF that of the last linearization. The
  /// scratch vectors are resized and must outlive the system.
  VelocitySystem(Bodies& bodies, double dt, ImplicitForces forces, const ContactProjection* projection,
                 std::vector<Vec3>& force_scratch, std::vector<Mat3>& inertia_scratch);
  /// Asks for the damping forces of the solution, which are added to `force` (N) without another product:
  /// accumulate() sums them up from those of the vectors that make up the solution. Products in single
  /// precision go to `scratch`, and are added by finish(). Call it before the solve.
  void collect_forces(std::vector<Vec3>& force, std::vector<Vec3>& scratch) {
    collected_ = &force;
    collected_in_single_ = &scratch;
  }
  /// Adds the damping forces of products in single precision to those of collect_forces(), after removing the
  /// moment that rounding gives them on each body. Call it after the solve.
  void finish();

  /// Makes the system work in the inner product of `masses`, as the projection must, too. Assembles
  /// `blocks` of those that are needed. The right side, or a residual, must then go through
  /// apply_preconditioner().
  void use(BlockJacobi& masses, AssembleBlocks blocks);
  /// Marks all blocks of `masses` as missing.
  static void forget(BlockJacobi& masses) { masses.known.clear(); }
  /// Multiplies the particles of a right side or residual by (m + dt C)^-1 m, which takes it to the inner
  /// product of use(). Does nothing without use().
  void apply_preconditioner(GeneralizedVelocity& right_side) const;
  /// Limits all functions to the particles of searched `islands`, until the next call. Values of other
  /// particles are then undefined. Null removes the limit.
  void limit_to(const Islands* islands);

  /// Computes out = A v, after use() in the new inner product. Keeps the damping forces for accumulate().
  void apply(const GeneralizedVelocity& v, GeneralizedVelocity& out);
  /// Notes that the solution contains `share` times the vector of the last apply(): adds that much of its
  /// damping forces to those of collect_forces().
  void accumulate(double share);
  /// Tells by which `factor` the residual has to fall from here on, which decides whether products with
  /// search directions may take single precision.
  void expect_reduction(double factor);
  /// Projects `v` onto the constraints, and lets embedded particles follow their bodies. Does nothing without
  /// a projection.
  void project(GeneralizedVelocity& v) const;
  /// Returns the inner product <u, v>, kg m^2/s^2.
  double inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) const;
  /// Inner product of a vector with itself, and its norm.
  struct Measure {
    double inner = 0;  ///< <v, v>, kg m^2/s^2.
    double norm = 0;   ///< Largest velocity of a particle or rigid body, m/s; of a part of a sum: its square.
    /// Adds the inner product and takes the larger norm. A NaN stays, and ends the solve.
    Measure& add(const Measure& other) {
      inner += other.inner;
      if (!(other.norm <= norm || std::isnan(norm))) norm = other.norm;
      return *this;
    }
  };
  /// Returns inner product and norm of `v`. The norm is that of particle_measure() and rigid_measure().
  Measure measure(const GeneralizedVelocity& v) const;
  /// Returns the norm of `v`, m/s.
  double norm(const GeneralizedVelocity& v) const { return measure(v).norm; }

  /// Returns the part of particle `p` in the inner product of its velocities `u` and `v`.
  double particle_inner(std::size_t p, const Vec3& u, const Vec3& v) const {
    return masses_ ? u.dot(masses_->mass[p] * v) : bodies_.particles.mass[p] * u.dot(v);
  }
  /// Returns the part of rigid body `i` in the inner product.
  double rigid_inner(std::size_t i, const GeneralizedVelocity& u, const GeneralizedVelocity& v) const {
    return bodies_.rigid.properties[i].mass * u.linear[i].dot(v.linear[i]) +
           u.angular[i].dot(inertia_[i] * v.angular[i]);
  }
  /// Returns the part of particle `p` in measure(), with the square of its norm. After use() the norm is that
  /// of the momentum over the mass m of the particle: the force that is left, times dt/m.
  Measure particle_measure(std::size_t p, const GeneralizedVelocity& v) const {
    const Vec3& here = v.particle[p];
    const Vec3 momentum = masses_ ? Vec3(masses_->mass[p] * here) : Vec3(bodies_.particles.mass[p] * here);
    const double inverse = masses_ ? bodies_.particles.inverse_mass[p] : 0;
    return {here.dot(momentum), (inverse > 0 ? Vec3(inverse * momentum) : here).squaredNorm()};
  }
  /// Returns the part of rigid body `i` in measure(), with the square of its norm: v^2 + w.I w / M, or 0 for
  /// static and kinematic bodies.
  Measure rigid_measure(std::size_t i, const GeneralizedVelocity& v) const {
    const RigidProperties& properties = bodies_.rigid.properties[i];
    const double turning = v.angular[i].dot(inertia_[i] * v.angular[i]), squared = v.linear[i].squaredNorm();
    return {properties.mass * squared + turning,
            properties.is_dynamic() ? squared + turning / properties.mass : 0};
  }
  /// Returns the number of rigid bodies.
  std::size_t rigid_count() const { return inertia_.size(); }
  /// Returns the damping forces of the last product, N.
  std::vector<Vec3>& forces() { return force_; }
  /// Returns where the damping forces of products are summed up now, N; null without collect_forces().
  std::vector<Vec3>* collected() { return in_single_ ? collected_in_single_ : collected_; }

  /// Sets out = a - b, and resizes it.
  static void subtract(const GeneralizedVelocity& a, const GeneralizedVelocity& b, GeneralizedVelocity& out);
  /// Sets to = from, and resizes it.
  static void copy(const GeneralizedVelocity& from, GeneralizedVelocity& to);
  /// Adds alpha x to y.
  static void axpy(double alpha, const GeneralizedVelocity& x, GeneralizedVelocity& y);
  /// Sets y = x + beta y.
  static void xpay(const GeneralizedVelocity& x, double beta, GeneralizedVelocity& y);

 private:
  // Calls work(begin, end) in parallel for ranges of the first `particles` particles, within the limit of
  // limit_to().
  template <class Work>
  void for_each_range(std::size_t particles, Work&& work) const;

  Bodies& bodies_;
  double dt_;
  bool implicit_elasticity_;
  bool in_single_ = false;  // true if products take single precision
  const ContactProjection* projection_;
  const Islands* islands_ = nullptr;
  std::vector<Vec3>& force_;
  std::vector<Vec3>*collected_ = nullptr, *collected_in_single_ = nullptr;
  const BlockJacobi* masses_ = nullptr;
  std::vector<Mat3>& inertia_;  // kg m^2, for each rigid body, world axes
};

}  // namespace duet
