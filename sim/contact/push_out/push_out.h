// Step IV.2: interpenetration resolution (paper section 6.1, equations 1 and 2).
#pragma once

#include <utility>
#include <vector>

#include "sim/contact/graph/contact_graph.h"
#include "sim/contact/push_out/push_out_order.h"
#include "sim/contact/push_out/push_out_system.h"

namespace duet {

inline constexpr double overlap_tolerance = 1e-6;  // m, times ContactPoint::precision; shallower
                                                   // overlaps are left to contact

// Translates a rigid body by `shift` (m) and turns it by the rotation vector `turn` (rad), keeping its
// momenta.
void displace(RigidState& state, const RigidProperties& properties, const Vec3& shift, const Vec3& turn);

struct PushOutSettings {
  int iterations = 4;       // geometries: overlaps are found anew after bodies have moved
  int sweeps = 10;          // over the central bodies at one geometry, about
  bool gradual = true;      // the first half of the iterations removes a growing part of every overlap
  bool rigid_pairs = true;  // otherwise overlaps between rigid bodies are left (to separate_rigid_bodies)
  PushOutOrder order = PushOutOrder::together;
  // Rigid and deformable bodies that overlap since the start of the scene, sorted: opened as overlap_kept
  // says.
  std::vector<std::pair<int, int>> overlapping = {};
};

struct PushOutScratch {
  PushOutSystem system;
  std::vector<double> gap;            // m, of every contact, where it was last looked at
  std::vector<double> kept;           // m, of every contact: the overlap that this step leaves
  std::vector<char> moved;            // of every body as in guest_node, since its gaps were looked at
  std::vector<char> opened, opening;  // of every contact: an overlap in the last system, and in this one
  std::vector<char> frozen;           // of every body as in guest_node; empty: none
  std::vector<int> order;             // a pair's overlaps, the deepest first
  std::vector<int> taken;             // particles that an outer point of a pair moves already
  std::vector<int> central;           // rigid bodies in the order of the contact graph
  std::vector<int> rank;              // of every rigid body in it, -1: not central
};

// How much of an overlap of `depth` (m), that a deformable body has had since the start of a scene, is left
// at the end of a step: pushed out at once, the particles of its surface would crush what is behind them, and
// the energy of that has no bound. Beyond a thousandth of the elements' size `size` (m) it lessens by a 32nd
// of itself and by no more than a hundredth of that size, so slowly that the rest of the body moves along:
// then the energy is that of the least deformation that makes room.
double overlap_kept(double depth, double size);

// Moves overlapping bodies apart: rigid bodies and points of deformable ones are the central ones and
// exchange impulses with everything that overlaps them at once. Positions and orientations change, linear
// velocities and angular momenta do not. Returns the number of sweeps that the iteration with the most of
// them took, 0 where nothing overlapped.
int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch);

}  // namespace duet
