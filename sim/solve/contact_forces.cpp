#include "sim/solve/contact_forces.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"
#include "sim/contact/response/ledger.h"
#include "sim/contact/response/row_velocity.h"

namespace duet {
namespace {

// Stiffness of a contact over the mass that it moves. That mass is the block of a particle with its damping
// and elasticity, combined with the mass of its body, which bounds it. A larger value would make the search
// one between nearly rigid contacts.
constexpr double stiffness_share = 100;

// Least mass of a rigid body in the choice of stiffness, over that of the heaviest body on its island. The
// heaviest body may lean on it, and a stiffness by the mass of a light body alone would give way under the
// load.
constexpr double min_mass_share = 0.1;

// Returns the tangential part of `v`.
Vec3 tangent_of(const Vec3& v, const Vec3& normal) { return v - v.dot(normal) * normal; }

// Returns the velocity of a point per impulse there, 1/kg, if every particle moves by its own block.
Mat3 response_of(const SurfacePoint& point, const std::vector<SymmetricBlock>& own) {
  Mat3 K = Mat3::Zero();
  for (std::size_t i = 0; i < as_index(point.count); ++i) {
    const SymmetricBlock& block = own[as_index(point.particle[i])];
    const double share = point.weight[i] * point.weight[i];
    K.diagonal() += share * block.diagonal;
    const Vec3 other = share * block.other;
    K(1, 2) += other.x(), K(2, 1) += other.x();
    K(0, 2) += other.y(), K(2, 0) += other.y();
    K(0, 1) += other.z(), K(1, 0) += other.z();
  }
  return K;
}

// Returns the index of the deformable body that a particle belongs to.
std::size_t body_of(const Bodies& bodies, int particle) {
  const auto after =
      std::upper_bound(bodies.deformable.begin(), bodies.deformable.end(), particle,
                       [](int p, const DeformableBody& body) { return p < body.first_particle; });
  return static_cast<std::size_t>(after - bodies.deformable.begin()) - 1;
}

// Returns the matrix S, by which impulses must be changed so that the first element of a pair gets what is
// asked for. `given` is the fraction G that it gets, all of those along the normal n. With T = P G P, where P
// takes the normal component away,
//   S = n n^T + (1 - n n^T G) T^+,
// where T^+ inverts T in the plane. In directions in which less than half is given, as between nearly
// parallel edges, S becomes smaller again, and the element gets less than what is asked for.
Mat3 compensation(const Vec3& normal, const Mat3& given) {
  constexpr double least_kept = 0.5;
  const Mat3 along = normal * normal.transpose(), across = Mat3::Identity() - along;
  const Mat3 T = across * given * across;
  const SymmetricEigen<3> eigen = symmetric_eigen<3>(T.transpose() * T);
  Mat3 inverse = Mat3::Zero();
  for (int k = 0; k < 3; ++k)
    inverse += eigen.vectors.col(k) * eigen.vectors.col(k).transpose() /
               std::max(eigen.values[k], least_kept * least_kept);
  inverse = inverse * T.transpose();
  return along + inverse - along * given * inverse;
}

// Returns the matrices A_i of the relative velocity sum A_i v_i of a pair of points, without the rotation of
// its particles as a whole:
//   A_i = S^T (w_i 1 + m_i [arm]x I^-1 [r_i]x),
// with `arm` between the points, r_i from the center of mass of the particles, their inertia I about it, and
// S from compensation(). Impulses that change v_i by A_i^T j / m_i have no moment, and change the momentum of
// the first element by j. If a particle is held, A_i = w_i 1, because it takes moments up.
std::array<Mat3, 4> map_of(const RepulsionPair& pair, const Particles& particles) {
  std::array<Mat3, 4> map;
  std::array<Vec3, 4> at;
  Vec3 center = Vec3::Zero();
  const Vec3 arm = pair.distance * pair.normal;
  double mass = 0;
  bool is_free = true;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto p = as_index(pair.particle[i]);
    map[i] = pair.weight[i] * Mat3::Identity();
    at[i] = particles.x[p];
    is_free = is_free && particles.inverse_mass[p] > 0;
    center += particles.mass[p] * at[i];
    mass += particles.mass[p];
  }
  if (!is_free) return map;
  center /= mass;
  Mat3 inertia = Mat3::Zero();
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 r = at[i] - center;
    inertia +=
        particles.mass[as_index(pair.particle[i])] * (r.squaredNorm() * Mat3::Identity() - r * r.transpose());
  }
  // Keeps I invertible if the particles lie on a line. A larger value would turn other pairs by less than
  // their moment asks for, relatively by about as much.
  constexpr double regularization = 1e-14;
  inertia.diagonal().array() += regularization * inertia.trace();
  const Mat3 turn = skew(arm) * inertia.inverse();
  for (std::size_t i = 0; i < 4; ++i)
    map[i] += particles.mass[as_index(pair.particle[i])] * turn * skew(at[i] - center);
  Mat3 given = Mat3::Zero();
  for (std::size_t i = 0; i < as_index(pair.first); ++i) given += map[i].transpose();
  const Mat3 more = compensation(pair.normal, given).transpose();
  for (Mat3& each : map) each = more * each;
  return map;
}

