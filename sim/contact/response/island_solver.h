// Contact of a few rigid bodies solved as a whole, where sweeps over their contacts end before they settle.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "sim/state/bodies.h"

namespace duet {

struct ContactPoint;
struct ContactSet;

/// Solves the contacts of one island of rigid bodies by the method of multipliers (Rockafellar 1976; for
/// contact with friction Alart and Curnier 1991): with the impulses p of all contacts in turn
///
///   p_n <- max(0, p_n + rho_n (target - u_n)),   p_t <- p_t - rho_t u_t where the contact sticks,
///
/// cut to the friction cone, where u are the relative velocities to which these impulses themselves lead,
/// M dv = J^T dp. Newton's method finds them, since they make a convex, piecewise quadratic function of the
/// velocities least. What a round leaves hardly depends on ratios of masses or on how near to tipping a stack
/// is, as what a sweep leaves does: four bricks that lean out by 0.98 of what can stand are 4e-4 m/s off
/// after 400 sweeps, and less than 1e-6 m/s after 5 to 10 rounds.
class IslandSolver {
 public:
  /// Pairs of bodies of the largest island that is solved: the work grows with the cube of the bodies.
  static constexpr std::size_t most_pairs = 32;

  /// Solves for the active ones of `pairs` (indices of contacts.pairs), all of rigid bodies. Their impulses,
  /// which the velocities must contain already, and the velocities become those of the solution, or of the
  /// best round where friction does not let it come nearer. Returns the largest change of a relative velocity
  /// (m/s, over its contact's precision) that an update of one contact would still make; it ends where that
  /// is below `tolerance`.
  double solve(Bodies& bodies, std::span<const int> pairs, double tolerance, ContactSet& contacts);

 private:
  struct Body {
    std::size_t number = 0;
    double mass = 0;              // kg
    Mat3 inertia = Mat3::Zero();  // kg m^2, world axes
    RigidState best;
  };
  struct Row {  // of a contact
    std::size_t point = 0;
    std::array<int, 2> place{-1, -1};  // of guest and host among the bodies, -1 of those that nothing moves
    std::array<Vec3, 2> arm;           // m, of guest and host
    Vec3 normal;
    double target = 0, friction = 0;
    double normal_mass = 0, tangent_mass = 0;  // kg, of the contact by itself
    double normal_rho = 0, tangent_rho = 0;    // kg
    bool sticks = false;
    int cuts = 0;         // rounds at whose end it stuck beyond its cone
    double pressure = 0;  // N s, its impulse as the round begins: along the normal
    Vec3 tangent;         // N s, and beside it
    Vec3 sliding;         // N s, beside the normal at the round's end if it does not stick
    Vec3 velocity;        // m/s, relative, as the round begins
    Vec3 best;            // N s
  };
  using Twists = std::vector<double>;  // six of every body: m/s and rad/s

  void gather(const Bodies& bodies, std::span<const int> pairs, const ContactSet& contacts);
  Row row_of(const ContactPoint& contact) const;
  void begin_round(const Bodies& bodies, const ContactSet& contacts, double scale, bool is_best);
  int minimize();
  void end_round(Bodies& bodies, ContactSet& contacts) const;
  double error(const Bodies& bodies, const ContactSet& contacts) const;
  void keep(const Bodies& bodies, const ContactSet& contacts);
  void restore(Bodies& bodies, ContactSet& contacts) const;

  static Vec3 change(const Row& row, const Twists& twists);
  static double pressure(const Row& row, const Vec3& velocity);
  static Vec3 tangent(const Row& row, const Vec3& velocity);
  double value(const Twists& twists) const;
  void find_gradient();
  void find_matrix();
  void add_to_matrix(const Row& row, const Mat3& stiffness);
  void add_block(std::size_t row, std::size_t column, const Mat3& block);
  bool solve_for_step();

  std::vector<int> place_;  // of every rigid body, -1 of others than `bodies_`
  std::vector<Body> bodies_;
  std::vector<Row> rows_;
  Twists twists_, trial_, gradient_, step_;  // changes since the round's begin
  std::vector<double> matrix_;  // columns of a symmetric one, of which the lower triangle is used
};

}  // namespace duet
