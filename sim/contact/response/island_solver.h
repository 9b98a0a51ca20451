// Solver for the contacts of a few rigid bodies as a whole, for islands on which Gauss-Seidel sweeps do not
// converge.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "sim/state/bodies.h"

namespace duet {

struct ContactPoint;
struct ContactSet;

/// Solves the contacts of one island of rigid bodies by the method of multipliers. Each round updates the
/// impulses p of all contacts by
///
///   p_n <- max(0, p_n + rho_n (target - u_n)),   p_t <- p_t - rho_t u_t if the contact sticks,
///
/// and cuts them to the friction cone, where u are the relative velocities to which these new impulses lead,
/// M dv = J^T dp. The velocities minimize a convex, piecewise quadratic function, and Newton's method finds
/// them (Rockafellar 1976; with friction Alart and Curnier 1991).
///
/// The error after a round hardly depends on mass ratios or on how near to tipping a stack is, unlike that
/// after a sweep: four bricks that lean out by 0.98 of what can stand are 4e-4 m/s off after 400 sweeps, and
/// less than 1e-6 m/s after 5 to 10 rounds.
class IslandSolver {
 public:
  /// Largest number of pairs of an island that is solved. The work grows with the cube of the number of
  /// bodies: with 64 pairs, and without a limit of the sliding velocity, the attempts took 40 % of the time
  /// of piles.
  static constexpr std::size_t max_pairs = 32;

  /// Solves for the active pairs among `pairs` (indices into contacts.pairs), which must be rigid. Starts
  /// from the impulses that the contacts hold, which the velocities must contain already. Sets impulses and
  /// velocities to the solution, or to the best round if friction keeps the rounds from converging. Returns
  /// the error: the largest change of a relative velocity (m/s, over ContactPoint::precision) that an update
  /// of one contact would still make. Stops when the error is below `tolerance` (m/s).
  double solve(Bodies& bodies, std::span<const int> pairs, double tolerance, ContactSet& contacts);

 private:
  // A dynamic body of the island.
  struct Body {
    std::size_t number = 0;       // of the rigid body
    double mass = 0;              // kg
    Mat3 inertia = Mat3::Zero();  // kg m^2, world axes
    RigidState best;              // after the best round
  };
  // A contact.
  struct Row {
    std::size_t point = 0;                   // index into contacts.points
    std::array<int, 2> place{-1, -1};        // of guest and host in bodies_; -1: static or kinematic
    std::array<Vec3, 2> arm;                 // m, of guest and host
    Vec3 normal;                             // unit
    double target = 0,                       // m/s
        friction = 0;                        // Coulomb coefficient
    double normal_mass = 0,                  // kg, effective mass of the contact alone along the normal
        tangent_mass = 0;                    // kg, mean effective mass along the tangents
    double normal_rho = 0, tangent_rho = 0;  // kg, the rho of this round
    bool sticks = false;                     // true if the contact sticks in this round
    int cuts = 0;                            // not in use
    double pressure = 0;                     // N s, normal impulse at the start of the round
    Vec3 tangent;                            // N s, tangential impulse at the start of the round
    Vec3 sliding;   // N s, tangential impulse at the end of the round if the contact does not stick
    Vec3 velocity;  // m/s, relative velocity at the start of the round
    Vec3 best;      // N s, impulse after the best round
  };
  using Twists = std::vector<double>;  // m/s and rad/s, six numbers for each body

  // Collects the bodies and contacts of active pairs.
  void gather(const Bodies& bodies, std::span<const int> pairs, const ContactSet& contacts);
  Row row_of(const ContactPoint& contact) const;
  // Where the friction of contacts that slide comes from.
  enum class SlidingFriction {
    updated,  // from a Gauss-Seidel update of each contact alone
    kept,     // from the impulse now
  };
  // Takes the present impulses and velocities, and decides which contacts stick. `scale` is rho over
  // effective mass.
  void begin_round(const Bodies& bodies, const ContactSet& contacts, double scale, SlidingFriction sliding);
  int minimize();
  void end_round(Bodies& bodies, ContactSet& contacts) const;
  // Returns the largest change of a relative velocity that an update of one contact would make, m/s over its
  // precision.
  double error(const Bodies& bodies, const ContactSet& contacts) const;
  // Saves impulses and states as those of the best round.
  void keep(const Bodies& bodies, const ContactSet& contacts);
  // Brings impulses and states of the best round back.
  void restore(Bodies& bodies, ContactSet& contacts) const;

  static Vec3 change(const Row& row, const Twists& twists);
  // Returns the normal impulse, N s, that belongs to a relative velocity in this round.
  static double pressure(const Row& row, const Vec3& velocity);
  // Returns the tangential impulse, N s, that belongs to a relative velocity in this round, not yet cut to
  // the cone.
  static Vec3 tangent(const Row& row, const Vec3& velocity);
  double value(const Twists& twists) const;
  // Sets gradient_ to that of value() at twists_.
  void find_gradient();
  void find_matrix();
  // Adds J^T D J of one contact with the 3 x 3 matrix D = `stiffness`.
  void add_to_matrix(const Row& row, const Mat3& stiffness);
  void add_block(std::size_t row, std::size_t column, const Mat3& block);
  bool solve_for_step();

  std::vector<int> place_;  // for each rigid body: index into bodies_; -1: not in the island
  std::vector<Body> bodies_;
  std::vector<Row> rows_;
  bool has_rings_ = false;  // whether ring contacts are among the rows, see ring_contacts.h
  Twists twists_,           // change of the velocities since the start of the round
      trial_, gradient_, step_;
  std::vector<double> matrix_;  // column-major, symmetric: only the lower triangle is used
};

}  // namespace duet
