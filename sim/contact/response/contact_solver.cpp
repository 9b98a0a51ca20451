#include "sim/contact/response/contact_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include <Eigen/LU>

#include "sim/contact/response/contact_update.h"
#include "sim/contact/response/even_pressure.h"

namespace duet {
namespace {

constexpr int shock_iterations = 10;  // Gauss-Seidel sweeps over a group of a shock layer, at most
// Passes over the contacts of a deformable body on a static or kinematic host, at each visit. Two are enough,
// because these contacts hardly affect each other.
constexpr int soft_repeats = 2;
// Value of ContactGraph::carries_shocks for an island that a moving kinematic body drives. Nothing in it
// counts as being at rest, and the energy that shocks add comes from that body.
constexpr char driven = 2;
// Smallest error after the sweeps, in units of their tolerance, at which an island is solved as a whole. A
// smaller value would spend that work on islands that a few more sweeps settle.
constexpr double worth_solving = 30;
// Fractions of the speed |g| dt that gravity gives in a step. `rest_share`: a surface that moves more slowly
// counts as being at rest for shocks, because the sweeps may leave as much. `slide_share`: islands with
// faster relative velocities are not solved as a whole, because friction seldom lets the rounds converge
// there; the solution is not missed either. Below a heavy body the sweeps leave half of |g| dt.
constexpr double rest_share = 0.02, slide_share = 0.6;
constexpr double anything = std::numeric_limits<double>::infinity();  // speed at which nothing is limited

// Updates a contact once. Returns the change of its relative velocity, m/s over its precision. Sweeps spend
// their time here: what it calls becomes part of it, so that the vectors stay in registers.
[[gnu::flatten]] double update_contact(Bodies& bodies, ArticulatedResponse* linked, ContactPoint& contact) {
  const Vec3 velocity = relative_velocity(bodies, contact);
  if (contact.impulse.isZero(0) && !is_pinched_fast(contact) &&
      velocity.dot(contact.normal) >= contact.target)
    return 0;
  const Vec3 total = updated_impulse(contact, contact.response, velocity);
  const Vec3 change = total - contact.impulse;
  if (linked && linked->takes_part(contact))
    linked->apply_impulse(bodies, contact, change);
  else
    apply_impulse(bodies, contact, change);
  contact.impulse = total;
  return (contact.response.K * change).norm() / contact.precision;
}

// Updates rolling and spinning friction of a rigid pair: an angular impulse along the axis of spin, which is
// the mean normal, and one across it. Each is at most its coefficient (m) times the normal impulse of the
// pair. Returns the change of a relative velocity, m/s over the precision of the pair, at the distance of
// half the smallest size of the bodies. Joints are left out of the response K to angular impulses. They only
// lessen it, so that the updates approach the same result in smaller steps.
double update_rotation(Bodies& bodies, ArticulatedResponse* linked, const ContactSet& contacts,
                       ContactPair& pair) {
  Vec3 pressure = Vec3::Zero();
  for (int i = pair.begin; i < pair.end; ++i) {
    const ContactPoint& contact = contacts.points[as_index(i)];
    const double normal_impulse = contact.impulse.dot(contact.normal);
    pressure += (contact.host == pair.host ? normal_impulse : -normal_impulse) * contact.normal;
  }
  const double normal_impulse = pressure.norm();
  if (normal_impulse == 0 && pair.angular_impulse.isZero(0)) return 0;

  const RigidState& host = bodies.rigid.state[as_index(pair.host)];
  const RigidState& guest = bodies.rigid.state[as_index(pair.guest_rigid)];
  const RigidProperties& a = bodies.rigid.properties[as_index(pair.host)];
  const RigidProperties& b = bodies.rigid.properties[as_index(pair.guest_rigid)];
  const Mat3 K = host.inverse_inertia + guest.inverse_inertia;
  const Vec3 relative = guest.angular_velocity - host.angular_velocity;
  const Vec3 wanted = pair.angular_impulse - K.inverse() * relative;
  const Vec3 axis = normal_impulse > 0 ? Vec3(pressure / normal_impulse) : Vec3::UnitY();
  const double spin = wanted.dot(axis);
  const double max_spin = std::max(a.spinning_friction, b.spinning_friction) * normal_impulse;
  const double max_roll = std::max(a.rolling_friction, b.rolling_friction) * normal_impulse;
  Vec3 roll = wanted - spin * axis;
  const double rolling = roll.norm();
  if (rolling > max_roll) roll *= max_roll / rolling;
  const Vec3 total = std::clamp(spin, -max_spin, max_spin) * axis + roll;
  const Vec3 change = total - pair.angular_impulse;
  pair.angular_impulse = total;
  const auto turn = [&](int body, const Vec3& moment) {
    const auto i = as_index(body);
    if (!linked || !linked->contains(body))
      return apply_angular_impulse(bodies.rigid.state[i], bodies.rigid.properties[i], moment);
    Vec6 wrench = Vec6::Zero();
    wrench.tail<3>() = moment;
    linked->push(bodies.rigid, body, wrench);
  };
  turn(pair.guest_rigid, change);
  turn(pair.host, -change);
  const double arm = std::min(a.shape.min_size(), b.shape.min_size()) / 2;
  return (K * change).norm() * arm / contacts.points[as_index(pair.begin)].precision;
}

// Updates the contacts of one pair in several passes to and fro, so that the order of its points does not
// tilt a face that lands flat. Contacts without an impulse after the first pass, two thirds of the contacts
// of a pile, wait for the next visit. Returns the largest change of a relative velocity in the first pass,
// or by the load as a whole, m/s over its precision.
double update_pair(Bodies& bodies, ArticulatedResponse* linked, const ContactSolveSettings& settings,
                   ContactSet& contacts, ContactPair& pair) {
  double first = 0, load = 0;
  if (pair.patches > 0 && contacts.points[as_index(pair.begin)].friction > 0) {
    if (linked) load = load_evenly(bodies, *linked, settings.tolerance, pair, contacts);
    spread_evenly(bodies, settings.tolerance, pair, contacts);
  }
  const bool apart = pair.guest_rigid < 0 && !bodies.rigid.properties[as_index(pair.host)].is_dynamic();
  const int repeats = apart ? std::min(settings.repeats, soft_repeats) : settings.repeats;
  for (int repeat = 0; repeat < repeats; ++repeat) {
    double largest = 0;
    for (int k = pair.begin; k < pair.end; ++k) {
      const int i = repeat % 2 == 0 ? k : pair.end - 1 - (k - pair.begin);
      ContactPoint& contact = contacts.points[as_index(i)];
      if (repeat > 0 && contact.impulse.isZero(0)) continue;
      largest = std::max(largest, update_contact(bodies, linked, contact));
    }
    if (settings.angular_friction && pair.guest_rigid >= 0)
      largest = std::max(largest, update_rotation(bodies, linked, contacts, pair));
    if (repeat == 0) first = largest;
    if (largest < settings.tolerance) break;
  }
  return std::max(first, load);
}

// An update of a contact by an impulse on its upper body alone, as if the lower one were fixed. `at_rest`
// (m/s) bounds the velocity of a lower surface that counts as being at rest.
class UpperUpdate {
 public:
  UpperUpdate(Bodies& bodies, double tolerance, double at_rest, int upper)
      : state_(bodies.rigid.state[as_index(upper)]),
        properties_(bodies.rigid.properties[as_index(upper)]),
        bodies_(bodies),
        tolerance_(tolerance),
        at_rest_(at_rest),
        upper_(upper) {}

