// What is measured of finite elements and changes nothing: energy, stress, strain and the rate of
// deformation.
#include <algorithm>
#include <cmath>

#include "sim/base/parallel.h"
#include "sim/deformable/forces/element_kernels.h"
#include "sim/deformable/forces/finite_elements.h"
#include "sim/deformable/forces/tet_strain.h"
#include "sim/deformable/materials/with_model.h"

namespace duet {

double FiniteElements::energy(const std::vector<Vec3>& x) const {
  return parallel_sum(batches_.size(), ScatterAdd::batches_of_block, [&](std::size_t b, double& sum) {
    const Batch& batch = batches_[b];
    const Matrix3<double8> F = gradient(batch, x);
    const Moduli here = moduli(b);
    const double8 &mu = here.mu, &lambda = here.lambda;
    with_model(model(b), [&]<class Model>(Model) {
      sum += sum_of_lanes(batch.volume * Model::energy_density(mu, lambda, F));
    });
  });
}

void FiniteElements::measure_stress(const std::vector<Vec3>& x, std::vector<float>& stress,
                                    std::vector<float>& energy) const {
  struct Sums {
    double stress = 0, upright = 0,  // Pa m^3, and m^3 of the elements that are not inverted
        energy = 0, volume = 0;      // J, and m^3
  };
  std::vector<Sums> sums(x.size());
  for (std::size_t b = 0; b < batches_.size(); ++b) {
    const Batch& batch = batches_[b];
    const Matrix3<double8> F = gradient(batch, x);
    const double8 J = determinant(F, cofactor(F));
    const Moduli here = moduli(b);
    double8 density{}, mises{};
    with_model(model(b), [&]<class Model>(Model) {
      density = Model::energy_density(here.mu, here.lambda, F);
      mises = von_mises(times_transposed(Model::stress(here.mu, here.lambda, F), F)) / J;
    });
    for (std::size_t lane = 0; lane < pack_width; ++lane) {
      if (batch.volume[lane] == 0) continue;
      for (std::size_t k = 0; k < corners; ++k) {
        Sums& here_sums = sums[static_cast<std::size_t>(batch.particle[k][lane])];
        here_sums.energy += batch.volume[lane] * density[lane];
        here_sums.volume += batch.volume[lane];
        if (J[lane] <= 0) continue;
        here_sums.stress += batch.volume[lane] * mises[lane];
        here_sums.upright += batch.volume[lane];
      }
    }
  }
  stress.assign(x.size(), 0);
  energy.assign(x.size(), 0);
  for (std::size_t p = 0; p < x.size(); ++p) {
    if (sums[p].upright > 0) stress[p] = static_cast<float>(sums[p].stress / sums[p].upright);
    if (sums[p].volume > 0) energy[p] = static_cast<float>(sums[p].energy / sums[p].volume);
  }
}

double8 FiniteElements::squared_rates(const Batch& batch, const std::vector<Vec3>& x,
                                      const std::vector<Vec3>& v) const {
  // Weight of the rate of volume against that of length.
  constexpr double volume_weight = 0.5;
  const Matrix3<double8> rate = gradient(batch, v);
  const double8 of_volume = volume_weight * contraction(cofactor(gradient(batch, x)), rate);
  return max_of(squared_norm(rate), of_volume * of_volume);
}

int FiniteElements::fastest_particle(const std::vector<Vec3>& x, const std::vector<Vec3>& v) const {
  int particle = -1;
  double largest = -1;
  for (const Batch& batch : batches_) {
    const double8 squared = squared_rates(batch, x, v);
    for (std::size_t lane = 0; lane < pack_width; ++lane)
      if (squared[lane] > largest) {
        largest = squared[lane];
        particle = static_cast<int>(batch.particle[0][lane]);
      }
  }
  return particle;
}

int FiniteElements::stiffest_particle() const {
  const auto largest = std::max_element(particle_frequency_.begin(), particle_frequency_.end());
  return largest == particle_frequency_.end() || *largest == 0
             ? -1
             : static_cast<int>(largest - particle_frequency_.begin());
}

double FiniteElements::max_deformation_rate(const std::vector<Vec3>& x, const std::vector<Vec3>& v) const {
  const auto larger = [](const double8& a, const double8& b) { return max_of(a, b); };
  const double8 squared = parallel_reduce(
      batches_.size(), ScatterAdd::batches_of_block, double8{},
      [&](std::size_t begin, std::size_t end) {
        double8 largest{};
        for (std::size_t b = begin; b < end; ++b) largest = max_of(largest, squared_rates(batches_[b], x, v));
        return largest;
      },
      larger);
  double largest = 0;
  for (std::size_t lane = 0; lane < pack_width; ++lane) largest = std::max<double>(largest, squared[lane]);
  return std::sqrt(largest);
}

FiniteElements::Strain FiniteElements::strain(const std::vector<Vec3>& x) const {
  Strain result;
  take_strain(tets_, inverse_rest_, x, result);
  return result;
}

void FiniteElements::add_strain(const std::vector<Vec3>& x, std::vector<float>& strain) const {
  raise_strain(tets_, inverse_rest_, x, strain);
}

}  // namespace duet
