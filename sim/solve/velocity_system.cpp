#include "sim/solve/velocity_system.h"

#include <algorithm>
#include <cmath>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/deformable/spin.h"

namespace duet {
namespace {

constexpr std::size_t particles_at_once = 1024;  // particles of one task
// Largest residual reduction for which products with search directions take single precision. Their relative
// error is 1e-7, and the block-Jacobi preconditioner keeps the operator near the identity, so that a margin
// of a factor 100 is left. A larger value would use up that margin.
constexpr double reduction_in_single = 1e4;

// Calls operation(x entry, y entry) for all particles and both parts of all twists.
template <class Operation>
void for_each_entry(const GeneralizedVelocity& x, GeneralizedVelocity& y, Operation&& operation) {
  DUET_ASSERT(x.particle.size() == y.particle.size() && x.linear.size() == y.linear.size());
  parallel_for(x.particle.size(), particles_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) operation(x.particle[p], y.particle[p]);
  });
  for (std::size_t i = 0; i < x.linear.size(); ++i) {
    operation(x.linear[i], y.linear[i]);
    operation(x.angular[i], y.angular[i]);
  }
}

// Calls operation(value) for all values.
template <class Operation>
void for_each_entry(std::vector<Vec3>& values, Operation&& operation) {
  parallel_for(values.size(), particles_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) operation(values[p]);
  });
}

void resize_like(const GeneralizedVelocity& from, GeneralizedVelocity& to) {
  to.particle.resize(from.particle.size());
  to.linear.resize(from.linear.size());
  to.angular.resize(from.angular.size());
}

}  // namespace

VelocitySystem::VelocitySystem(Bodies& bodies, double dt, ImplicitForces forces,
                               const ContactProjection* projection, std::vector<Vec3>& force_scratch,
                               std::vector<Mat3>& inertia_scratch)
    : bodies_(bodies),
      dt_(dt),
      implicit_elasticity_(forces == ImplicitForces::damping_and_elasticity),
      projection_(projection),
      force_(force_scratch),
      inertia_(inertia_scratch) {
  DUET_ASSERT(dt >= 0);
  inertia_.resize(bodies.rigid.size());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    const Mat3 rotation = bodies.rigid.state[i].pose.orientation.toRotationMatrix();
    inertia_[i] = rotation * bodies.rigid.properties[i].inertia.asDiagonal() * rotation.transpose();
  }
}

template <class Work>
void VelocitySystem::for_each_range(std::size_t particles, Work&& work) const {
  if (!islands_) {
    parallel_for(particles, particles_at_once, work);
    return;
  }
  const std::vector<Islands::Range>& ranges = islands_->ranges();
  parallel_for(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) work(ranges[i].begin, ranges[i].end);
  });
}

void VelocitySystem::limit_to(const Islands* islands) {
  islands_ = islands;
  bodies_.forces.limit_to(islands ? &islands->mask() : nullptr);
}

void VelocitySystem::use(BlockJacobi& masses, AssembleBlocks blocks) {
  masses_ = &masses;
  const Particles& particles = bodies_.particles;
  masses.mass.resize(particles.size());
  masses.inverse.resize(particles.size());
  if (blocks == AssembleBlocks::all) forget(masses);
  if (islands_)
    masses.wanted = islands_->mask();
  else
    masses.wanted.assign_all(particles.size());
  masses.wanted.take_new(masses.known);
  const auto for_each_wanted = [&](auto&& work) {
    constexpr std::size_t chunk = ParticleMask::chunk;
    parallel_for(particles.size(), chunk, [&](std::size_t begin, std::size_t end) {
      if (masses.wanted.has_chunk(begin / chunk))
        for (std::size_t p = begin; p < end; ++p) work(p);
    });
  };
  for_each_wanted([&](std::size_t p) { masses.mass[p] = masses.inverse[p] = SymmetricBlock{}; });
  bodies_.forces.limit_to(&masses.wanted);
  bodies_.forces.add_damping_blocks(masses.mass);
  bodies_.forces.limit_to(islands_ ? &islands_->mask() : nullptr);
  for_each_wanted([&](std::size_t p) {
    SymmetricBlock& block = masses.mass[p];
    const bool moves = particles.inverse_mass[p] > 0;
    block.diagonal = Vec3::Constant(particles.mass[p]) + (moves ? dt_ : 0) * block.diagonal;
    block.other *= moves ? dt_ : 0;
    if (moves) masses.inverse[p] = block.inverse();
  });
}

void VelocitySystem::apply_preconditioner(GeneralizedVelocity& right_side) const {
  if (!masses_) return;
  const Particles& particles = bodies_.particles;
  for_each_range(right_side.particle.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      if (particles.inverse_mass[p] > 0)
        right_side.particle[p] = masses_->inverse[p] * Vec3(particles.mass[p] * right_side.particle[p]);
  });
}