  double operator()(ContactPoint& contact) {
    const Vec3 velocity = relative_velocity(bodies_, contact);
    const double error = contact.target - velocity.dot(contact.normal);
    if (std::abs(error) < tolerance_ * contact.precision || (contact.impulse.isZero(0) && error < 0))
      return 0;
    const bool upper_is_guest = contact.guest_rigid == upper_;
    const Vec3 lower = own_motion(contact, upper_is_guest);
    const double towards = lower.dot(contact.normal);
    if (std::abs(towards) > at_rest_) return 0;
    const bool rolls = (lower - towards * contact.normal).norm() > at_rest_;
    const Vec3& arm = upper_is_guest ? contact.guest_arm : contact.host_arm;
    const ContactResponse response(impulse_factor(state_, properties_.inverse_mass, arm), contact.normal);
    const Vec3 total =
        rolls ? updated_pressure(contact, response, velocity) : updated_impulse(contact, response, velocity);
    const Vec3 change = total - contact.impulse;
    apply_impulse(state_, properties_, arm, upper_is_guest ? change : Vec3(-change));
    contact.impulse = total;
    return (response.K * change).norm() / contact.precision;
  }

 private:
  // Returns the part of the velocity of the lower body's surface that shocks must not follow, m/s: its
  // component along the normal, and the tangential velocity by rolling. Sliding and turning about the normal
  // are left out, because they may take the upper body along.
  Vec3 own_motion(const ContactPoint& contact, bool upper_is_guest) const {
    const RigidState& lower =
        bodies_.rigid.state[as_index(upper_is_guest ? contact.host : contact.guest_rigid)];
    const Vec3 &n = contact.normal, &arm = upper_is_guest ? contact.host_arm : contact.guest_arm;
    const Vec3 rolling = (lower.angular_velocity - lower.angular_velocity.dot(n) * n).cross(arm);
    return point_velocity(lower, arm).dot(n) * n + rolling - rolling.dot(n) * n;
  }

