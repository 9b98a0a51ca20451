// Contacts outside of a time step: those that detection finds in a scene as it stands, or pairs that a test
// puts together.
#pragma once

#include <initializer_list>

#include "tests/support/scenes.h"

#include "sim/contact/detection/contact_candidates.h"
#include "sim/contact/graph/contact_graph.h"
#include "sim/step/world.h"

namespace duet::test {

// Returns a change of velocity that is zero for all bodies.
inline VelocityState no_change(const Bodies& bodies) {
  VelocityState now, change;
  store_velocities(bodies, now);
  velocity_difference(bodies, now, change);
  return change;
}

// A simulation of a scene, with the contacts that its bodies can make within `dt` (s) and their contact
// graph.
struct ContactScene {
  Simulation simulation;
  Bodies& bodies;  // those of `simulation`
  ContactSet contacts;
  ContactGraph graph;

  // Builds the scene and finds its contacts.
  ContactScene(const scene::Scene& scene, double dt)
      : simulation(scene, plan(scene)), bodies(simulation.world().bodies) {
    find(dt);
  }
  // Replaces contacts and graph by those of the bodies as they are now.
  void find(double dt) {
    find_candidates(bodies, {}, dt, no_change(bodies), contacts);
    build_contact_graph(bodies, simulation.world().gravity, RigidPairs::are_active, contacts, graph);
  }
  // The state of a rigid body.
  RigidState& state(std::size_t body) { return bodies.rigid.state[body]; }
};

// Returns `count` rigid balls with a radius of 1 m and 1 kg, all at the origin. Those listed in `fixed` are
// static.
inline Bodies loose_bodies(int count, std::initializer_list<int> fixed = {}) {
  Bodies bodies;
  RigidProperties ball;
  ball.shape = LevelSet::sphere(1);
  ball.mass = ball.inverse_mass = 1;
  ball.inertia = Vec3::Constant(0.4);
  bodies.rigid.properties.assign(as_index(count), ball);
  bodies.rigid.state.resize(as_index(count));
  bodies.rigid.name.resize(as_index(count));
  for (int body : fixed) {
    RigidProperties& properties = bodies.rigid.properties[as_index(body)];
    properties.mass = properties.inverse_mass = 0;
    properties.inertia.setZero();
  }
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i)
    update_orientation_dependents(bodies.rigid.state[i], bodies.rigid.properties[i]);
  return bodies;
}

// Appends a pair of rigid bodies with one contact, whose unit `normal` points from host to guest.
inline ContactPair& add_pair(ContactSet& contacts, int host, int guest, const Vec3& normal) {
  ContactPoint point;
  point.host = host;
  point.guest_rigid = guest;
  point.feature = FeatureId::point(0);
  point.normal = normal;
  ContactPair pair;
  pair.host = host;
  pair.guest_rigid = guest;
  pair.begin = static_cast<int>(contacts.points.size());
  pair.end = pair.begin + 1;
  contacts.points.push_back(point);
  contacts.pairs.push_back(pair);
  return contacts.pairs.back();
}

}  // namespace duet::test
