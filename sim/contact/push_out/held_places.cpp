#include "sim/contact/push_out/held_places.h"

#include <algorithm>

#include "sim/base/parallel.h"
#include "sim/deformable/particles.h"

namespace duet {
namespace {

// Returns by how much held particles overlap the host at the place of a contact, m.
double overlap_of_held(const Bodies& bodies, const ContactPoint& contact) {
  const SurfacePoint& point = surface_point(bodies, contact);
  const Vec3 place = weighted(point, bodies.particles.x);
  const double gap = contact.gap - contact.yielded;
  double overlap = 0;
  for (std::size_t k = 0; k < as_index(point.count); ++k) {
    const auto p = as_index(point.particle[k]);
    if (is_held(bodies.particles, p))
      overlap += point.weight[k] * std::max(0.0, -gap - contact.normal.dot(bodies.particles.x[p] - place));
  }
  return overlap;
}

}  // namespace

void yield_where_held(const Bodies& bodies, ContactSet& contacts) {
  parallel_for(contacts.pairs.size(), 16, [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) {
      const ContactPair& pair = contacts.pairs[k];
      if (pair.guest_deformable < 0 || bodies.rigid.properties[as_index(pair.host)].is_dynamic()) continue;
      for (int i = pair.begin; i < pair.end; ++i) {
        ContactPoint& contact = contacts.points[as_index(i)];
        const double pinched = contact.is_pinched ? contact.yielded : 0;
        const double yielded = std::max(pinched, overlap_of_held(bodies, contact));
        contact.gap += yielded - contact.yielded;
        contact.yielded = yielded;
      }
    }
  });
}

}  // namespace duet
