// The choice of the deformable bodies with contact inside their velocity solves
// (sim/step/solved_contact.cpp):
//
// - all of them in implicit steps;
// - those that are strongly damped;
// - those that crush a rigid body of less than a tenth of their mass between themselves and
//   another rigid body or another such heavy volume. Sweeps over the contacts of the light body
//   pass on a fraction of the load that is as small as the ratio of the masses, and end long
//   before it carries what lies on it. Islands with joints are left out, because joints carry
//   load as well and would make a solve slow. Islands with sheets or rods are left out, because
//   these have no blocks of their own to precondition a solve with.
//
// Bodies of the last kind are found from the contacts that held a force at the end of the last step, and once
// more when the contacts of this step are known.
#include <algorithm>

#include "sim/contact/detection/surface_intersections.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Ratio of masses from which a deformable body is heavy for a rigid one. A larger ratio would leave more
// bodies to sweeps, which end before the light body carries such a load.
constexpr double heavy_ratio = 10;

// The neighbors of a rigid body that decide whether it can be crushed between them.
enum Holder : char {
  nothing,       // none
  heavy_volume,  // one heavy deformable body, and no rigid one
  several        // two heavy deformable bodies, or any rigid one
};

// Returns whether the deformable body is heavy for the rigid body `host`, which has to be dynamic.
bool is_heavy(const Bodies& bodies, int host, int deformable) {
  const RigidProperties& properties = bodies.rigid.properties[as_index(host)];
  return properties.is_dynamic() &&
         heavy_ratio * properties.mass < bodies.deformable[as_index(deformable)].mass;
}

}  // namespace

SurfacePoint soft_place(const Bodies& bodies, const CachedContact& remembered) {
  ContactPoint contact;
  contact.host = remembered.host;
  contact.feature = remembered.feature;
  contact.edge = remembered.edge;
  if (contact.is_on_edge()) put_on_surface(bodies, contact);
  return surface_point(bodies, contact);
}

namespace {

// Marks in `is_thin` the islands that have sheets or rods.
void find_thin(const Bodies& bodies, const Islands& islands, std::vector<char>& is_thin) {
  is_thin.assign(islands.size(), false);
  for (const DeformableBody& body : bodies.deformable)
    if (body.thickness > 0) is_thin[as_index(islands.of_particle(body.first_particle))] = true;
}

// Marks in context.solved.bodies the deformable bodies that crush a rigid one. context.solved.touching holds
// each pair of bodies in contact once: a rigid body and its guest, which is rigid, or deformable with numbers
// that follow those of rigid bodies. `islands` have these pairs joined.
void add_crushing(const Bodies& bodies, const Islands& islands, StepContext& context) {
  SolvedContact& solved = context.solved;
  std::vector<char>& is_thin = solved.is_searched;
  find_thin(bodies, islands, is_thin);
  const int rigid_count = static_cast<int>(bodies.rigid.size());
  std::vector<char>& holder = solved.holder;
  holder.assign(bodies.rigid.size(), nothing);
  for (const auto& [host, guest] : solved.touching) {
    char& of_host = holder[as_index(host)];
    if (guest < rigid_count) {
      of_host = holder[as_index(guest)] = several;
    } else if (of_host != several && is_heavy(bodies, host, guest - rigid_count)) {
      of_host = of_host == nothing ? heavy_volume : several;
    }
  }
  for (const auto& [host, guest] : solved.touching) {
    if (guest < rigid_count || holder[as_index(host)] != several) continue;
    const int d = guest - rigid_count;
    const std::size_t island = as_index(islands.of_particle(bodies.deformable[as_index(d)].first_particle));
    if (is_heavy(bodies, host, d) && !is_thin[island] && !islands.has_joints(island))
      solved.bodies[as_index(d)] = true;
  }
}

// Returns whether bodies can be chosen because they crush a rigid one.
bool looks_for_crushing(const World& world) {
  return world.may_crush && world.has_internal_forces() && !world.settings.implicit_elasticity &&
         !world.settings.constraints_before_solve;
}

// Sets context.solved.touching and context.solved.islands to the pairs, and their islands, of the contact
// cache of the last step.
void find_touching(const Bodies& bodies, const ContactCache& cache, StepContext& context) {
  SolvedContact& solved = context.solved;
  const int rigid_count = static_cast<int>(bodies.rigid.size());
  Islands& islands = solved.islands;
  islands.begin(bodies);
  solved.touching.clear();
  for (const CachedContact& contact : cache) {  // contacts of a pair follow each other
    const bool is_rigid_pair = contact.guest_rigid >= 0;
    const std::array<int, 2> pair{
        contact.host, is_rigid_pair ? contact.guest_rigid
                                    : rigid_count + static_cast<int>(body_of(
                                                        bodies, soft_place(bodies, contact).particle[0]))};
    if (!solved.touching.empty() && solved.touching.back() == pair) continue;
    solved.touching.push_back(pair);
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
  std::vector<char>& solved = context.solved.bodies;
  if (!world.has_internal_forces() ||
      (world.settings.constraints_before_solve && !world.settings.implicit_elasticity)) {
    solved.assign(bodies.deformable.size(), false);
    return;
  }
  if (world.settings.implicit_elasticity) {
    solved.assign(bodies.deformable.size(), true);
    return;
  }
  solved = world.strongly_damped;
  if (!looks_for_crushing(world)) return;
  find_touching(bodies, world.last_step.contact_cache, context);
  add_crushing(bodies, context.solved.islands, context);
}

void add_solved_bodies(const World& world, StepContext& context) {
  if (!looks_for_crushing(world)) return;
  const int rigid_count = static_cast<int>(world.bodies.rigid.size());
  context.solved.touching.clear();
  for (const int p : context.contact.graph.pairs) {
    const ContactPair& pair = context.contact.contacts.pairs[as_index(p)];
    context.solved.touching.push_back(
        {pair.host, pair.guest_rigid >= 0 ? pair.guest_rigid : rigid_count + pair.guest_deformable});
  }
  add_crushing(world.bodies, context.solved.islands, context);
}

// The conditions are those under which choose_solved_bodies() and add_solved_bodies() may choose a body in
// some step.
bool solves_contact(const World& world) {
  if (!world.has_internal_forces()) return false;
  if (world.settings.implicit_elasticity) return !world.bodies.deformable.empty();
  return !world.settings.constraints_before_solve &&
         (world.may_crush || may_press_layers(world) ||
          std::find(world.strongly_damped.begin(), world.strongly_damped.end(), true) !=
              world.strongly_damped.end());
}

}  // namespace duet
