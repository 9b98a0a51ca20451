#include "sim/solve/velocity_blocks.h"

#include "sim/base/assert.h"
#include "sim/base/dense_solvers.h"
#include "sim/base/parallel.h"

namespace duet {
namespace {

constexpr std::size_t blocks_at_once = 1024;  // particles of one task

}  // namespace

void VelocityBlocks::find(Bodies& bodies, double dt) {
  DUET_ASSERT(dt > 0);
  const Particles& particles = bodies.particles;
  block_.assign(particles.size(), SymmetricBlock{});
  own_.resize(particles.size());
  bodies.forces.add_damping_blocks(block_);
  parallel_for(particles.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      own_[p] = SymmetricBlock{};
      if (particles.inverse_mass[p] == 0) continue;
      block_[p].diagonal = Vec3::Constant(particles.mass[p]) + dt * block_[p].diagonal;
      block_[p].other *= dt;
      own_[p] = block_[p].inverse();
    }
  });
}

void VelocityBlocks::add(const Bodies& bodies, const std::vector<Mat3>& inertia,
                         const ContactForces* contacts, const JointForces* joints) {
  DUET_ASSERT(block_.size() == bodies.particles.size() && inertia.size() == bodies.rigid.size());
  const std::size_t bodies_count = bodies.rigid.size();
  inverse_ = block_;
  rigid_.assign(bodies_count, Mat6::Zero());
  for (std::size_t i = 0; i < bodies_count; ++i) {
    if (!bodies.rigid.properties[i].is_dynamic()) continue;
    rigid_[i].topLeftCorner<3, 3>().diagonal().setConstant(bodies.rigid.properties[i].mass);
    rigid_[i].bottomRightCorner<3, 3>() = inertia[i];
  }
  if (contacts) contacts->add_blocks(inverse_, rigid_);
  if (joints) joints->add_blocks(rigid_);
  parallel_for(inverse_.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      inverse_[p] = bodies.particles.inverse_mass[p] > 0 ? inverse_[p].inverse() : SymmetricBlock{};
  });
  rigid_inverse_.resize(bodies_count);
  for (std::size_t i = 0; i < bodies_count; ++i)
    rigid_inverse_[i] = bodies.rigid.properties[i].is_dynamic() ? SymmetricFactor<6>(rigid_[i]).inverse()
                                                                : Mat6(Mat6::Zero());
}

void VelocityBlocks::apply(const Bodies& bodies, const std::vector<Mat3>& inertia,
                           const GeneralizedVelocity& residual, GeneralizedVelocity& out) const {
  DUET_ASSERT(residual.particle.size() == inverse_.size() && residual.linear.size() == rigid_inverse_.size());
  DUET_ASSERT(inertia.size() == bodies.rigid.size());
  const Particles& particles = bodies.particles;
  out.particle.resize(residual.particle.size());
  out.linear.resize(residual.linear.size());
  out.angular.resize(residual.angular.size());
  parallel_for(particles.size(), blocks_at_once, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      out.particle[p] = inverse_[p] * Vec3(particles.mass[p] * residual.particle[p]);
  });
  for (std::size_t i = 0; i < residual.linear.size(); ++i) {
    Vec6 momentum;
    momentum << bodies.rigid.properties[i].mass * residual.linear[i], inertia[i] * residual.angular[i];
    const Vec6 twist = rigid_inverse_[i] * momentum;
    out.linear[i] = twist.head<3>();
    out.angular[i] = twist.tail<3>();
  }
}

}  // namespace duet
