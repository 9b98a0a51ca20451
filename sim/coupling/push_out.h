// Step IV.2: interpenetration resolution (paper section 6.1, equations 1 and 2).
#pragma once

#include <vector>

#include "sim/coupling/contact_graph.h"

namespace duet {

inline constexpr double overlap_tolerance = 1e-6;  // m; shallower overlaps are left to contact

// Translates a rigid body by `shift` (m) and turns it by the rotation vector `turn` (rad), keeping its
// momenta.
void displace(RigidState& state, const RigidProperties& properties, const Vec3& shift, const Vec3& turn);

struct PushOutScratch {
  struct Outer {                       // an object that overlaps the central body
    int contact = -1;                  // index of its contact point
    bool reversed = false;             // the central body is the contact's guest
    Vec3 arm = Vec3::Zero();           // r_o: m, from the central body's centre
    Vec3 displacement = Vec3::Zero();  // d_o: m, wanted of the outer point relative to the central body
    Mat3 inverse_K = Mat3::Zero();     // kg
  };
  std::vector<Outer> outers;
  std::vector<int> taken;     // particles that an outer point of the current central body moves already
  std::vector<int> central;   // rigid bodies in the order of the contact graph
  std::vector<char> suspect;  // of every pair: it overlapped at first, or a body of it moved since
};

struct PushOutSettings {
  int iterations = 4;       // sweeps over the bodies; they remove a growing fraction of each overlap
  bool rigid_pairs = true;  // otherwise overlaps between rigid bodies are left (to separate_rigid_bodies)
};

// Moves overlapping bodies apart: every rigid body in turn is the central one and exchanges impulses with
// everything that overlaps it at once. Positions and orientations change, linear velocities and angular
// momenta do not. Returns the number of central bodies that had overlaps.
int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, const PushOutSettings& settings,
                             ContactSet& contacts, PushOutScratch& scratch);

}  // namespace duet
