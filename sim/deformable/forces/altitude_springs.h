// Altitude springs, which keep the tetrahedra of a mass-spring body from collapsing (Molino, Bridson, Teran,
// Fedkiw 2003; Selle, Lentine, Fedkiw 2008). A tetrahedron has seven altitudes: from each vertex to the
// opposite face, and between opposite edges. The shortest one carries a spring. Altitudes are signed: that of
// an inverted tetrahedron is negative, so its spring turns it right side out again.
//
//     psi = k/2 (h - H)^2,  h = n . sum w_i x_i,  n the unit normal of the face or of the two edges
//
// h is the altitude and H its length at rest, the w_i are the weights of its two ends, and k = modulus / H.
// The forces are the gradient of this energy: as sum w_i x_i = h n, they need no derivative of the weights.
#pragma once

#include <array>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/deformable/forces/dashpots.h"
#include "sim/deformable/forces/particle_blocks.h"
#include "sim/deformable/forces/turn.h"
#include "sim/deformable/materials/symmetric_block.h"
#include "sim/deformable/scatter_add.h"
#include "sim/geometry/mesh/tet_mesh.h"

namespace duet {

/// The altitude springs of all mass-spring bodies, one for each tetrahedron.
class AltitudeSprings {
 public:
  /// Adds the springs of a body's tetrahedra (global particle indices) at their rest positions.
  ///
  /// `modulus` (N) is the force of a spring at 100 % strain; `damping` is the fraction of critical damping.
  void add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest, double modulus, double damping);
  /// Lays out the batches. Must be called once after the last add(), with the particles' inverse masses
  /// (1/kg), which determine the critical damping.
  void finalize(const std::vector<double>& inverse_mass);

  /// Returns the number of tetrahedra.
  std::size_t size() const { return tets_.size(); }
  /// Restricts the sums below to the particles of `mask` until the next call; null removes the restriction
  /// (ScatterAdd::limit_to()).
  void limit_to(const ParticleMask* mask) { sums_.limit_to(mask); }

