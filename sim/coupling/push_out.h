// Step IV.2: interpenetration resolution (paper section 6.1, equations 1 and 2).
#pragma once

#include <vector>

#include "sim/coupling/contact_graph.h"

namespace duet {

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

// Moves overlapping bodies apart: every rigid body in turn is the central one and exchanges impulses with
// everything that overlaps it at once. Positions and orientations change, linear velocities and angular
// momenta do not. `iterations` sweeps remove a growing fraction of each overlap. Returns the number of
// central bodies that had overlaps.
int resolve_interpenetration(Bodies& bodies, const ContactGraph& graph, int iterations, ContactSet& contacts,
                             PushOutScratch& scratch);

}  // namespace duet