// Returns the force of a pair in `forces`, N; zero if it is not among them.
Vec3 force_of(const RepulsionPair& pair, const PairForces& forces) {
  const auto found = std::lower_bound(
      forces.begin(), forces.end(), pair.particle,
      [](const PairForce& a, const std::array<int, 4>& particle) { return a.particle < particle; });
  return found != forces.end() && found->particle == pair.particle ? found->force : Vec3::Zero();
}

// Adds `share` times a symmetric matrix to a block.
void add(double share, const Mat3& matrix, SymmetricBlock& block) {
  block.diagonal += share * matrix.diagonal();
  block.other += share * Vec3(matrix(1, 2), matrix(0, 2), matrix(0, 1));
}

// Adds J^T S J to the block of a rigid body, with S = `slope` and J = (1, -[arm]x).
void add_wrenches(const Mat3& slope, const Vec3& arm, Mat6& block) {
  const Mat3 cross = skew(arm), turned = cross * slope;
  block.topLeftCorner<3, 3>() += slope;
  block.bottomLeftCorner<3, 3>() += turned;
  block.topRightCorner<3, 3>() += turned.transpose();
  block.bottomRightCorner<3, 3>() -= turned * cross;
}

}  // namespace

void ContactForces::build(const Bodies& bodies, const ContactSet& contacts, const ContactGraph& graph,
                          const Islands& islands, double factor, const std::vector<SymmetricBlock>& own) {
  DUET_ASSERT(factor >= 0 && own.size() == bodies.particles.size());
  bodies_ = &bodies;
  rows_.clear();
  out_of_reach_.clear();
  pair_maps_.clear();
  find_heaviest(islands);
  const auto is_solved = [&](const ContactPair& pair) {
    if (islands.is_searched_rigid(as_index(pair.host))) return true;
    if (pair.guest_rigid >= 0) return islands.is_searched_rigid(as_index(pair.guest_rigid));
    const int particle = bodies.deformable[as_index(pair.guest_deformable)].first_particle;
    return islands.is_searched(as_index(islands.of_particle(particle)));
  };
  for (const int p : graph.schedule.order()) {
    const ContactPair& pair = contacts.pairs[as_index(p)];
    if (!pair.active || !is_solved(pair)) continue;
    const double of_body =
        pair.guest_rigid < 0 ? 1 / bodies.deformable[as_index(pair.guest_deformable)].mass : 0;
    for (int i = pair.begin; i < pair.end; ++i) {
      const ContactPoint& contact = contacts.points[as_index(i)];
      if (std::isinf(contact.target)) {
        out_of_reach_.push_back(i);
        continue;
      }
      DUET_ASSERT(is_unit(contact.normal));
      Row row{.contact = i,
              .host = contact.host,
              .guest_rigid = contact.guest_rigid,
              .moves_host = moves_host(bodies, contact),
              .point = {},
              .normal = contact.normal,
              .host_arm = contact.host_arm,
              .guest_arm = contact.guest_arm,
              .path_velocity = contact.path_velocity,
              .target = contact.target,
              .friction = contact.friction,
              .multiplier = factor * contact.impulse};
      Mat3 K = row.moves_host ? rigid_response(row.host, row.host_arm, islands) : Mat3::Zero();
      if (contact.is_rigid_pair()) {
        K += rigid_response(row.guest_rigid, row.guest_arm, islands);
      } else {
        row.point = surface_point(bodies, contact);
        K += response_of(row.point, own);
        K.diagonal().array() += of_body;
      }
      add_row(row, K);
    }
  }
}

