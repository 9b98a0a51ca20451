// Step IV.2: interpenetration resolution (paper section 6.1, equations 1 and 2).
#pragma once

#include <vector>

#include "sim/coupling/contact_graph.h"
#include "sim/coupling/push_out_order.h"
#include "sim/coupling/push_out_system.h"

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
};

struct PushOutScratch {
  PushOutSystem system;
  std::vector<double> gap;            // m, of every contact, where it was last looked at
  std::vector<char> moved;            // of every body as in guest_node, since its gaps were looked at
  std::vector<char> opened, opening;  // of every contact: an overlap in the last system, and in this one
  std::vector<char> frozen;           // of every body as in guest_node; empty: none
  std::vector<int> order;             // a pair's overlaps, the deepest first
  std::vector<int> taken;             // particles that an outer point of a pair moves already
  std::vector<int> central;           // rigid bodies in the order of the contact graph
  std::vector<int> rank;              // of every rigid body in it, -1: not central
};

// Moves overlapping bodies apart: rigid bodies and points of deformable ones are the central ones and
// exchange impulses with everything that overlaps them at once. Positions and orientations change, linear
// velocities and angular momenta do not. Returns the number of sweeps that the iteration with the most of
// them took, 0 where nothing overlapped.
int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch);

}  // namespace duet
