// Linear triangular finite elements in space: the stretching of thin shells, by the St. Venant-Kirchhoff law
// in plane stress. With F (3 x 2) from the plane of the rest triangle and the Green strain E = (F^T F - 1) /
// 2
//
//   psi = h (mu E : E + lambda/2 (tr E)^2),  S = 2 mu E + lambda tr E 1,  P = h F S,  lambda = E nu / (1 -
//   nu^2)
//
// for the thickness h. A triangle can fold into its own plane's mirror image without a barrier, as cloth
// does.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/block_sums.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

struct MembraneModuli {
  double mu = 0, lambda = 0;  // N/m: of plane stress, times the thickness
  double damping = 0;         // s, viscous over elastic moduli
};
MembraneModuli membrane_moduli(double youngs_modulus, double poisson_ratio, double thickness, double damping);

class Membranes {
 public:
  // Adds the triangles of a body (global particle indices) at their rest positions.
  void add(const std::vector<Triangle>& triangles, const std::vector<Vec3>& rest,
           const MembraneModuli& moduli);
  // To be called once after the last add(): lays out the batches.
  void finalize(std::size_t particle_count);

  std::size_t size() const { return triangles_.size(); }
  // See BlockSums.
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  // As of FiniteElements.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force);
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  // Adds the change of the elastic forces with a displacement `dx` (m), without what compressed triangles
  // push to the side: linear, symmetric and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  double energy(const std::vector<Vec3>& x) const;  // J

  // See InternalForces::finalize.
  void add_stiffness(std::vector<double>& stiffness) const;
  double max_squared_frequency(const std::vector<double>& squared_rate) const;
  // The largest stiffness of a triangle over that at rest, in the state of the last add_elastic_forces.
  double stiffening() const { return stiffening_; }

 private:
  struct RestTriangle {
    std::array<double, 3> gradient;  // 1/m, norms of the barycentric coordinates' gradients
    Eigen::Matrix2d inverse;         // D_m^-1, 1/m
    double area = 0;                 // m^2
    MembraneModuli moduli;
    double stiffness() const;          // N/m times m^2
    double half_of_gradients() const;  // 1/m
  };
  struct Symmetric2 {
    Pack xx, yy, xy;
  };
  struct Columns {
    PackVector x, y;
  };
  struct Batch {
    std::array<PackIndex, 3> particle;
    std::array<BlockSums::Slot, 3> slot;
    Pack inverse[2][2];
    Pack area;  // m^2; zero in the lanes that pad the last batch
    Pack mu, lambda, damping;
    Columns F;           // of the last add_elastic_forces
    Symmetric2 tension;  // the positive part of S then, N/m
  };
  static Columns gradient(const Batch& batch, const std::vector<Vec3>& values);
  static Symmetric2 stress(const Batch& batch, const Symmetric2& strain);
  static Symmetric2 strain_rate(const Columns& F, const Columns& rate);
  static Columns times(const Columns& F, const Symmetric2& S);
  template <class Stress>
  void add_forces(std::vector<Vec3>& totals, Stress&& stress_of);

  std::vector<Triangle> triangles_;
  std::vector<RestTriangle> rest_;
  std::vector<Batch> batches_;
  std::vector<double> batch_stiffening_;
  BlockSums sums_;
  double stiffening_ = 1;
};

}  // namespace duet
