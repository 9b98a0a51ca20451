// The relative velocity at a contact that is a row of a velocity solve.
#pragma once

#include "sim/contact/response/contact_projection.h"

namespace duet {

/// Returns the relative velocity v_guest - v_host at a contact, m/s. For rigid bodies it is v + omega x arm
/// at the contact, for a deformable guest the weighted mean of its particles. `Row` has the members host,
/// host_arm, guest_rigid
/// (-1: the guest is deformable), guest_arm and point, as those of ContactPoint.
template <class Row>
Vec3 row_velocity(const Row& row, const GeneralizedVelocity& v) {
  const auto host = as_index(row.host);
  Vec3 relative = -(v.linear[host] + v.angular[host].cross(row.host_arm));
  if (row.guest_rigid >= 0) {
    const auto guest = as_index(row.guest_rigid);
    relative += v.linear[guest] + v.angular[guest].cross(row.guest_arm);
  } else {
    relative += weighted(row.point, v.particle);
  }
  return relative;
}

}  // namespace duet