void ContactForces::find_heaviest(const Islands& islands) {
  heaviest_.assign(islands.size(), 0);
  const auto take = [&](int island, double mass) {
    if (island >= 0) heaviest_[as_index(island)] = std::max(heaviest_[as_index(island)], mass);
  };
  for (const DeformableBody& body : bodies_->deformable)
    take(islands.of_particle(body.first_particle), body.mass);
  for (std::size_t i = 0; i < bodies_->rigid.size(); ++i)
    if (bodies_->rigid.properties[i].is_dynamic())
      take(islands.of_rigid(i), bodies_->rigid.properties[i].mass);
}

Mat3 ContactForces::rigid_response(int body, const Vec3& arm, const Islands& islands) const {
  const auto b = as_index(body);
  const RigidProperties& properties = bodies_->rigid.properties[b];
  if (!properties.is_dynamic()) return Mat3::Zero();
  const double least = min_mass_share * heaviest_[as_index(islands.of_rigid(b))];
  return std::min(1.0, properties.mass / least) *
         impulse_factor(bodies_->rigid.state[b], properties.inverse_mass, arm);
}

void ContactForces::add_row(Row& row, const Mat3& response) {
  const double of_normal = row.normal.dot(response * row.normal);
  if (!(of_normal > 0)) return;  // neither side can move along the normal
  row.normal_mass = stiffness_share / of_normal;
  // A point that can move along its normal only has no response along the surface. This fraction of the
  // normal one bounds its tangential mass; a smaller one would make friction that much stiffer than the
  // contact.
  constexpr double min_response = 1e-3;
  row.tangential_mass =
      stiffness_share / std::max((response.trace() - of_normal) / 2, min_response * of_normal);
  row.impulse = row.multiplier;
  rows_.push_back(row);
}

void ContactForces::add_pairs(const Bodies& bodies, const std::vector<RepulsionPair>& pairs,
                              const Islands& islands, double seconds, double part_share,
                              const PairForces& forces, double duration,
                              const std::vector<SymmetricBlock>& own) {
  DUET_ASSERT(bodies_ == &bodies && seconds > 0 && duration > 0 && own.size() == bodies.particles.size());
  for (const RepulsionPair& pair : pairs) {
    DUET_ASSERT(is_unit(pair.normal));
    const auto is_left_out = [&](int p) {
      return !is_held(bodies.particles, as_index(p)) &&
             !islands.is_searched(as_index(islands.of_particle(p)));
    };
    if (std::any_of(pair.particle.begin(), pair.particle.end(), is_left_out)) continue;
    const double lacking = pair.thickness - pair.distance;
    Row row{.contact = -1,
            .pair = static_cast<int>(pair_maps_.size()),
            .host = -1,
            .guest_rigid = -1,
            .moves_host = false,
            .point = {pair.particle, pair.weight, 4, 0, 0},
            .normal = pair.normal,
            .host_arm = Vec3::Zero(),
            .guest_arm = Vec3::Zero(),
            .path_velocity = Vec3::Zero(),
            .target = (lacking > 0 ? part_share : 1) * lacking / seconds,
            .friction = pair.friction,
            .multiplier = duration * force_of(pair, forces)};
    Mat3 K = response_of(row.point, own);
    const std::size_t a = body_of(bodies, pair.particle.front()), b = body_of(bodies, pair.particle.back());
    K.diagonal().array() += 1 / bodies.deformable[a].mass + 1 / bodies.deformable[b].mass;
    const std::size_t before = rows_.size();
    add_row(row, K);
    if (rows_.size() > before) pair_maps_.push_back(map_of(pair, bodies.particles));
  }
}

void ContactForces::store_pairs(double duration, PairForces& forces) const {
  for (const Row& row : rows_)
    if (row.pair >= 0 && !row.impulse.isZero(0))
      forces.push_back({row.point.particle, row.impulse / duration});
  std::sort(forces.begin(), forces.end(),
            [](const PairForce& a, const PairForce& b) { return a.particle < b.particle; });
}

