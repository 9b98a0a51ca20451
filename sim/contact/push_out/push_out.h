// Step IV.2: interpenetration resolution (paper section 6.1, equations 1 and 2).
#pragma once

#include <utility>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/push_out/push_out_order.h"
#include "sim/contact/push_out/push_out_system.h"

namespace duet {

/// Depth of an overlap that is left to contact, m, to be multiplied by ContactPoint::precision. A larger
/// value would let bodies rest deeper in each other.
inline constexpr double overlap_tolerance = 1e-6;

/// Translates a rigid body by `shift` (m) and turns it by the rotation vector `turn` (rad, world axes). Keeps
/// its linear velocity and angular momentum; the angular velocity follows from the new orientation.
void displace(RigidState& state, const RigidProperties& properties, const Vec3& shift, const Vec3& turn);

/// Settings of resolve_interpenetration().
struct PushOutSettings {
  int iterations = 4;  ///< Number of geometries at most: overlaps are measured again after bodies have moved.
  int sweeps = 10;     ///< Sweeps over the central bodies at one geometry, approximately.
  /// True if the first half of the iterations removes a growing fraction of each overlap instead of the
  /// whole.
  bool gradual = true;
  /// True if rigid pairs take part. If false, separate_rigid_bodies() deals with them.
  bool rigid_pairs = true;
  PushOutOrder order = PushOutOrder::together;  ///< Order of the central bodies.
  /// Sorted pairs of a rigid and a deformable body that overlap since the start of the scene. Their overlaps
  /// are opened slowly, see overlap_kept().
  std::vector<std::pair<int, int>> overlapping = {};
};

/// Scratch of resolve_interpenetration(), kept from step to step so that nothing is allocated. Bodies are
/// numbered as by guest_node().
struct PushOutScratch {
  PushOutSystem system;      ///< The system of one geometry.
  std::vector<double> gap;   ///< For each contact: the gap when it was measured last, plus `kept`, m.
  std::vector<double> kept;  ///< For each contact: the overlap that this step leaves, m.
  std::vector<char> moved;   ///< For each body: whether it has moved since its gaps were measured.
  std::vector<char> opened,  ///< For each contact: whether it was in the last system.
      opening;               ///< For each contact: whether it is in the present system.
  std::vector<char> frozen;  ///< For each body: whether it is held; empty: none is.
  std::vector<int> order;    ///< Overlapping contacts of one pair, the deepest first.
  /// For each particle: mark of the last pair that has a contact on it in the system.
  std::vector<int> taken;
  std::vector<int> central;  ///< Central rigid bodies, by level, then from light to heavy.
  std::vector<int> rank;     ///< For each rigid body: its place in `central`; -1: not central.
};

/// Returns how much of an overlap of `depth` (m), which a deformable body has had since the start of a scene,
/// is left at the end of a step, m. If it were opened at once, the particles of the surface would compress
/// the elements behind them, and the energy of that has no bound. Overlaps of up to a thousandth of the
/// element size `size` (m) are opened at once. Deeper ones lessen by a 32nd of their depth, and by at most a
/// hundredth of that size, so slowly that the rest of the body moves along: the energy is then that of the
/// least deformation that makes room.
double overlap_kept(double depth, double size);

/// Moves overlapping bodies apart by equations 1 and 2 of the paper's section 6.1. Each rigid body and each
/// point of a deformable body is a central body, and exchanges impulses with all bodies that overlap it at
/// once. Positions and orientations change, linear velocities and angular momenta do not. Overlaps can be
/// left if the iterations do not suffice. Returns the largest number of sweeps that an iteration took; 0:
/// nothing overlapped.
int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch);

}  // namespace duet
