// The delay of an impact. Bodies meet some time after the beginning of the step, and the impulses of step
// II.1 change velocities from its beginning. What they change too early is taken back from the places.
//
// An impact with the impulse j after the time s changes the path of a body from x + t v to
//   x + s v + (t - s) (v + j / m)  =  (x - s j / m) + t (v + j / m).
// So the delay -s j / m is added to the place at the end of the step (RigidState::delay). With both arms
// taken when the bodies meet, the impact changes neither the momentum nor the angular momentum of the two,
// and a force that passes through the center of a ball does not turn it.
//
// Three kinds of impacts act later: those of balls on moving bodies, those whose rebound would be lost
// otherwise, because it is lower than the way from the beginning of the step to the impact, and those to
// which the delays of others lead in the same step. All others act at the beginning of the step, at the place
// at which contact found them. Orientations have no delay: it would change the inertia tensor, and with it
// the energy. Bodies that turn are therefore still some way apart after a delayed impact.
#pragma once

#include "sim/contact/detection/contact_point.h"

namespace duet {

/// Returns whether an impact of this rigid pair acts when the bodies meet, however strong the rebound is:
/// both are dynamic and one of them is a ball, or an impact of this step has delayed one of them.
bool is_delayed(const Bodies& bodies, const ContactPoint& contact);

/// Lets the arms of the contact lead to the place at which the bodies meet at the time `meeting` (s from the
/// beginning of the step), with their velocities now.
///
/// The guest's arm stays, and that of the host follows from the centers of mass. Sets the response, which is
/// that of the two bodies without joints. Does nothing if a body is not dynamic.
void put_at_meeting(const Bodies& bodies, double meeting, ContactPoint& contact);

/// Lets the arms lead to one place at the beginning of the step again, where the later stages apply impulses.
void put_at_start(const Bodies& bodies, ContactPoint& contact);

/// Delays both bodies of the contact for the impulse (N s) on the guest, which acts at the time `meeting` (s
/// from the beginning of the step).
void delay_impulse(Bodies& bodies, const ContactPoint& contact, double meeting, const Vec3& impulse);

/// Returns what a body that is not dynamic gives to the angular momentum of the other one by such an impulse,
/// about the origin and beyond the moment at the place of the contact, kg m^2/s. Zero if both are dynamic.
///
/// To be called after delay_impulse().
Vec3 delayed_moment(const Bodies& bodies, const ContactPoint& contact, double meeting, const Vec3& impulse);

}  // namespace duet