Vec3 ContactForces::velocity_of(const Row& row, const GeneralizedVelocity& v) const {
  if (row.pair < 0) return row_velocity(row, v);
  Vec3 relative = Vec3::Zero();
  for (std::size_t i = 0; i < 4; ++i)
    relative += pair_maps_[as_index(row.pair)][i] * v.particle[as_index(row.point.particle[i])];
  return relative;
}

double ContactForces::evaluate(const GeneralizedVelocity& velocity) {
  double potential = 0;
  for (Row& row : rows_) {
    const Vec3 v = velocity_of(row, velocity) + row.path_velocity;
    const double before = row.multiplier.dot(row.normal);
    const double wanted = before + row.normal_mass * (row.target - v.dot(row.normal));
    const double normal = std::max(0.0, wanted);
    row.normal_slope = wanted >= 0 ? row.normal_mass : 0;  // also for a contact that is about to touch
    const Vec3 sticking = tangent_of(row.multiplier - row.tangential_mass * v, row.normal);
    const double length = sticking.norm();
    potential += (normal * normal - before * before) / (2 * row.normal_mass);
    row.sliding.setZero();
    if (length <= row.bound) {
      row.impulse = normal * row.normal + sticking;
      row.tangential_slope = row.normal_slope > 0 && row.friction > 0 ? row.tangential_mass : 0;
      potential += length * length / (2 * row.tangential_mass);
    } else {
      row.sliding = sticking / length;
      row.impulse = normal * row.normal + row.bound * row.sliding;
      row.tangential_slope = row.tangential_mass * row.bound / length;
      potential += (length - row.bound / 2) * row.bound / row.tangential_mass;
    }
  }
  return potential;
}

void ContactForces::begin_bounds() {
  for (Row& row : rows_)
    row.bound = row.friction * std::max(0.0, (row.pair < 0 ? row.impulse : row.multiplier).dot(row.normal));
}

void ContactForces::set_bounds() {
  for (Row& row : rows_) row.bound = row.friction * row.impulse.dot(row.normal);
}

void ContactForces::push(const Row& row, const Vec3& impulse, GeneralizedVelocity& v) const {
  const auto push_rigid = [&](int body, const Vec3& arm, const Vec3& j) {
    const auto b = as_index(body);
    if (!bodies_->rigid.properties[b].is_dynamic()) return;
    v.linear[b] += bodies_->rigid.properties[b].inverse_mass * j;
    v.angular[b] += bodies_->rigid.state[b].inverse_inertia * arm.cross(j);
  };
  if (row.pair >= 0) {
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = as_index(row.point.particle[i]);
      v.particle[p] +=
          bodies_->particles.inverse_mass[p] * (pair_maps_[as_index(row.pair)][i].transpose() * impulse);
    }
    return;
  }
  if (row.moves_host) push_rigid(row.host, row.host_arm, -impulse);
  if (row.guest_rigid >= 0) {
    push_rigid(row.guest_rigid, row.guest_arm, impulse);
    return;
  }
  for (std::size_t i = 0; i < as_index(row.point.count); ++i) {
    const auto p = as_index(row.point.particle[i]);
    v.particle[p] += row.point.weight[i] * bodies_->particles.inverse_mass[p] * impulse;
  }
}

void ContactForces::add_velocities(double factor, GeneralizedVelocity& out) const {
  for (const Row& row : rows_)
    if (!row.impulse.isZero(0)) push(row, factor * row.impulse, out);
}

void ContactForces::add_stored_velocities(double factor, GeneralizedVelocity& out) const {
  for (const Row& row : rows_)
    if (row.contact >= 0 && !row.impulse.isZero(0)) push(row, factor * row.impulse, out);
}

Momentum ContactForces::impulse_of_pins(const Particles& particles) const {
  Momentum total;
  for (const Row& row : rows_) {
    if (row.pair < 0) continue;
    for (std::size_t i = 0; i < 4; ++i) {
      const auto p = as_index(row.point.particle[i]);
      if (!is_held(particles, p)) continue;
      const Vec3 given = -(pair_maps_[as_index(row.pair)][i].transpose() * row.impulse);
      total += {given, particles.x[p].cross(given)};
    }
  }
  return total;
}

