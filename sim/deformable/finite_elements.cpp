#include "sim/deformable/finite_elements.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

#include "sim/base/parallel.h"
#include "sim/deformable/neo_hookean.h"

namespace duet {
namespace {

constexpr std::size_t batch_grain = 32;
constexpr std::size_t particle_grain = 512;

std::size_t as_index(int i) { return static_cast<std::size_t>(i); }

Mat3 edge_matrix(const Tet& tet, const std::vector<Vec3>& x) {
  Mat3 edges;
  for (int k = 0; k < 3; ++k) edges.col(k) = x[as_index(tet[as_index(k + 1)])] - x[as_index(tet[0])];
  return edges;
}

// An upper bound of the highest squared frequency of an element whose nodes carry the given masses: the part
// of lambda is of rank one and exact, that of mu is bounded by the largest eigenvalue of sum g g^T / m.
double squared_frequency_bound(const Mat3& inverse_rest, double volume, const LameParameters& material,
                               const std::array<double, 4>& mass) {
  double trace = 0;
  Mat3 scatter = Mat3::Zero();
  for (int i = 0; i < 4; ++i) {
    const Vec3 gradient =
        i == 0 ? Vec3(-inverse_rest.colwise().sum().transpose()) : Vec3(inverse_rest.row(i - 1).transpose());
    trace += gradient.squaredNorm() / mass[as_index(i)];
    scatter += gradient * gradient.transpose() / mass[as_index(i)];
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(scatter, Eigen::EigenvaluesOnly);
  return volume * (material.lambda * trace + 2 * material.mu * eigen.eigenvalues()[2]);
}

}  // namespace

LameParameters lame_parameters(double youngs_modulus, double poisson_ratio, double damping) {
  const double nu = poisson_ratio;
  return {youngs_modulus / (2 * (1 + nu)), youngs_modulus * nu / ((1 + nu) * (1 - 2 * nu)), damping};
}

void FiniteElements::add(const std::vector<Tet>& tets, const std::vector<Vec3>& rest,
                         const LameParameters& material) {
  for (const Tet& tet : tets) {
    const Mat3 edges = edge_matrix(tet, rest);
    tets_.push_back(tet);
    inverse_rest_.push_back(edges.inverse());
    volume_.push_back(edges.determinant() / 6);
    material_.push_back(material);
  }
}

void FiniteElements::finalize(const std::vector<double>& mass) {
  std::vector<double> particle_volume(mass.size(), 0);
  for (std::size_t t = 0; t < tets_.size(); ++t)
    for (int p : tets_[t]) particle_volume[as_index(p)] += volume_[t];

  batches_.resize((tets_.size() + pack_width - 1) / pack_width);
  for (std::size_t slot = 0; slot < batches_.size() * pack_width; ++slot) {
    const std::size_t t = std::min(slot, tets_.size() - 1);  // the last tet pads, without volume
    Batch& batch = batches_[slot / pack_width];
    const std::size_t lane = slot % pack_width;
    std::array<double, 4> share;  // of each particle's mass, by volume
    for (std::size_t i = 0; i < 4; ++i) {
      const std::size_t p = as_index(tets_[t][i]);
      batch.particle[i][lane] = tets_[t][i];
      share[i] = mass[p] * volume_[t] / particle_volume[p];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) batch.inverse_rest[i][j][lane] = inverse_rest_[t](i, j);
    batch.volume[lane] = slot < tets_.size() ? volume_[t] : 0;
    batch.mu[lane] = material_[t].mu;
    batch.lambda[lane] = material_[t].lambda;
    batch.damping[lane] = material_[t].damping;
    batch.squared_frequency[lane] =
        squared_frequency_bound(inverse_rest_[t], volume_[t], material_[t], share);
    rest_squared_frequency_ = std::max<double>(rest_squared_frequency_, batch.squared_frequency[lane]);
  }
  max_squared_frequency_ = rest_squared_frequency_;
  deformation_.resize(batches_.size());
  batch_frequency_.resize(batches_.size());
  tet_force_.resize(batches_.size() * pack_width * 12);

  std::vector<int> count(mass.size() + 1, 0);
  for (const Tet& tet : tets_)
    for (int p : tet) ++count[as_index(p) + 1];
  for (std::size_t p = 1; p < count.size(); ++p) count[p] += count[p - 1];
  incidence_start_ = count;
  incidence_.resize(4 * tets_.size());
  for (std::size_t t = 0; t < tets_.size(); ++t)
    for (std::size_t i = 0; i < 4; ++i)
      incidence_[as_index(count[as_index(tets_[t][i])]++)] = static_cast<int>(12 * t + 3 * i);
}

// F for positions, its rate for velocities: D_s(values) D_m^-1.
Matrix3<Pack> FiniteElements::gradient(const Batch& batch, const std::vector<Vec3>& values) const {
  Matrix3<Pack> edges;
  for (std::size_t lane = 0; lane < pack_width; ++lane) {
    const Vec3& origin = values[as_index(batch.particle[0][lane])];
    for (int k = 0; k < 3; ++k) {
      const Vec3& end = values[as_index(batch.particle[as_index(k + 1)][lane])];
      for (int i = 0; i < 3; ++i) edges[i][k][lane] = end[i] - origin[i];
    }
  }
  return edges * batch.inverse_rest;
}

// H = -V P D_m^-T holds the forces on particles 1 to 3 in its columns; particle 0 gets the opposite of their
// sum.
void FiniteElements::store_forces(std::size_t index, const Matrix3<Pack>& stress) {
  const Batch& batch = batches_[index];
  const Matrix3<Pack> H = times_transposed(stress, batch.inverse_rest);
  double* out = tet_force_.data() + index * pack_width * 12;
  for (int i = 0; i < 3; ++i) {
    const Pack h1 = -batch.volume * H[i][0], h2 = -batch.volume * H[i][1], h3 = -batch.volume * H[i][2];
    const Pack h0 = -(h1 + h2 + h3);
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      double* tet = out + 12 * lane + i;
      tet[0] = h0[lane];
      tet[3] = h1[lane];
      tet[6] = h2[lane];
      tet[9] = h3[lane];
    }
  }
}

void FiniteElements::gather_forces(std::vector<Vec3>& force) const {
  parallel_for(force.size(), particle_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t p = begin; p < end; ++p) {
      Vec3 sum = Vec3::Zero();
      for (int k = incidence_start_[p]; k < incidence_start_[p + 1]; ++k)
        sum += Eigen::Map<const Vec3>(tet_force_.data() + incidence_[as_index(k)]);
      force[p] += sum;
    }
  });
}

