// The relative velocity that a row of a velocity solve is about.
#pragma once

#include "sim/contact/response/contact_projection.h"

namespace duet {

/// v_guest - v_host at a contact, m/s: v + omega x arm of rigid bodies, the weighted mean of a deformable
/// guest's particles. A Row has host, host_arm, guest_rigid (-1: deformable), guest_arm and point.
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