  RigidState& state_;
  const RigidProperties& properties_;
  const Bodies& bodies_;
  double tolerance_, at_rest_;
  int upper_;
};

// Returns the largest relative velocity at contacts of `pairs` that hold an impulse, m/s.
double fastest(const Bodies& bodies, const ContactSet& contacts, std::span<const int> pairs) {
  double squared = 0;
  for (const int p : pairs)
    for (int i = contacts.pairs[as_index(p)].begin; i < contacts.pairs[as_index(p)].end; ++i)
      if (const ContactPoint& contact = contacts.points[as_index(i)]; !contact.impulse.isZero(0))
        squared = std::max(squared, relative_velocity(bodies, contact).squaredNorm());
  return std::sqrt(squared);
}

// Solves as a whole those islands of a few rigid bodies that sweeps have left unsettled. Marks the islands
// that have converged in scratch.is_solved, and returns whether there are any.
bool solve_small_islands(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                         ContactSet& contacts, ContactSolveScratch& scratch) {
  std::vector<std::array<int, 2>>& unsettled = scratch.unsettled;
  unsettled.clear();
  for (std::size_t i = 0; i < graph.pairs.size(); ++i) {
    const ContactPair& pair = contacts.pairs[as_index(graph.pairs[i])];
    const int island = graph.island_of(bodies, pair);
    if (pair.active && graph.carries_shocks[as_index(island)] != 0 &&
        scratch.island_change[as_index(island)] > worth_solving * settings.tolerance)
      unsettled.push_back({island, static_cast<int>(i)});
  }
  std::sort(unsettled.begin(), unsettled.end());
  scratch.is_solved.assign(graph.island.size(), 0);
  bool is_any = false;
  for (std::size_t begin = 0, end = 0; begin < unsettled.size(); begin = end) {
    scratch.island_pairs.clear();
    for (; end < unsettled.size() && unsettled[end][0] == unsettled[begin][0]; ++end)
      scratch.island_pairs.push_back(graph.pairs[as_index(unsettled[end][1])]);
    if (scratch.island_pairs.size() > IslandSolver::max_pairs ||
        fastest(bodies, contacts, scratch.island_pairs) > slide_share * settings.fall)
      continue;
    const double left =
        scratch.island_solver.solve(bodies, scratch.island_pairs, settings.tolerance, contacts);
    if (!(left < settings.tolerance)) continue;
    scratch.is_solved[as_index(unsettled[begin][0])] = 1;
    is_any = true;
  }
  return is_any;
}

// One call of solve_contact() for the islands with joints, or for those without.
class IslandSweeps {
 public:
  IslandSweeps(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
               ContactSet& contacts, ContactSolveScratch& scratch, ArticulatedResponse* linked, bool jointed)
      : bodies_(bodies),
        graph_(graph),
        settings_(settings),
        contacts_(contacts),
        scratch_(scratch),
        linked_(linked),
        jointed_(jointed) {}

  // Returns the number of sweeps.
  int run(int iterations) {
    scratch_.multipliers_final.assign(graph_.island.size(), 0);
    pass_over([&](std::size_t island) { return !is_ours(island); });
    int sweeps = repeat(iterations);
    if (sweeps < iterations) return sweeps;
    if (settings_.whole_islands && solve_small_islands(bodies_, graph_, settings_, contacts_, scratch_))
      sweeps += repeat_among(iterations, scratch_.is_solved);
    if (settings_.cold_iterations > 0) sweeps += repeat_among(settings_.cold_iterations, contacts_.is_cold);
    return sweeps;
  }

 private:
  bool is_ours(std::size_t island) const { return (graph_.is_jointed[island] != 0) == jointed_; }

  template <class Test>
  void pass_over(Test&& test) {
    for (std::size_t i = 0; i < scratch_.multipliers_final.size(); ++i)
      if (test(i)) scratch_.multipliers_final[i] = 1;
  }

  std::size_t island_of(const ContactPair& pair) const { return as_index(graph_.island_of(bodies_, pair)); }

