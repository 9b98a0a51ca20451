#include "sim/contact/graph/contact_graph.h"

#include <algorithm>

namespace duet {
namespace {

// Smallest |n . up| at which a contact counts as support, for its unit normal n: planes steeper than about 84
// degrees do not count, because bodies side by side do not carry each other. A larger value would leave steep
// contacts out of the graph.
constexpr double min_slope = 0.1;

bool is_fixed(const Bodies& bodies, int body) {
  return as_index(body) < bodies.rigid.size() && !bodies.rigid.properties[as_index(body)].is_dynamic();
}

// Returns the unit normal at the deepest contact point of a pair, from its host to its guest.
Vec3 deepest_normal(const ContactSet& contacts, const ContactPair& pair) {
  const ContactPoint* deepest = &contacts.points[as_index(pair.begin)];
  for (int i = pair.begin + 1; i < pair.end; ++i)
    if (contacts.points[as_index(i)].gap < deepest->gap) deepest = &contacts.points[as_index(i)];
  return deepest->host == pair.host ? deepest->normal : Vec3(-deepest->normal);
}

// Groups `values` by their `keys` in [0, count). On return, the values of key k are `sorted` from begin[k] to
// begin[k + 1], in their given order.
void group(const std::vector<int>& keys, const std::vector<int>& values, std::size_t count,
           std::vector<int>& begin, std::vector<int>& sorted) {
  begin.assign(count + 1, 0);
  for (int key : keys) ++begin[as_index(key)];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  sorted.resize(values.size());
  for (std::size_t i = values.size(); i-- > 0;) sorted[as_index(--begin[as_index(keys[i])])] = values[i];
}

// Fills the edges of the graph, from each body to those that support it: `first_support` and `support`.
void find_supports(const Bodies& bodies, const Vec3& gravity, const ContactSet& contacts,
                   ContactGraph& graph) {
  graph.above.clear();
  graph.below.clear();
  const Vec3 up = gravity.isZero(0) ? Vec3::Zero() : Vec3(-gravity.normalized());
  for (int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const int guest = static_cast<int>(guest_node(bodies, pair));
    const double slope = deepest_normal(contacts, pair).dot(up);
    if (std::abs(slope) < min_slope) continue;
    graph.above.push_back(slope > 0 ? guest : pair.host);
    graph.below.push_back(slope > 0 ? pair.host : guest);
  }
  group(graph.above, graph.below, graph.level.size(), graph.first_support, graph.support);
}

// Ranks bodies by Tarjan's algorithm for strongly connected components, without recursion. The algorithm
// completes a component after all components that support it, so that these have their levels by then.
class Ranking {
 public:
  Ranking(const Bodies& bodies, ContactGraph& graph) : bodies_(bodies), graph_(graph) {
    const std::size_t n = graph.level.size();
    graph_.number.assign(n, -1);
    graph_.lowest.assign(n, 0);
    graph_.next.assign(n, 0);
    graph_.open.assign(n, 0);
    graph_.path.clear();
    graph_.component.clear();
  }

  // Searches all bodies that lead down from `root`, and ranks those that have no level yet.
  void search_from(int root) {
    if (graph_.number[as_index(root)] >= 0) return;
    enter(root);
    while (!graph_.path.empty()) {
      const int body = graph_.path.back();
      const auto b = as_index(body);
      if (graph_.next[b] == graph_.first_support[b + 1]) {
        leave(body);
        continue;
      }
      const int below = graph_.support[as_index(graph_.next[b]++)];
      if (is_fixed(bodies_, below)) continue;
      if (graph_.number[as_index(below)] < 0)
        enter(below);
      else if (graph_.open[as_index(below)])
        graph_.lowest[b] = std::min(graph_.lowest[b], graph_.number[as_index(below)]);
    }
  }