void VelocitySystem::expect_reduction(double factor) {
  // finish() removes the moments of forces on bodies, which have to be rounding. Some forces have true
  // moments.
  const bool has_moments = bodies_.forces.turn_bodies();
  in_single_ = masses_ && !implicit_elasticity_ && !has_moments && factor <= reduction_in_single;
  if (in_single_ && collected_) collected_in_single_->assign(force_.size(), Vec3::Zero());
}

void VelocitySystem::apply(const GeneralizedVelocity& v, GeneralizedVelocity& out) {
  DUET_ASSERT(v.particle.size() == bodies_.particles.size() && v.linear.size() == bodies_.rigid.size());
  resize_like(v, out);
  force_.resize(v.particle.size());
  for_each_range(force_.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) force_[p].setZero();
  });
  if (implicit_elasticity_) {
    bodies_.forces.add_force_differentials(v.particle, force_);
    for_each_entry(force_, [this](Vec3& force) { force *= dt_; });
  }
  if (in_single_)
    bodies_.forces.add_damping_forces_single(v.particle, force_);
  else
    bodies_.forces.add_damping_forces(v.particle, force_);
  const Particles& particles = bodies_.particles;
  for_each_range(v.particle.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      if (masses_ && particles.inverse_mass[p] > 0)
        out.particle[p] = masses_->inverse[p] * Vec3(particles.mass[p] * v.particle[p] - dt_ * force_[p]);
      else
        out.particle[p] = v.particle[p] - dt_ * particles.inverse_mass[p] * force_[p];
    }
  });
  // Damping forces act on rigid bodies through the particles bound to them.
  out.linear = v.linear;
  out.angular = v.angular;
  add_force_twists(bodies_.rigid, bodies_.bound, force_, -dt_, out.linear, out.angular);
  follow_twists(bodies_.bound, out.linear, out.angular, out.particle);
}

void VelocitySystem::accumulate(double share) {
  if (!collected_) return;
  DUET_ASSERT(collected_->size() == force_.size());
  std::vector<Vec3>& sum = in_single_ ? *collected_in_single_ : *collected_;
  parallel_for(force_.size(), particles_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) sum[p] += share * force_[p];
  });
}

// In single precision, damping forces have no moment on a body except for their rounding, which is removed
// here.
void VelocitySystem::finish() {
  if (!collected_ || !in_single_) return;
  for (const DeformableBody& body : bodies_.deformable)
    remove_moment(body, bodies_.particles, *collected_in_single_);
  parallel_for(force_.size(), particles_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) (*collected_)[p] += (*collected_in_single_)[p];
  });
}

void VelocitySystem::project(GeneralizedVelocity& v) const {
  if (!projection_) return;
  projection_->project(v);
  follow_twists(bodies_.bound, v.linear, v.angular, v.particle);
}

double VelocitySystem::inner(const GeneralizedVelocity& u, const GeneralizedVelocity& v) const {
  DUET_ASSERT(u.particle.size() == v.particle.size() && u.linear.size() == v.linear.size());
  double sum = parallel_sum(u.particle.size(), particles_at_once, [&](std::size_t p, double& part) {
    part += particle_inner(p, u.particle[p], v.particle[p]);
  });
  for (std::size_t i = 0; i < u.linear.size(); ++i) sum += rigid_inner(i, u, v);
  return sum;
}

// Inner product and norm share one pass over the particles.
VelocitySystem::Measure VelocitySystem::measure(const GeneralizedVelocity& v) const {
  Measure result = parallel_reduce(
      v.particle.size(), particles_at_once, Measure{},
      [&](std::size_t begin, std::size_t end) {
        Measure part;
        for (std::size_t p = begin; p < end; ++p) part.add(particle_measure(p, v));
        return part;
      },
      [&](Measure a, const Measure& b) { return a.add(b); });
  for (std::size_t i = 0; i < v.linear.size(); ++i) result.add(rigid_measure(i, v));
  result.norm = std::sqrt(result.norm);
  return result;
}

void VelocitySystem::subtract(const GeneralizedVelocity& a, const GeneralizedVelocity& b,
                              GeneralizedVelocity& out) {
  copy(a, out);
  axpy(-1, b, out);
}

void VelocitySystem::copy(const GeneralizedVelocity& from, GeneralizedVelocity& to) {
  resize_like(from, to);
  for_each_entry(from, to, [](const Vec3& a, Vec3& b) { b = a; });
}

void VelocitySystem::axpy(double alpha, const GeneralizedVelocity& x, GeneralizedVelocity& y) {
  for_each_entry(x, y, [alpha](const Vec3& a, Vec3& b) { b += alpha * a; });
}

void VelocitySystem::xpay(const GeneralizedVelocity& x, double beta, GeneralizedVelocity& y) {
  for_each_entry(x, y, [beta](const Vec3& a, Vec3& b) { b = a + beta * b; });
}

}  // namespace duet
