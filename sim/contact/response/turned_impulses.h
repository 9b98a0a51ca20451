// The impulses of step III act at the beginning of the step, where contact was found, and the rest of the
// impulses of step V at its end. In between the contact may have moved along a body that rocks or rolls, or
// with a particle that slides over a round body, and the body may have turned about it.
//
// With both halves at the end, a body that rocks on a round one loses energy, and a body that tips over an
// edge gains some, in proportion to the step; with both in the middle, particles gain energy in a bowl. With
// one half at each end neither happens, as in RATTLE (Andersen 1983). The order of V.4 stays: its sweeps find
// the sum of both halves at the end of the step, with Coulomb's law for the sum. The difference between the
// first half where it acts and where V.4 takes it to act is added to the velocities before:
//
//   guest:  dv = (J - R J) / m,   dL = a x J - a' x R J,   and the opposite for the host,
//
// with the impulse J (N s) on the guest, the arms a and a' (m) at the beginning and at the end of the step,
// and the smallest rotation R that turns the normal at the beginning to that at the end. Particles of a
// deformable guest share J and R J by the weights of the contact's place at the beginning and at the end.
//
// A round surface made of triangles touches with another vertex B at the end of the step than the vertex A at
// its beginning if B lands in the step. If the contact at B bore the load of the whole step, a ball of radius
// r that rolls would lose the fraction g dt / (1.4 r) of its energy in a second. So A bears the load for the
// time s dt until B lands. The impulse J of step III is divided into the load J_l of half a step and the rest
// J_b, which lets B land:
//
//   J = J_l + J_b,   J_b = J (target - target_A) / u,   s = b / (a + b),
//   A bears 2 s J_l at the time s dt / 2,   B bears J_b at 0 and 2 (1 - s) J_l at (1 + s) dt / 2,
//
// with the target that A would have without B, the velocity u along the normal that the normal impulses of
// all contacts of the pair give at this one, the gap b of B at the beginning and the gap a of A at the end.
// The arms are those at these times. What a ball of fine facets gains as it sinks from one vertex onto the
// next, it then gives back as it rises, also if a step leads over several of them. V.4 finds the sum of the
// impulses at B.
#pragma once

#include <vector>

#include "sim/contact/graph/contact_graph.h"

namespace duet {

/// Where a contact acts in step III.
struct ContactFrame {
  SurfacePoint place;            ///< The place on a deformable guest.
  Vec3 normal = Vec3::UnitY(),   ///< Unit: outward normal of the host.
      host_arm = Vec3::Zero(),   ///< m: from the host's center of mass to the contact.
      guest_arm = Vec3::Zero(),  ///< m: from a rigid guest's center of mass to the contact.
      impulse = Vec3::Zero(),    ///< N s: impulse on the guest; zero if it stays at the end of the step.
      on_guest = Vec3::Zero();   ///< m, shape space of a rigid guest: the place, for those on round surfaces.
  /// Orientation of the shape of a rigid guest, for contacts on round surfaces.
  Quat orientation = Quat::Identity();
  /// m: from the host's center of mass to that of a rigid guest, for contacts on round surfaces.
  Vec3 apart = Vec3::Zero();
  double gap = 0,  ///< m: gap of the contact.
      load = 1;    ///< Fraction of `impulse` that would act if no other vertex of a round surface landed.
  /// N s: impulse on the guest at a vertex that bore the load until another one landed. The frame is that of
  /// the other one then.
  Vec3 relieved = Vec3::Zero();
  Vec3 relieved_host_arm = Vec3::Zero(),  ///< m: from the host's center of mass to that vertex.
      relieved_guest_arm = Vec3::Zero();  ///< m: from the guest's center of mass to that vertex.
  /// Returns whether nothing acts.
  bool is_idle() const { return impulse.isZero(0) && relieved.isZero(0); }
};

/// Sets `frames` to the frames of all contacts now, with the impulses of active pairs. Impulses against
/// planes that the bodies meet later in the step are left out.
void note_frames(const ContactGraph& graph, const Bodies& bodies, const ContactSet& contacts,
                 std::vector<ContactFrame>& frames);

/// Lets the impulses in `frames` act there: turns the impulses of the contacts to the present normals, and
/// changes the velocities by the difference.
///
/// Sets the impulses in `frames` to zero that stay as they are: those of inactive pairs, and of contacts that
/// have turned by more than 26 degrees, because their normals are those of another side. Divides those of the
/// round surfaces of meshes that touch with another vertex now, which has landed in the step.
void act_at_start(std::vector<ContactFrame>& frames, ContactGraph& graph, Bodies& bodies,
                  ContactSet& contacts);

/// An impulse that acts at the beginning of a step, and what it gives beyond the same impulse at the end.
struct TurnedImpulse {
  Vec3 impulse;      ///< N s, on the guest: turned to the present normal of its contact.
  Vec3 to_guest;     ///< N s, to the guest; the host gets the opposite.
  Vec3 turns_guest,  ///< N m s, to the guest about its center of mass.
      turns_host;    ///< N m s, to the host about its center of mass.
};
/// Returns the impulse of a frame as it acts at the present place of its contact.
TurnedImpulse turned_impulse(const ContactFrame& first, const ContactPoint& contact);

/// Calls give(body, impulse, angular impulse) for what act_at_start() gave to each rigid body of each
/// contact, N s and N m s about the body's center of mass. Bodies of infinite mass are among them. Calls
/// give_particle(particle, impulse, part of it along the normal at its place) for each particle, N s.
template <class Give, class GiveParticle>
void visit_turned(const std::vector<ContactFrame>& frames, const Bodies& bodies, const ContactSet& contacts,
                  Give&& give, GiveParticle&& give_particle) {
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const ContactFrame& first = frames[i];
    if (first.is_idle()) continue;
    const ContactPoint& contact = contacts.points[i];
    const TurnedImpulse turned = turned_impulse(first, contact);
    if (moves_host(bodies, contact) || !bodies.rigid.properties[as_index(contact.host)].is_dynamic())
      give(contact.host, Vec3(-turned.to_guest), turned.turns_host);
    if (contact.is_rigid_pair()) {
      give(contact.guest_rigid, turned.to_guest, turned.turns_guest);
      continue;
    }
    const auto share = [&](const SurfacePoint& place, const Vec3& impulse, double along_normal) {
      for (std::size_t k = 0; k < as_index(place.count); ++k)
        give_particle(as_index(place.particle[k]), Vec3(place.weight[k] * impulse),
                      place.weight[k] * along_normal);
    };
    share(first.place, first.impulse, first.impulse.dot(first.normal));
    share(surface_point(bodies, contact), -turned.impulse, -turned.impulse.dot(contact.normal));
  }
}

/// Returns the momentum about the origin that act_at_start() gave to all bodies, beyond that of contacts at
/// one place: what bodies of infinite mass gave, and for other pairs d x J, with the change d of the vector
/// from the host to the guest in the step. The momentum of a pair changes by the opposite as the step moves
/// it.
Momentum moved_by_turning(const std::vector<ContactFrame>& frames, const Bodies& bodies,
                          const ContactSet& contacts);

}  // namespace duet