 private:
  void enter(int body) {
    const auto b = as_index(body);
    graph_.number[b] = graph_.lowest[b] = counter_++;
    graph_.next[b] = graph_.first_support[b];
    graph_.open[b] = 1;
    graph_.path.push_back(body);
    graph_.component.push_back(body);
  }

  // Ends the search below `body`; ranks its component if `body` is the root of it.
  void leave(int body) {
    const auto b = as_index(body);
    graph_.path.pop_back();
    if (!graph_.path.empty()) {
      int& parent = graph_.lowest[as_index(graph_.path.back())];
      parent = std::min(parent, graph_.lowest[b]);
    }
    if (graph_.lowest[b] != graph_.number[b]) return;
    auto first = graph_.component.end();
    while (*--first != body) continue;
    rank(first, graph_.component.end());
    graph_.component.erase(first, graph_.component.end());
  }

  // Gives the bodies of a component their level, one more than that of their highest support.
  void rank(std::vector<int>::const_iterator first, std::vector<int>::const_iterator last) {
    int level = 0;
    char supported = 0;
    for (auto member = first; member != last; ++member) {
      graph_.open[as_index(*member)] = 0;
      for (int i = graph_.first_support[as_index(*member)]; i < graph_.first_support[as_index(*member) + 1];
           ++i) {
        const int below = graph_.support[as_index(i)];  // members of the component still have level 0
        level = std::max(level, graph_.level[as_index(below)]);
        supported |= graph_.supported[as_index(below)];
      }
    }
    for (auto member = first; member != last; ++member) {
      graph_.level[as_index(*member)] = level + 1;
      graph_.supported[as_index(*member)] = supported;
    }
  }

  const Bodies& bodies_;
  ContactGraph& graph_;
  int counter_ = 0;
};

// Fills `first_pair` and `pair_of_body` in the order of the schedule.
void list_pairs_of_bodies(const Bodies& bodies, const ContactSet& contacts, ContactGraph& graph) {
  std::vector<int>&body = graph.above, &pair_index = graph.below;
  body.clear();
  pair_index.clear();
  for (int p : graph.schedule.order()) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    body.push_back(pair.host);
    pair_index.push_back(p);
    if (pair.guest_rigid < 0) continue;
    body.push_back(pair.guest_rigid);
    pair_index.push_back(p);
  }
  group(body, pair_index, bodies.rigid.size(), graph.first_pair, graph.pair_of_body);
}

// Joins the movable bodies of every active pair.
void find_islands(const Bodies& bodies, const ContactSet& contacts, ContactGraph& graph) {
  graph.joined.reset(graph.level.size());
  for (int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const int guest = static_cast<int>(guest_node(bodies, pair));
    if (is_fixed(bodies, pair.host) || is_fixed(bodies, guest)) continue;
    graph.joined.join(pair.host, guest);
  }
  graph.island.resize(graph.level.size());
  for (int body = 0; body < static_cast<int>(graph.island.size()); ++body)
    graph.island[as_index(body)] = graph.joined.first(body);
}

// Returns whether a body is kinematic and moves now.
bool is_moving_fixed(const Bodies& bodies, int body) {
  if (!is_fixed(bodies, body)) return false;
  const RigidState& state = bodies.rigid.state[as_index(body)];
  return !(state.velocity.isZero(0) && state.angular_velocity.isZero(0));
}

// Fills `carries_shocks`.
void find_where_shocks_pass(const Bodies& bodies, const ContactSet& contacts, ContactGraph& graph) {
  graph.carries_shocks.assign(graph.island.size(), 1);
  for (const int p : graph.pairs) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    const int guest = static_cast<int>(guest_node(bodies, pair));
    const bool is_driven = is_moving_fixed(bodies, pair.host) || is_moving_fixed(bodies, guest);
    if (is_driven) graph.carries_shocks[as_index(graph.island_of(bodies, pair))] = 2;
  }
  // Keeps shocks out of the island of a body.
  const auto bar = [&](std::size_t body) { graph.carries_shocks[as_index(graph.island[body])] = 0; };
  for (std::size_t d = 0; d < bodies.deformable.size(); ++d) bar(bodies.rigid.size() + d);
  for (const EmbeddedParticle& bound : bodies.bound) bar(bound.body);
  for (const Joint& joint : bodies.articulation.joints) {
    bar(as_index(joint.parent));
    bar(as_index(joint.child));
  }
}

