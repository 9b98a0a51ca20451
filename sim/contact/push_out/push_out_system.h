// Equations 1 and 2 of the paper's section 6.1 for all central bodies at one geometry.
#pragma once

#include <vector>

#include "sim/base/dense_solvers.h"
#include "sim/contact/detection/contact_point.h"

namespace duet {

// Displacements that part overlapping bodies. A central body, rigid or a point of a deformable one, exchanges
// impulses with everything that overlaps it at once, so that all of its overlaps open. That is the projection
// of the displacements, in the mass inner product, onto those that open its overlaps. Sweeps over the central
// bodies, to and fro, are then self-adjoint, and conjugate gradients find what they converge to (Bjorck,
// Elfving 1979): sweeps alone would need thousands where a row of light bodies has to part two heavy ones.
// All impulses are equal and opposite at one place, so every iterate keeps the centre of mass and the moment.
class PushOutSystem {
 public:
  // Starts with no overlaps. Bodies of infinite mass and those that `held` (of every body as in guest_node,
  // or empty) marks stay where they are.
  void begin(const Bodies& bodies, const std::vector<char>& held);
  // Wants the guest to be displaced by `apart` (m) relative to the host, at the geometry that the contact
  // holds. `guest` is the guest's number as in guest_node.
  void add(const ContactPoint& contact, std::size_t guest, const Vec3& apart);
  // Makes the overlaps of the central bodies ready to be solved for: of those rigid bodies that have a rank,
  // the lowest first (-1: none), and if `points`, of points of deformable bodies.
  void factor(const std::vector<int>& rank, bool points);

  // Finds the displacements, to `tolerance` (m) at every overlap or at most about `sweeps` sweeps. Returns
  // how many it took.
  int solve(double tolerance, int sweeps);
  // Moves the bodies, keeping their momenta, and marks those in `moved`.
  void apply(Bodies& bodies, std::vector<char>& moved) const;

 private:
  using Vector = std::vector<Vec3>;  // particles, then shift and turn of every body; by slots

  struct Row {                            // one overlap
    int host = -1, guest = -1;            // slots of rigid bodies; -1: held, or no rigid body
    int point = -1;                       // of a deformable guest, a number of its own; else -1
    std::array<int, 4> particle{};        // slots
    std::array<double, 4> weight{};       // of the particles in the point; 0: none
    std::array<double, 4> per_impulse{};  // 1/kg, displacement of a particle per impulse on the point
    double inverse_mass = 0;              // 1/kg, of the point
    Vec3 host_arm, guest_arm;             // m
    Vec3 normal;                          // unit, of the contact
    Vec3 apart;                           // m
    Mat3 host_mass, guest_mass;           // kg, K_o^-1 of either side as the outer body
  };
  struct Outer {             // a row as a central body sees it
    int kind = 0, rank = 0;  // kind 0: a point is central, 1: a rigid body; order of the sweep
    int row = 0;
    bool reversed = false;  // the guest is central
  };
  struct Block {             // one central body
    int begin = 0, end = 0;  // range of outers
    SymmetricFactor<6> system;
  };

  int body_slot(int body);
  int particle_slot(int particle);
  bool is_held(std::size_t node) const { return !held_.empty() && held_[node] != 0; }
  Mat3 effective_mass(int slot, const Vec3& arm) const;
  void factor(Block& block) const;
  const Vec3& central_arm(const Outer& outer) const;
  Vec3 displacement(const Row& row, const Vector& u) const;
  void move_body(int slot, const Vec3& arm, const Vec3& impulse, Vector& u) const;
  void move_point(const Row& row, const Vec3& impulse, Vector& u) const;
  // One visit of a central body: with `share` 1 towards the wanted displacements, with 0 towards none.
  void project(const Block& block, double share, Vector& u);
  void sweep_forth(double share, Vector& u);
  void sweep_back(double share, Vector& u);
  double inner(const Vector& a, const Vector& b) const;
  double largest_error(const Vector& u) const;  // m

  const Bodies* bodies_ = nullptr;
  std::vector<char> held_;
  std::vector<int> slot_of_body_, slot_of_particle_;  // -1: none
  std::vector<int> body_, particle_;                  // of every slot
  std::vector<Mat3> inertia_;                         // of every body slot, world axes
  std::vector<Row> rows_;
  std::vector<Outer> outers_;
  std::vector<Block> blocks_;
  std::vector<Vec3> missing_;  // of every outer of the block that is visited
  Vector u_, residual_, direction_, image_;
};

}  // namespace duet