void FiniteElements::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
  if (tets_.empty()) return;
  parallel_for(batches_.size(), batch_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Batch& batch = batches_[b];
      const Matrix3<Pack> F = deformation_[b] = gradient(batch, x);
      store_forces(b, neo_hookean::stress(batch.mu, batch.lambda, F));
      const Pack frequency = batch.squared_frequency * neo_hookean::stiffening(batch.mu, batch.lambda, F);
      double highest = frequency[0];
      for (std::size_t lane = 1; lane < pack_width; ++lane)
        highest = std::max<double>(highest, frequency[lane]);
      batch_frequency_[b] = highest;
    }
  });
  max_squared_frequency_ = *std::max_element(batch_frequency_.begin(), batch_frequency_.end());
  gather_forces(force);
}

void FiniteElements::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  if (tets_.empty()) return;
  parallel_for(batches_.size(), batch_grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t b = begin; b < end; ++b) {
      const Batch& batch = batches_[b];
      store_forces(b, neo_hookean::viscous_stress(batch.mu, batch.lambda, batch.damping, deformation_[b],
                                                  gradient(batch, v)));
    }
  });
  gather_forces(force);
}

double FiniteElements::energy(const std::vector<Vec3>& x) const {
  return parallel_reduce(
      batches_.size(), batch_grain, 0.0,
      [&](std::size_t begin, std::size_t end) {
        double sum = 0;
        for (std::size_t b = begin; b < end; ++b) {
          const Batch& batch = batches_[b];
          const Pack energy =
              batch.volume * neo_hookean::energy_density(batch.mu, batch.lambda, gradient(batch, x));
          for (std::size_t lane = 0; lane < pack_width; ++lane) sum += energy[lane];
        }
        return sum;
      },
      [](double a, double b) { return a + b; });
}

FiniteElements::Strain FiniteElements::strain(const std::vector<Vec3>& x) const {
  Strain result;
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    const double det = edge_matrix(tets_[t], x).determinant() / (6 * volume_[t]);
    if (det <= 0) ++result.inverted;
    if (result.worst_tet < 0 || det < result.min_det) {
      result.min_det = det;
      result.worst_tet = static_cast<int>(t);
    }
  }
  return result;
}

void FiniteElements::add_strain(const std::vector<Vec3>& x, std::vector<float>& strain) const {
  for (std::size_t t = 0; t < tets_.size(); ++t) {
    const Mat3 F = edge_matrix(tets_[t], x) * inverse_rest_[t];
    const bool is_inverted = F.determinant() <= 0;
    double largest = 0;
    if (!is_inverted) {
      Eigen::SelfAdjointEigenSolver<Mat3> squares;
      squares.computeDirect(F.transpose() * F, Eigen::EigenvaluesOnly);
      for (int i : {0, 2})
        largest = std::max(largest, std::abs(std::sqrt(std::max(squares.eigenvalues()[i], 0.0)) - 1));
    }
    for (int p : tets_[t]) {
      float& here = strain[as_index(p)];
      if (is_inverted)
        here = inverted;
      else if (here != inverted)
        here = std::max(here, static_cast<float>(largest));
    }
  }
}

}  // namespace duet