// Fills `is_jointed`.
void find_jointed(const Bodies& bodies, ContactGraph& graph) {
  graph.is_jointed.assign(graph.island.size(), 0);
  if (bodies.articulation.joints.empty()) return;
  const auto mark = [&](std::size_t body) { graph.is_jointed[as_index(graph.island[body])] = 1; };
  graph.has_joint.assign(bodies.rigid.size(), 0);
  for (const Joint& joint : bodies.articulation.joints)
    for (const int body : {joint.parent, joint.child})
      if (!is_fixed(bodies, body)) graph.has_joint[as_index(body)] = 1;
  for (std::size_t body = 0; body < graph.has_joint.size(); ++body)
    if (graph.has_joint[body] != 0) mark(body);
  std::size_t d = 0;  // the deformable body of the last bound particle
  const auto is_of = [&](std::size_t particle, const DeformableBody& body) {
    const int place = static_cast<int>(particle) - body.first_particle;
    return place >= 0 && place < body.particle_count;
  };
  for (const EmbeddedParticle& bound : bodies.bound) {
    if (graph.has_joint[bound.body] == 0) continue;
    while (!is_of(bound.particle, bodies.deformable[d])) d = (d + 1) % bodies.deformable.size();
    mark(bodies.rigid.size() + d);
  }
}

}  // namespace

int ContactGraph::island_of(const Bodies& bodies, const ContactPair& pair) const {
  const auto host = as_index(pair.host);
  return island[is_fixed(bodies, pair.host) ? guest_node(bodies, pair) : host];
}

void build_contact_graph(const Bodies& bodies, const Vec3& gravity, RigidPairs rigid_pairs,
                         ContactSet& contacts, ContactGraph& graph) {
  graph.pairs.clear();
  for (std::size_t i = 0; i < contacts.pairs.size(); ++i) {
    ContactPair& pair = contacts.pairs[i];
    pair.active = pair.guest_rigid < 0 || rigid_pairs == RigidPairs::are_active;
    if (pair.active) graph.pairs.push_back(static_cast<int>(i));
  }
  const std::size_t n = bodies.rigid.size() + bodies.deformable.size();
  graph.level.assign(n, 0);
  graph.supported.assign(n, 0);
  find_supports(bodies, gravity, contacts, graph);
  Ranking ranking(bodies, graph);
  for (int body = 0; body < static_cast<int>(n); ++body)
    if (is_fixed(bodies, body)) graph.supported[as_index(body)] = 1;
  for (int body = 0; body < static_cast<int>(n); ++body)
    if (!is_fixed(bodies, body)) ranking.search_from(body);

  for (int p : graph.pairs) {
    ContactPair& pair = contacts.pairs[as_index(p)];
    pair.level = std::max(graph.level[as_index(pair.host)], graph.level[guest_node(bodies, pair)]);
  }
  find_islands(bodies, contacts, graph);
  find_where_shocks_pass(bodies, contacts, graph);
  find_jointed(bodies, graph);
  graph.schedule.build(bodies, contacts, graph.pairs);
  graph.sweeps.build(bodies, contacts, graph.schedule.order());
  graph.shock_layers_current = false;
  list_pairs_of_bodies(bodies, contacts, graph);
}

void build_shock_layers(const ContactSet& contacts, ContactGraph& graph) {
  if (graph.shock_layers_current) return;
  graph.shock_layers.build(contacts, graph.schedule.order(), graph.level, graph.supported);
  graph.shock_layers_current = true;
}

}  // namespace duet
