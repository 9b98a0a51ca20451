#include "sim/solve/velocity_factor.h"

#include <array>

#include "sim/base/assert.h"

namespace duet {
namespace {

// Largest number of products of 3x3 blocks for each block row. They take some 25 us, as long as a particle
// takes in 100 to 300 iterations of conjugate gradients. Sheets of up to some 4,000 and volumes of up to some
// 1,000 particles stay below it. With twice the value, a fish of 4,800 particles took half as long again.
constexpr std::size_t max_products_per_row = 2000;

}  // namespace

void VelocityFactor::number(const Bodies& bodies, const Islands* islands) {
  int next = 0;
  particle_row_.assign(bodies.particles.size(), -1);
  rigid_row_.assign(bodies.rigid.size(), -1);
  bound_.assign(bodies.particles.size(), -1);
  for (std::size_t i = 0; i < bodies.bound.size(); ++i)
    bound_[bodies.bound[i].particle] = static_cast<int>(i);
  const auto take = [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p)
      if (bodies.particles.inverse_mass[p] > 0) particle_row_[p] = next++;
  };
  if (islands)
    for (const Islands::Range& range : islands->ranges()) take(range.begin, range.end);
  else
    take(0, bodies.particles.size());
  for (std::size_t i = 0; i < bodies.rigid.size(); ++i) {
    if (!bodies.rigid.properties[i].is_dynamic() || (islands && !islands->is_searched_rigid(i))) continue;
    rigid_row_[i] = next;
    next += 2;
  }
  rows_ = as_index(next);
}

void VelocityFactor::add_masses(const Bodies& bodies, const std::vector<Mat3>& inertia) {
  for (std::size_t p = 0; p < particle_row_.size(); ++p)
    if (const int row = particle_row_[p]; row >= 0)
      blocks_.push_back({row, row, bodies.particles.mass[p] * Mat3::Identity()});
  for (std::size_t i = 0; i < rigid_row_.size(); ++i) {
    const int row = rigid_row_[i];
    if (row < 0) continue;
    blocks_.push_back({row, row, bodies.rigid.properties[i].mass * Mat3::Identity()});
    blocks_.push_back({row + 1, row + 1, inertia[i]});
  }
}

void VelocityFactor::add(const Handle& a, const Handle& b, const Mat3& block) {
  blocks_.push_back({a.row, b.row, a.map.transpose() * block * b.map});
}

void VelocityFactor::add_forces(const Bodies& bodies, const BlockFactors& factors) {
  forces_.clear();
  bodies.forces.append_blocks(factors, forces_);
  std::array<Handle, 2> of_row, of_column;
  const auto handles_of = [&](int particle, std::array<Handle, 2>& handles) -> std::size_t {
    const auto p = as_index(particle);
    if (particle_row_[p] >= 0) {
      handles[0] = {particle_row_[p], Mat3::Identity()};
      return 1;
    }
    if (bound_[p] < 0) return 0;
    const EmbeddedParticle& embedded = bodies.bound[as_index(bound_[p])];
    const int row = rigid_row_[embedded.body];
    if (row < 0) return 0;
    handles[0] = {row, Mat3::Identity()};
    handles[1] = {row + 1, -skew(embedded.offset)};
    return 2;
  };
  for (const ParticleBlock& force : forces_) {
    const std::size_t rows = handles_of(force.row, of_row), columns = handles_of(force.column, of_column);
    const bool is_diagonal = force.row == force.column;
    for (std::size_t i = 0; i < rows; ++i)
      for (std::size_t j = 0; j < columns; ++j) {
        // Of the two blocks between the handles of one particle, one stands for both.
        if (is_diagonal && j > i) continue;
        add(of_row[i], of_column[j], force.block);
        if (!is_diagonal && of_row[i].row == of_column[j].row)
          add(of_column[j], of_row[i], force.block.transpose());
      }
  }
}

void VelocityFactor::add_rows() {
  for (const ResponseRow& response : responses_) {
    std::array<Handle, ResponseRow::max_parts> handles;
    std::size_t count = 0;
    for (std::size_t k = 0; k < response.count; ++k) {
      const ResponseRow::Part& part = response.part[k];
      const int row = part.of == ResponseRow::Of::particle ? particle_row_[as_index(part.index)]
                                                           : rigid_row_[as_index(part.index)];
      if (row < 0) continue;
      handles[count++] = {part.of == ResponseRow::Of::angular ? row + 1 : row, part.map};
    }
    for (std::size_t i = 0; i < count; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        add(handles[i], handles[j], response.slope);
        if (i != j && handles[i].row == handles[j].row) add(handles[j], handles[i], response.slope);
      }
  }
}

bool VelocityFactor::factorize(const Bodies& bodies, double dt, ImplicitForces forces,
                               const std::vector<Mat3>& inertia, const Islands* islands,
                               const ContactForces* contacts, const JointForces* joints) {
  DUET_ASSERT(dt > 0 && inertia.size() == bodies.rigid.size());
  number(bodies, islands);
  blocks_.clear();
  responses_.clear();
  add_masses(bodies, inertia);
  add_forces(bodies, {dt, forces == ImplicitForces::damping_and_elasticity ? dt * dt : 0});
  if (contacts) contacts->append_rows(responses_);
  if (joints) joints->append_rows(responses_);
  add_rows();
  return factor_.factorize(rows_, blocks_, max_products_per_row * rows_);
}

void VelocityFactor::apply(const Bodies& bodies, const std::vector<Mat3>& inertia,
                           const GeneralizedVelocity& residual, GeneralizedVelocity& out) {
  DUET_ASSERT(residual.particle.size() == particle_row_.size() &&
              residual.linear.size() == rigid_row_.size());
  values_.assign(rows_, Vec3::Zero());
  for (std::size_t p = 0; p < particle_row_.size(); ++p)
    if (const int row = particle_row_[p]; row >= 0)
      values_[as_index(row)] = bodies.particles.mass[p] * residual.particle[p];
  for (std::size_t i = 0; i < rigid_row_.size(); ++i) {
    const int row = rigid_row_[i];
    if (row < 0) continue;
    values_[as_index(row)] = bodies.rigid.properties[i].mass * residual.linear[i];
    values_[as_index(row + 1)] = inertia[i] * residual.angular[i];
  }
  factor_.solve(values_);
  const auto value = [&](int row) { return row < 0 ? Vec3(Vec3::Zero()) : values_[as_index(row)]; };
  out.particle.resize(particle_row_.size());
  out.linear.resize(rigid_row_.size());
  out.angular.resize(rigid_row_.size());
  for (std::size_t p = 0; p < particle_row_.size(); ++p) out.particle[p] = value(particle_row_[p]);
  for (std::size_t i = 0; i < rigid_row_.size(); ++i) {
    out.linear[i] = value(rigid_row_[i]);
    out.angular[i] = rigid_row_[i] < 0 ? Vec3(Vec3::Zero()) : value(rigid_row_[i] + 1);
  }
}

}  // namespace duet
