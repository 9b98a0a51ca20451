// Interpenetration resolution at one geometry: equations 1 and 2 of the paper's section 6.1 for all central
// bodies.
#pragma once

#include <vector>

#include "sim/base/dense_solvers.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

/// The system for displacements that part overlapping bodies. A central body, which is a rigid body or a
/// point of a deformable one, exchanges impulses with all bodies that overlap it at once, so that all of its
/// overlaps open. This is the projection of the displacements, in the mass inner product, onto those that
/// open its overlaps. Sweeps to and fro over the central bodies are therefore self-adjoint, and conjugate
/// gradients find their limit (Bjorck, Elfving 1979): sweeps alone would need thousands if a row of light
/// bodies has to part two heavy ones. All impulses are equal and opposite at one place, so that every iterate
/// keeps the center of mass and the moment.
class PushOutSystem {
 public:
  /// Starts a system without overlaps. Static and kinematic bodies, held particles and the bodies that `held`
  /// marks (an entry for every body, numbered as by guest_node(), or empty) do not move.
  void begin(const Bodies& bodies, const std::vector<char>& held);
  /// Adds an overlap: the guest is to be displaced by `apart` (m, world) relative to the host, with the arms
  /// and the normal that the contact holds. `guest` is the number of the guest as by guest_node(). Does
  /// nothing if neither side can move.
  void add(const ContactPoint& contact, std::size_t guest, const Vec3& apart);
  /// Chooses the central bodies and factors their systems, equation 2. `rank` has an entry for every rigid
  /// body: central bodies are visited by ascending rank, and -1 excludes a body. Points of deformable
  /// bodies are central, too.
  void factor(const std::vector<int>& rank);

  /// Finds the displacements, until the error along every normal is at most `tolerance` (m), or for at most
  /// about `sweeps` sweeps. Returns the number of sweeps.
  int solve(double tolerance, int sweeps);
  /// Moves the bodies by the displacements, keeping velocities and angular momenta, and marks moved rigid
  /// bodies in `moved`.
  void apply(Bodies& bodies, std::vector<char>& moved) const;

 private:
  // Displacements by slots: of all particles (m), then shift (m) and turn (rad) of every rigid body.
  using Vector = std::vector<Vec3>;

  // One overlap.
  struct Row {
    int host = -1, guest = -1;            // slots of rigid bodies; -1: it cannot move, or is no rigid body
    int point = -1;                       // number of the point of a deformable guest; -1: none
    std::array<int, 4> particle{};        // slots of the particles of the point
    std::array<double, 4> weight{};       // weights of the particles in the point; 0: none
    std::array<double, 4> per_impulse{};  // 1/kg, displacement of a particle per impulse on the point
    double inverse_mass = 0;              // 1/kg, of the point
    Vec3 host_arm, guest_arm;             // m
    Vec3 normal;                          // unit, of the contact
    Vec3 apart;                           // m, wanted displacement of the guest relative to the host
    Mat3 host_mass, guest_mass;           // kg, K_o^-1 of each side as the outer body
  };
  // One overlap as a central body sees it.
  struct Outer {
    int kind = 0,           // 0: a point is central; 1: a rigid body is
        rank = 0;           // order of the central body in a sweep, within its kind
    int row = 0;            // index into rows_
    bool reversed = false;  // true if the guest is central
  };
  // One central body.
  struct Block {
    int begin = 0, end = 0;     // range in outers_
    SymmetricFactor<6> system;  // factor of the matrix of equation 2
  };

  // Returns the slot of a rigid body, and makes one if needed; -1: the body cannot move.
  int body_slot(int body);
  // Returns the slot of a particle, and makes one if needed.
  int particle_slot(int particle);
  bool is_held(std::size_t node) const { return !held_.empty() && held_[node] != 0; }
  // Returns K^-1 of a rigid body at `arm`, kg.
  Mat3 effective_mass(int slot, const Vec3& arm) const;
  void factor(Block& block) const;
  // Returns the arm of the central body, m.
  const Vec3& central_arm(const Outer& outer) const;
  Vec3 displacement(const Row& row, const Vector& u) const;
  // Adds the displacement of a rigid body by a pseudo-impulse (kg m) at `arm`.
  void move_body(int slot, const Vec3& arm, const Vec3& impulse, Vector& u) const;
  // Adds the displacement of a point's particles by a pseudo-impulse (kg m).
  void move_point(const Row& row, const Vec3& impulse, Vector& u) const;
  // Visits a central body: projects `u` onto the displacements with `share` times the wanted ones at its
  // overlaps.
  void project(const Block& block, double share, Vector& u);
  void sweep_forth(double share, Vector& u);
  void sweep_back(double share, Vector& u);
  // Returns the mass inner product.
  double inner(const Vector& a, const Vector& b) const;
  // Returns the largest error of a displacement along its normal, m.
  double max_error(const Vector& u) const;

  const Bodies* bodies_ = nullptr;
  std::vector<char> held_;                            // for each body: whether it is held; empty: none
  std::vector<int> slot_of_body_, slot_of_particle_;  // -1: none
  std::vector<int> body_, particle_;                  // for each slot: the body, the particle
  std::vector<Mat3> inertia_;                         // for each body slot: kg m^2, world axes
  std::vector<Row> rows_;
  std::vector<Outer> outers_;
  std::vector<Block> blocks_;
  std::vector<Vec3> missing_;  // m, for each outer of the block that is visited: what its displacement lacks
  Vector u_,                   // the displacements
      residual_, direction_, image_;
};

}  // namespace duet