  /// Gives every tetrahedron the spring of its shortest altitude at `x` (m): the one that is perpendicular to
  /// its largest face or pair of edges.
  ///
  /// Until the next call the elastic forces are the gradient of an energy.
  void choose(const std::vector<Vec3>& x);
  /// Adds the elastic forces at the positions `x` (m) to `force` (N) and keeps the directions and weights for
  /// damping and differentials.
  ///
  /// Unless `geometric_stiffness` is empty, adds to each particle's entry its part (see
  /// InternalForces::finalize()) of the geometric stiffness k |h - H| / max(|h|, H) (N/m) of altitudes that
  /// are longer or shorter than at rest, as Springs::add_elastic_forces() does.
  void add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force,
                          std::vector<double>& geometric_stiffness, const Turn* turn = nullptr);
  /// Adds the viscous forces for the velocities `v` (m/s) to `force` (N), in the directions of the last
  /// add_elastic_forces(): linear in v, symmetric and negative semi-definite.
  void add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force);
  /// Adds the change of the viscous forces between the state of the last add_elastic_forces() and `seconds`
  /// later, for particles that keep the velocities `v` (m/s), to `force` (N); see Springs::add_turn_forces().
  void add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force);
  /// Adds the turn forces that the last add_elastic_forces() has computed (Turn) to `force` (N).
  void add_kept_turn_forces(std::vector<Vec3>& force) const { sums_.add_kept_to(force); }
  /// Adds the viscous forces like add_damping_forces(), in single precision.
  void add_damping_forces_single(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
    add_dashpot_forces(dashpots_, sums_, v, force);
  }
  /// Adds each particle's own 3x3 block of minus the operator of add_damping_forces() to `blocks`, kg/s.
  void add_damping_blocks(std::vector<SymmetricBlock>& blocks);
  /// Adds the change of the elastic forces for displacements `dx` (m) along the directions of the last
  /// add_elastic_forces() to `force` (N).
  ///
  /// The geometric stiffness, which would destabilize an implicit solve, is left out: linear in dx, symmetric
  /// and negative semi-definite.
  void add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force);
  /// Appends the blocks of the matrix of these forces in the state of the last add_elastic_forces().
  void append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const;
  /// Returns the elastic energy at the positions `x` (m) with the springs that choose(x) would choose, J.
  double energy(const std::vector<Vec3>& x) const;

  /// Adds to each particle's entry of `stiffness` (N/m) its part of the springs' stiffness, see
  /// InternalForces::finalize().
  ///
  /// The weights of each end of an altitude add up to 1.
  void add_stiffness(std::vector<double>& stiffness) const;
  /// Returns the highest omega^2 bound of a spring, rad^2/s^2, given the rates C_i / m_i of the particles
  /// (InternalForces::finalize()).
  double max_omega_squared(const std::vector<double>& squared_rate) const;
  /// Finds which springs have enough viscosity for steps of `relaxation` times their damping time (viscosity
  /// over stiffness, s).
  ///
  /// Returns the highest omega^2 bound (rad^2/s^2) that such steps stand for, over the springs that it
  /// lowers; 0 without any. Adds the stiffness of the other springs (undamped stiffness, N/m) to
  /// `undamped_stiffness`.
  double rely_on_damping(double relaxation, const std::vector<double>& squared_rate,
                         std::vector<double>& undamped_stiffness) const;

 private:
  // Altitudes of a tetrahedron: from the vertices 0 to 3, then between each edge at vertex 0 and its opposite
  // edge.
  static constexpr std::size_t altitudes = 7;

  // Adds the stiffness of tetrahedron t to the entries of its particles.
  void add_stiffness_of(std::size_t t, std::vector<double>& stiffness) const;
  // Returns the omega^2 bound of tetrahedron t, rad^2/s^2.
  double omega_squared(std::size_t t, const std::vector<double>& squared_rate) const;

  // A tetrahedron at rest.
  struct RestTet {
    std::array<double, altitudes> length;  // m, of each altitude
    double modulus, damping;               // N; fraction of critical damping
  };
  // Eight tetrahedra, as add() has given them.
  struct Batch {
    std::array<PackIndex, 4> particle;
    std::array<ScatterAdd::Slot, 4> slot;
    std::array<double8, altitudes> rest_length, viscosity;  // m; N s/m
    double8 modulus;  // N; zero, as is the viscosity, in the lanes that pad the last batch
  };
  // The springs of a batch that choose() has selected, with the corners in the order in which altitude()
  // takes them.
  struct Chosen {
    double8 altitude = double8{} - 1.0;  // number of the chosen altitude; -1 before the first choice
    std::array<ScatterAdd::Slot, 4> slot;
    // True for an altitude between two edges, false for one from the first corner to the face of the others.
    mask8 between_edges;
    double8 rest_length, stiffness, viscosity;  // m; N/m; N s/m
    std::array<double8, 4> weight;              // of the last add_elastic_forces(), as the next two
    double8 length;                             // m
    vector8 normal;
  };
  // Signed length (m), unit direction and weights of altitudes at some positions.
  struct Altitude {
    std::array<double8, 4> weight;
    vector8 normal;
    double8 length;
  };
  // Selects the springs of a batch at the given corners. Returns the square of the largest base (twice the
  // area of a face, or the cross product of two edges): six volumes over the base are the altitude.
  static double8 choose(const Batch& batch, const std::array<vector8, 4>& corner, Chosen& chosen);
  // Computes the altitudes of `chosen` at the positions `rows`.
  static Altitude altitude(const Chosen& chosen, const double4* rows);
  // Returns sum w_i of the values at the corners, with the weights of the last add_elastic_forces().
  static vector8 difference(const Chosen& chosen, const double4* rows);
  // Returns the work of a batch, for sums_, that adds the forces along the normals which force_of(chosen,
  // rows of values) returns.
  template <class Force>
  auto forces_along(Force force_of) const;
  // Returns the force of add_turn_forces() along the normal.
  static auto turn_force(double seconds);
  template <class Force>
  void add_forces(const std::vector<Vec3>& values, std::vector<Vec3>& totals, Force&& force_of);

  std::vector<Tet> tets_;
  std::vector<RestTet> rest_;
  std::vector<Batch> batches_;
  std::vector<Chosen> chosen_;         // by batch
  std::vector<Dashpots<4>> dashpots_;  // by batch
  ScatterAdd sums_;
};

}  // namespace duet