void ContactForces::add_pair_impulses(ContactImpulses& out) const {
  for (const Row& row : rows_) {
    if (row.pair < 0) continue;
    const double along_normal = row.impulse.dot(row.normal);
    for (std::size_t i = 0; i < 4; ++i)
      out.add(as_index(row.point.particle[i]), pair_maps_[as_index(row.pair)][i].transpose() * row.impulse,
              std::abs(row.point.weight[i]) * along_normal);
  }
}

// Returns the decrease of the impulse by a change `velocity` of the relative velocity, N s.
Vec3 ContactForces::slope(const Row& row, const Vec3& velocity) const {
  const double normal = velocity.dot(row.normal);
  Vec3 tangent = velocity - normal * row.normal;
  if (!is_careful_) tangent -= tangent.dot(row.sliding) * row.sliding;
  return row.normal_slope * normal * row.normal + row.tangential_slope * tangent;
}

Mat3 ContactForces::slope(const Row& row) const {
  Mat3 G;
  for (int k = 0; k < 3; ++k) G.col(k) = slope(row, Vec3::Unit(k));
  return G;
}

void ContactForces::add_differentials(const GeneralizedVelocity& change, GeneralizedVelocity& out) const {
  for (const Row& row : rows_)
    if (row.normal_slope > 0 || row.tangential_slope > 0)
      push(row, slope(row, velocity_of(row, change)), out);
}

void ContactForces::add_blocks(std::vector<SymmetricBlock>& particle, std::vector<Mat6>& rigid) const {
  DUET_ASSERT(rows_.empty() ||
              (particle.size() == bodies_->particles.size() && rigid.size() == bodies_->rigid.size()));
  for (const Row& row : rows_) {
    if (row.normal_slope == 0 && row.tangential_slope == 0) continue;
    const Mat3 G = slope(row);
    if (row.pair >= 0) {
      const std::array<Mat3, 4>& map = pair_maps_[as_index(row.pair)];
      for (std::size_t i = 0; i < 4; ++i)
        add(1, map[i].transpose() * G * map[i], particle[as_index(row.point.particle[i])]);
      continue;
    }
    if (row.moves_host) add_wrenches(G, row.host_arm, rigid[as_index(row.host)]);
    if (row.guest_rigid >= 0)
      add_wrenches(G, row.guest_arm, rigid[as_index(row.guest_rigid)]);
    else
      for (std::size_t i = 0; i < as_index(row.point.count); ++i)
        add(row.point.weight[i] * row.point.weight[i], G, particle[as_index(row.point.particle[i])]);
  }
}

void ContactForces::append_rows(std::vector<ResponseRow>& rows) const {
  using Of = ResponseRow::Of;
  for (const Row& row : rows_) {
    if (row.normal_slope == 0 && row.tangential_slope == 0) continue;
    ResponseRow& out = rows.emplace_back();
    out.slope = slope(row);
    if (row.pair >= 0) {
      for (std::size_t i = 0; i < 4; ++i)
        out.add(Of::particle, row.point.particle[i], pair_maps_[as_index(row.pair)][i]);
      continue;
    }
    if (row.moves_host) out.add_point(row.host, row.host_arm, -1);
    if (row.guest_rigid >= 0)
      out.add_point(row.guest_rigid, row.guest_arm, 1);
    else
      for (std::size_t i = 0; i < as_index(row.point.count); ++i)
        out.add(Of::particle, row.point.particle[i], row.point.weight[i] * Mat3::Identity());
  }
}

void ContactForces::update_multipliers() {
  for (Row& row : rows_) row.multiplier = row.impulse;
}

void ContactForces::store(double factor, ContactSet& contacts) const {
  for (const int i : out_of_reach_) contacts.points[as_index(i)].impulse.setZero();
  for (const Row& row : rows_)
    if (row.contact >= 0) contacts.points[as_index(row.contact)].impulse = factor * row.impulse;
}

void ContactForces::restore_targets(ContactSet& contacts) const {
  for (const Row& row : rows_)
    if (row.contact >= 0) contacts.points[as_index(row.contact)].target = row.target;
}

}  // namespace duet
