// The choice of sheets and rods with contact inside their velocity solves (sim/step/solved_contact.cpp):
// those that lie on other deformable surfaces, or on themselves, under the load of a rigid body or a volume,
// with something rigid below or above them.
//
// Sweeps over contacts give the load to the particles of the uppermost layer, and the repulsions of I.3 and
// V.4 pass it on to the layer below, each without the other. A load as heavy as a layer, or heavier, then
// presses it through the next one.
#include <algorithm>
#include <limits>

#include "sim/contact/detection/surface_intersections.h"
#include "sim/step/step.h"

namespace duet {
namespace {

// Least load of layers, relative to the mass of the lightest of them. Under smaller ones layers come nearer
// by some hundredths of their thickness.
constexpr double least_load = 0.1;

// The deformable bodies that pairs of surfaces connect, one set for each group of layers.
class Layers {
 public:
  Layers(const Bodies& bodies, LayerSearch& search) : bodies_(bodies), search_(search) {
    search_.sets.reset(bodies_.deformable.size());
    search_.layers.assign(bodies_.deformable.size(), {});
    search_.has_pair.assign(bodies_.particles.size(), 0);
  }

  // Takes a pair of surfaces that are nearer than their thickness and a little more.
  void take_pair(const RepulsionPair& pair) {
    const auto a = static_cast<int>(body_of(bodies_, pair.particle.front())),
               b = static_cast<int>(body_of(bodies_, pair.particle.back()));
    if (!is_thin(a) && !is_thin(b)) return;
    search_.sets.join(a, b);
    search_.layers[as_index(a)].has_pair = search_.layers[as_index(b)].has_pair = true;
    for (const int p : pair.particle) search_.has_pair[as_index(p)] = 1;
  }

  // Takes a contact of a deformable body with a rigid one, if one of its particles has a pair. After all
  // pairs.
  void take_contact(const CachedContact& cached) {
    const int host = cached.host;
    const SurfacePoint point = soft_place(bodies_, cached);
    const auto end = point.particle.begin() + point.count;
    if (std::none_of(point.particle.begin(), end, [&](int p) { return search_.has_pair[as_index(p)] != 0; }))
      return;
    LayerSearch::Layer& layer = search_.layers[body_of(bodies_, point.particle[0])];
    layer.touches = true;
    if (layer.last_host == host) return;  // contacts of one pair follow each other
    layer.last_host = host;
    const RigidProperties& rigid = bodies_.rigid.properties[as_index(host)];
    if (rigid.is_dynamic()) layer.load += rigid.mass;
  }

  // Adds to `chosen` the bodies of all groups that bear a load and lie on something.
  void choose(std::vector<char>& chosen) {
    const std::size_t count = bodies_.deformable.size();
    for (std::size_t d = 0; d < count; ++d) {
      LayerSearch::Layer& layer = search_.layers[d];
      const DeformableBody& body = bodies_.deformable[d];
      if (!layer.has_pair) continue;
      layer.lightest = is_thin(static_cast<int>(d)) ? body.mass : std::numeric_limits<double>::infinity();
      layer.has_thin_contact = is_thin(static_cast<int>(d)) && layer.touches;
      if (!is_thin(static_cast<int>(d))) layer.load += body.mass;
    }
    for (std::size_t d = 0; d < count; ++d) {
      const auto first = as_index(search_.sets.first(static_cast<int>(d)));
      if (first == d || !search_.layers[d].has_pair) continue;
      LayerSearch::Layer& whole = search_.layers[first];
      whole.load += search_.layers[d].load;
      whole.lightest = std::min(whole.lightest, search_.layers[d].lightest);
      whole.has_thin_contact |= search_.layers[d].has_thin_contact;
    }
    for (std::size_t d = 0; d < count; ++d) {
      const LayerSearch::Layer& whole = search_.layers[as_index(search_.sets.first(static_cast<int>(d)))];
      if (search_.layers[d].has_pair && whole.has_thin_contact && whole.load > least_load * whole.lightest)
        chosen[d] = true;
    }
  }

 private:
  bool is_thin(int deformable) const { return bodies_.deformable[as_index(deformable)].thickness > 0; }

  const Bodies& bodies_;
  LayerSearch& search_;
};

}  // namespace

bool may_press_layers(const World& world) {
  const std::vector<DeformableBody>& bodies = world.bodies.deformable;
  return world.has(Effect::self_repulsion) && world.has(Effect::rigid_deformable_contact) &&
         std::any_of(bodies.begin(), bodies.end(),
                     [](const DeformableBody& body) { return body.thickness > 0; });
}

void choose_pressed_layers(World& world, StepContext& context) {
  const Bodies& bodies = world.bodies;
  if (!may_press_layers(world) || !world.has_internal_forces() || world.settings.implicit_elasticity ||
      world.settings.constraints_before_solve)
    return;
  Layers layers(bodies, context.solved.layers);
  for (const RepulsionPair& pair : context.surfaces.repulsion.pairs()) layers.take_pair(pair);
  for (const CachedContact& contact : world.last_step.contact_cache)
    if (contact.guest_rigid < 0) layers.take_contact(contact);
  layers.choose(context.solved.bodies);
}

void find_repulsions_at_start(World& world, StepContext& context) {
  find_repulsions(world, context);
  choose_pressed_layers(world, context);
}

}  // namespace duet