  double update(int p) {
    ContactPair& pair = contacts_.pairs[as_index(p)];
    if (!pair.active || scratch_.multipliers_final[island_of(pair)] != 0) return 0.0;
    return scratch_.change[as_index(p)] = update_pair(bodies_, linked_, settings_, contacts_, pair);
  }

  // Every island is swept until it has settled, because bodies that do not touch do not affect each other.
  // Articulated response connects islands, so that these are swept until all of them have settled.
  void settle() {
    scratch_.island_change.assign(graph_.island.size(), 0);
    for (const int p : graph_.pairs) {
      const std::size_t island = island_of(contacts_.pairs[as_index(p)]);
      double& largest = scratch_.island_change[island];
      if (is_ours(island)) largest = std::max(largest, scratch_.change[as_index(p)]);
    }
    const bool are_connected = linked_ && jointed_;
    for (std::size_t i = 0; i < scratch_.island_change.size(); ++i)
      scratch_.multipliers_final[i] = scratch_.island_change[i] < settings_.tolerance && !are_connected;
    pass_over([&](std::size_t island) { return !is_ours(island); });
  }

  int repeat(int most) {
    return graph_.sweeps.repeat(
        most, settings_.tolerance, [&](int p) { return update(p); }, [&] { settle(); });
  }

  int repeat_among(int most, const std::vector<char>& among) {
    const auto look = [&] {
      settle();
      pass_over([&](std::size_t island) { return among[island] == 0; });
    };
    look();
    return graph_.sweeps.repeat(
        most, settings_.tolerance, [&](int p) { return update(p); }, look);
  }

  Bodies& bodies_;
  const ContactGraph& graph_;
  const ContactSolveSettings& settings_;
  ContactSet& contacts_;
  ContactSolveScratch& scratch_;
  ArticulatedResponse* linked_;
  bool jointed_;
};

}  // namespace

int solve_contact(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                  ContactSet& contacts, ContactSolveScratch& scratch, ArticulatedResponse* linked) {
  scratch.change.assign(contacts.pairs.size(), 0);
  const auto solve = [&](bool jointed, int iterations) {
    const auto is_of_kind = [&](int p) {
      const int island = graph.island_of(bodies, contacts.pairs[as_index(p)]);
      return (graph.is_jointed[as_index(island)] != 0) == jointed;
    };
    if (iterations == 0 || std::none_of(graph.pairs.begin(), graph.pairs.end(), is_of_kind)) return 0;
    return IslandSweeps(bodies, graph, settings, contacts, scratch, linked, jointed).run(iterations);
  };
  const int free = solve(false, settings.iterations);
  return std::max(free, solve(true, settings.jointed_iterations));
}

void propagate_shocks(Bodies& bodies, const ContactGraph& graph, const ContactSolveSettings& settings,
                      ContactSet& contacts) {
  const auto is_reached = [&](const ContactPair& pair) {
    return pair.active &&
           (settings.shocks_everywhere || graph.carries_shocks[as_index(graph.island_of(bodies, pair))] != 0);
  };
  const auto update = [&](const ContactPair& pair) {
    const int host_level = graph.level[as_index(pair.host)],
              guest_level = graph.level[as_index(pair.guest_rigid)];
    double largest = 0;
    if (host_level == guest_level) {
      for (int i = pair.begin; i < pair.end; ++i)
        largest = std::max(largest, update_contact(bodies, nullptr, contacts.points[as_index(i)]));
      return largest;
    }
    const bool is_driven = graph.carries_shocks[as_index(graph.island_of(bodies, pair))] == driven;
    UpperUpdate update_upper(bodies, settings.tolerance, is_driven ? anything : rest_share * settings.fall,
                             host_level > guest_level ? pair.host : pair.guest_rigid);
    for (int i = pair.begin; i < pair.end; ++i)
      largest = std::max(largest, update_upper(contacts.points[as_index(i)]));
    return largest;
  };
  graph.shock_layers.for_each([&](std::span<const int> pairs) {
    for (int iteration = 0; iteration < shock_iterations; ++iteration) {
      double largest = 0;
      for (const int p : pairs)
        if (is_reached(contacts.pairs[as_index(p)]))
          largest = std::max(largest, update(contacts.pairs[as_index(p)]));
      if (largest < settings.tolerance) break;
    }
  });
}

int count_active(const ContactSet& contacts, const ContactGraph& graph) {
  int active = 0;
  for (int p : graph.schedule.order())
    for (int i = contacts.pairs[as_index(p)].begin; i < contacts.pairs[as_index(p)].end; ++i)
      if (!contacts.points[as_index(i)].impulse.isZero(0)) ++active;
  return active;
}

}  // namespace duet
