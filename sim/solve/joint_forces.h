// Control, friction and limits of joints inside a velocity solve: their impulses are unknowns of the solve,
// together with the velocities and the impulses of contacts.
#pragma once

#include <vector>

#include "sim/articulation/joint_solver.h"
#include "sim/contact/response/contact_projection.h"
#include "sim/solve/response_row.h"
#include "sim/state/islands.h"

namespace duet {

/// Impulses of control, friction and limits of joints as functions of the velocity v of their row (m/s or
/// rad/s), by the method of multipliers:
///
///     p = clamp(l + k (w - v), least, most)
///
/// with the target w, the multiplier l (N s or N m s) and the stiffness k (kg or kg m^2). It is the gradient
/// of a convex function of v, so that a velocity solve with it minimizes a potential. In the limit of
/// infinite k, or of multipliers that equal the impulses, the row has its target velocity unless its impulse
/// is at a bound (Hestenes 1969; Rockafellar 1973). Without them in the solve, a control would see a plate
/// that moves freely, and not what the plate presses.
class JointForces {
 public:
  /// Takes those of `rows` that move a body of a searched island.
  ///
  /// `factor` times their `impulses` (N s or N m s, for all rows of joints) are the multipliers. `heaviest`
  /// (kg) has the mass of the heaviest body for each island. `rigid` has to outlive the object.
  void build(const RigidBodies& rigid, const std::vector<DriveRow>& rows, const Islands& islands,
             const std::vector<double>& heaviest, const std::vector<double>& impulses, double factor);
  /// Removes all rows.
  void clear() { rows_.clear(); }

  /// Computes the impulses at `velocity`, and their derivatives. Returns their potential, J.
  double evaluate(const GeneralizedVelocity& velocity);
  /// Adds to `out` `factor` M^-1 times the impulses of all rows.
  void add_velocities(double factor, GeneralizedVelocity& out) const;
  /// Adds to `out` M^-1 times the decrease of the impulses by `change` of the velocity.
  void add_differentials(const GeneralizedVelocity& change, GeneralizedVelocity& out) const;
  /// Adds the derivatives of the impulses to the diagonal block of every rigid body (kg, kg m, kg m^2).
  void add_blocks(std::vector<Mat6>& rigid) const;
  /// Appends the derivatives of the impulses, row by row.
  void append_rows(std::vector<ResponseRow>& rows) const;
  /// Sets the multipliers to the impulses.
  void update_multipliers();
  /// Replaces the entries of its rows in `impulse`, and sets them to zero in `swept`.
  ///
  /// Both have the impulses (N s or N m s) of all rows of joints.
  void give_impulses(std::vector<double>& impulse, std::vector<double>& swept) const;
  /// Hands the impulses over to `joints`, whose solves start from them.
  void hand_to(JointSolver& joints) const;
  /// Returns what bodies of infinite mass give to others by the impulses of all rows.
  Momentum impulse_of_fixed() const;
  /// Returns the same for the joints between two bodies.
  Momentum impulse_of_fixed(std::size_t parent, std::size_t child) const;

 private:
  struct Row {
    DriveRow joint;
    double multiplier = 0,  // N s or N m s
        stiffness = 0,      // kg or kg m^2
        impulse = 0,        // N s or N m s
        slope = 0;          // kg or kg m^2, decrease of the impulse per velocity
  };
  // Returns what bodies of infinite mass give to others by the impulse of a row.
  Momentum impulse_of_fixed(const Row& row) const;
  // Returns the velocity of a row, m/s or rad/s.
  static double velocity_of(const Row& row, const GeneralizedVelocity& v);
  // Adds M^-1 times an impulse on a row.
  void push(const Row& row, double impulse, GeneralizedVelocity& v) const;

  const RigidBodies* rigid_ = nullptr;
  std::vector<Row> rows_;
};

}  // namespace duet
