// Linear triangular finite elements in space, which resist the stretching of thin shells by the St.
// Venant-Kirchhoff law in plane stress.
//
//     psi = h (mu E : E + lambda/2 (tr E)^2)   J/m^2,   E = (F^T F - 1) / 2
//     S = 2 mu E + lambda tr(E) 1,   P = h F S,   mu = Y / (2 (1 + nu)),   lambda = Y nu / (1 - nu^2)
//
// F (3 x 2) maps the plane of the rest triangle to space, E is the Green strain, h the thickness, Y Young's
// modulus and nu the Poisson ratio. A triangle can be folded into the mirror image of its own plane without a
// barrier, as cloth can.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/forces/particle_blocks.h"
#include "sim/deformable/scatter_add.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// Elastic and viscous moduli of a shell in plane stress.
struct MembraneModuli {
  double mu = 0,       ///< N/m, shear modulus times the thickness
      lambda = 0;      ///< N/m, first Lamé parameter of plane stress times the thickness
  double damping = 0;  ///< s, damping time: ratio of viscous to elastic moduli
};
/// Returns the moduli for a Young's modulus (Pa), a Poisson ratio, a thickness (m) and a damping time (s).
MembraneModuli membrane_moduli(double youngs_modulus, double poisson_ratio, double thickness, double damping);

/// Stretching forces of the triangles of all shells, and bounds on their frequencies.
class Membranes {
 public:
  /// Adds the triangles of a body (global particle indices) at their rest positions (m).
  void add(const std::vector<Triangle>& triangles, const std::vector<Vec3>& rest,
           const MembraneModuli& moduli);
  /// Lays out the batches. Must be called once after the last add().
  void finalize(std::size_t particle_count);

  /// Returns the number of triangles.
  std::size_t size() const { return triangles_.size(); }
  /// Restricts the sums below to the particles of `mask` until the next call; null removes the restriction
  /// (ScatterAdd::limit_to()).
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  /// Adds the elastic forces at the positions `x` (m) to `force` (N) and keeps deformation and tension for
  /// damping and differentials.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force);
  /// Adds the viscous forces for the velocities `v` (m/s) in the state of the last add_elastic_forces() to
  /// `force` (N): linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds the change of the viscous forces between the state of the last add_elastic_forces() and `seconds`
  /// later, for particles that keep the velocities `v` (m/s), to `force` (N).
  ///
  /// See FiniteElements::add_turn_forces().
  void add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force);
  /// Adds the change of the elastic forces for displacements `dx` (m) from the state of the last
  /// add_elastic_forces() to `force` (N).
  ///
  /// The lateral push of compressed triangles, which would destabilize an implicit solve, is left out: linear
  /// in dx, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  /// Appends the blocks of the matrix of these forces in the state of the last add_elastic_forces().
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Returns the elastic energy at the positions `x` (m), J.
  double energy(const std::vector<Vec3>& x) const;

  /// Adds to each particle's entry of `stiffness` (N/m) its part of the triangles' stiffness, see
  /// InternalForces::finalize().
  void add_stiffness(std::vector<double>& stiffness) const;
  /// Returns the highest omega^2 bound of a triangle at rest, rad^2/s^2, given the rates C_i / m_i of the
  /// particles (InternalForces::finalize()).
  double max_omega_squared(const std::vector<double>& squared_rate) const;
  /// Returns a bound on the stiffness of a triangle over that at rest, in the state of the last
  /// add_elastic_forces().
  ///
  /// It is at least 1, so that compressed triangles count as at rest, and 1 before the first call.
  double stiffening() const { return stiffening_; }

 private:
  // A triangle at rest.
  struct RestTriangle {
    std::array<double, 3> gradient;  // 1/m, norms of the gradients of the barycentric coordinates
    Eigen::Matrix2d inverse;         // D_m^-1, 1/m
    double area = 0;                 // m^2
    MembraneModuli moduli;
    // Returns the factor k (N m) in the bound k/2 (sum gradient |u|)^2 on the energy near rest.
    double stiffness() const;
    // Returns half of the sum of `gradient`, 1/m.
    double half_of_gradients() const;
  };
  // Symmetric 2x2 matrix in eight lanes.
  struct Symmetric2 {
    double8 xx, yy, xy;
  };
  // 3x2 matrix in eight lanes, by its columns.
  struct Columns {
    vector8 x, y;
  };
  // Eight triangles.
  struct Batch {
    std::array<PackIndex, 3> particle;
    std::array<ScatterAdd::Slot, 3> slot;
    double8 inverse[2][2];        // 1/m, D_m^-1
    double8 area;                 // m^2; zero in the lanes that pad the last batch
    double8 mu, lambda, damping;  // N/m; N/m; s
    Columns F;                    // of the last add_elastic_forces()
    Symmetric2 tension;           // N/m, the positive part of h S then
  };
  // Returns F for positions and its rate for velocities.
  static Columns gradient(const Batch& batch, const std::vector<Vec3>& values);
  // Returns h S for a Green strain (N/m), or for a rate of it.
  static Symmetric2 stress(const Batch& batch, const Symmetric2& strain);
  // Returns the rate of the Green strain, sym(F^T Fdot).
  static Symmetric2 strain_rate(const Columns& F, const Columns& rate);
  // Returns F S.
  static Columns times(const Columns& F, const Symmetric2& S);
  // Returns the damping stress and the differential of the elastic stress for the rate `rate` of F, weighted
  // with the factors, N s/m.
  static Columns system_stress(const Batch& batch, const BlockFactors& factors, const Columns& rate);
  template <class Stress>
  void add_forces(std::vector<Vec3>& totals, Stress&& stress_of);

  std::vector<Triangle> triangles_;
  std::vector<RestTriangle> rest_;
  std::vector<Batch> batches_;
  std::vector<double> batch_stiffening_;
  ScatterAdd sums_;
  double stiffening_ = 1;
};

}  // namespace duet
