// Which deformable bodies have contact in their velocity solves (sim/step/solved_contact.cpp) in this step:
//
// - all of them in implicit steps;
// - those that are strongly damped;
// - those that crush a rigid body, one of less than a tenth of their mass, between themselves and another
//   rigid body or another such heavy volume. Sweeps over the contacts of such a body pass on a share of the
//   load that is as small as the ratio of the masses, and so end long before it carries what lies on it. It
//   is not done on islands with joints, which have others to carry the load and would make a solve slow, nor
//   on those with sheets or rods, which have no blocks of their own to precondition a solve with.
//
// The last kind is found from the contacts that held a force at the end of the last step, and once more when
// those of this step are known.
#include <algorithm>

#include "sim/contact/detection/surface_intersections.h"
#include "sim/step/step.h"

namespace duet {
namespace {

constexpr double heavy_ratio = 10;

// What a rigid body lies between: nothing, one heavy volume and nothing else, or two of them or any rigid
// body.
enum Holder : char { nothing, heavy_volume, several };

bool is_heavy(const Bodies& bodies, int host, int deformable) {
  const RigidProperties& properties = bodies.rigid.properties[as_index(host)];
  return properties.is_dynamic() &&
         heavy_ratio * properties.mass < bodies.deformable[as_index(deformable)].mass;
}

// The deformable body that is the guest of a contact.
int soft_guest(const Bodies& bodies, const CachedContact& remembered) {
  ContactPoint contact;
  contact.host = remembered.host;
  contact.guest_point = remembered.guest_point;
  contact.edge = remembered.edge;
  if (contact.is_on_edge()) put_on_surface(bodies, contact);
  return static_cast<int>(body_of(bodies, surface_point(bodies, contact).particle[0]));
}

// Marks the islands that have sheets or rods.
void find_thin(const Bodies& bodies, const Islands& islands, std::vector<char>& is_thin) {
  is_thin.assign(islands.size(), false);
  for (const DeformableBody& body : bodies.deformable)
    if (body.thickness > 0) is_thin[as_index(islands.of_particle(body.first_particle))] = true;
}

// context.touching are a rigid body each and what touches it: another one, or a deformable one, whose numbers
// follow; each pair once. They are joined on the islands.
void add_crushing(const Bodies& bodies, const Islands& islands, StepContext& context) {
  std::vector<char>& is_thin = context.is_solved;
  find_thin(bodies, islands, is_thin);
  const int rigid_count = static_cast<int>(bodies.rigid.size());
  std::vector<char>& holder = context.holder;
  holder.assign(bodies.rigid.size(), nothing);
  for (const auto& [host, guest] : context.touching) {
    char& of_host = holder[as_index(host)];
    if (guest < rigid_count) {
      of_host = holder[as_index(guest)] = several;
    } else if (of_host != several && is_heavy(bodies, host, guest - rigid_count)) {
      of_host = of_host == nothing ? heavy_volume : several;
    }
  }
  for (const auto& [host, guest] : context.touching) {
    if (guest < rigid_count || holder[as_index(host)] != several) continue;
    const int d = guest - rigid_count;
    const std::size_t island = as_index(islands.of_particle(bodies.deformable[as_index(d)].first_particle));
    if (is_heavy(bodies, host, d) && !is_thin[island] && !islands.has_joints(island))
      context.solved_bodies[as_index(d)] = true;
  }
}

bool looks_for_crushing(const World& world) {
  return world.may_crush && world.has_internal_forces() && !world.settings.implicit_elasticity &&
         !world.settings.constraints_first;
}

// What touched at the end of the last step.
void find_touching(const Bodies& bodies, StepContext& context) {
  const int rigid_count = static_cast<int>(bodies.rigid.size());
  Islands& islands = context.solved;
  islands.begin(bodies);
  context.touching.clear();
  for (const CachedContact& contact : context.memory) {  // those of a pair follow each other
    const bool is_rigid_pair = contact.guest_rigid >= 0;
    const std::array<int, 2> pair{
        contact.host, is_rigid_pair ? contact.guest_rigid : rigid_count + soft_guest(bodies, contact)};
    if (!context.touching.empty() && context.touching.back() == pair) continue;
    context.touching.push_back(pair);
    if (is_rigid_pair)
      islands.join_rigid(pair[0], pair[1]);
    else
      islands.join_particle(pair[0], bodies.deformable[as_index(pair[1] - rigid_count)].first_particle);
  }
  islands.finish();
}

}  // namespace

bool may_crush(const Bodies& bodies) {
  double heaviest = 0;  // kg
  for (const DeformableBody& body : bodies.deformable) heaviest = std::max(heaviest, body.mass);
  return std::any_of(bodies.rigid.properties.begin(), bodies.rigid.properties.end(),
                     [&](const RigidProperties& properties) {
                       return properties.is_dynamic() && heavy_ratio * properties.mass < heaviest;
                     });
}

void choose_solved_bodies(World& world, StepContext& context) {
  const Bodies& bodies = world.bodies;
  std::vector<char>& solved = context.solved_bodies;
  if (!world.has_internal_forces() ||
      (world.settings.constraints_first && !world.settings.implicit_elasticity)) {
    solved.assign(bodies.deformable.size(), false);
    return;
  }
  if (world.settings.implicit_elasticity) {
    solved.assign(bodies.deformable.size(), true);
    return;
  }
  solved = world.strongly_damped;
  if (!looks_for_crushing(world)) return;
  find_touching(bodies, context);
  add_crushing(bodies, context.solved, context);
}

void add_solved_bodies(const World& world, StepContext& context) {
  if (!looks_for_crushing(world)) return;
  const int rigid_count = static_cast<int>(world.bodies.rigid.size());
  context.touching.clear();
  for (const int p : context.graph.pairs) {
    const ContactPair& pair = context.contacts.pairs[as_index(p)];
    context.touching.push_back(
        {pair.host, pair.guest_rigid >= 0 ? pair.guest_rigid : rigid_count + pair.guest_deformable});
  }
  add_crushing(world.bodies, context.solved, context);
}

// As choose_solved_bodies() and add_solved_bodies() may choose, at any time.
bool solves_contact(const World& world) {
  if (!world.has_internal_forces()) return false;
  if (world.settings.implicit_elasticity) return !world.bodies.deformable.empty();
  return !world.settings.constraints_first &&
         (world.may_crush || std::find(world.strongly_damped.begin(), world.strongly_damped.end(), true) !=
                                 world.strongly_damped.end());
}

}  // namespace duet
