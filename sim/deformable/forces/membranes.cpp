#include "sim/deformable/forces/membranes.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "sim/deformable/forces/element_kernels.h"

namespace duet {
namespace {

// Returns max(x, 0).
double8 positive(const double8& x) { return select(x > double8{}, x, double8{}); }

}  // namespace

MembraneModuli membrane_moduli(double youngs_modulus, double poisson_ratio, double thickness,
                               double damping) {
  const double nu = poisson_ratio, stiffness = youngs_modulus * thickness;
  return {stiffness / (2 * (1 + nu)), stiffness * nu / (1 - nu * nu), damping};
}

void Membranes::add(const std::vector<Triangle>& triangles, const std::vector<Vec3>& rest,
                    const MembraneModuli& moduli) {
  for (const Triangle& t : triangles) {
    const Vec3 e = rest[as_index(t[1])] - rest[as_index(t[0])],
               f = rest[as_index(t[2])] - rest[as_index(t[0])];
    const Vec3 along = e.normalized(), across = e.cross(f).cross(e).normalized();
    Eigen::Matrix2d edges;
    edges << e.norm(), f.dot(along), 0, f.dot(across);
    RestTriangle entry;
    entry.inverse = edges.inverse();
    entry.area = edges.determinant() / 2;
    entry.moduli = moduli;
    entry.gradient = {entry.inverse.colwise().sum().norm(), entry.inverse.row(0).norm(),
                      entry.inverse.row(1).norm()};
    triangles_.push_back(t);
    rest_.push_back(entry);
  }
}

void Membranes::finalize(std::size_t particle_count) {
  batches_.resize((triangles_.size() + pack_width - 1) / pack_width);
  for (std::size_t slot = 0; slot < batches_.size() * pack_width; ++slot) {
    Batch& batch = batches_[slot / pack_width];
    const std::size_t lane = slot % pack_width;
    const std::size_t element = ScatterAdd::element_of(slot / pack_width, lane, batches_.size());
    const bool pads = element >= triangles_.size();
    const std::size_t t = pads ? triangles_.size() - 1 : element;
    for (std::size_t i = 0; i < 3; ++i) batch.particle[i][lane] = triangles_[t][i];
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) batch.inverse[i][j][lane] = rest_[t].inverse(i, j);
    batch.area[lane] = pads ? 0 : rest_[t].area;
    batch.mu[lane] = rest_[t].moduli.mu;
    batch.lambda[lane] = rest_[t].moduli.lambda;
    batch.damping[lane] = rest_[t].moduli.damping;
  }
  batch_stiffening_.assign(batches_.size(), 1);
  sums_.build(batches_, particle_count);
}

Membranes::Columns Membranes::gradient(const Batch& batch, const std::vector<Vec3>& values) {
  const vector8 origin = gather(values, batch.particle[0]);
  const vector8 e = gather(values, batch.particle[1]) - origin,
                f = gather(values, batch.particle[2]) - origin;
  return {batch.inverse[0][0] * e + batch.inverse[1][0] * f,
          batch.inverse[0][1] * e + batch.inverse[1][1] * f};
}

Membranes::Symmetric2 Membranes::stress(const Batch& batch, const Symmetric2& strain) {
  const double8 spherical = batch.lambda * (strain.xx + strain.yy), twice = 2.0 * batch.mu;
  return {twice * strain.xx + spherical, twice * strain.yy + spherical, twice * strain.xy};
}

Membranes::Symmetric2 Membranes::strain_rate(const Columns& F, const Columns& rate) {
  return {dot(F.x, rate.x), dot(F.y, rate.y), 0.5 * (dot(F.x, rate.y) + dot(F.y, rate.x))};
}

Membranes::Columns Membranes::times(const Columns& F, const Symmetric2& S) {
  return {S.xx * F.x + S.xy * F.y, S.xy * F.x + S.yy * F.y};
}

// `stress_of(b)` returns P of batch b. The columns of -A P D_m^-T are the forces on the last two corners,
// with the area A; the first corner gets minus their sum.
template <class Stress>
void Membranes::add_forces(std::vector<Vec3>& totals, Stress&& stress_of) {
  sums_.fill([&](std::size_t b, double4* sums) {
    const Columns P = stress_of(b);
    const Batch& batch = batches_[b];
    const double8 area = -batch.area;
    const vector8 second = area * (batch.inverse[0][0] * P.x + batch.inverse[0][1] * P.y);
    const vector8 third = area * (batch.inverse[1][0] * P.x + batch.inverse[1][1] * P.y);
    ScatterAdd::spread(batch.slot[0], vector8{} - (second + third), double8{}, sums);
    ScatterAdd::spread(batch.slot[1], second, double8{}, sums);
    ScatterAdd::spread(batch.slot[2], third, double8{}, sums);
  });
  sums_.add_to(totals);
}

void Membranes::add_elastic_forces(const std::vector<Vec3>& x, std::vector<Vec3>& force) {
  add_forces(force, [&](std::size_t b) {
    Batch& batch = batches_[b];
    const Columns F = batch.F = gradient(batch, x);
    const double8 cxx = dot(F.x, F.x), cyy = dot(F.y, F.y), cxy = dot(F.x, F.y);
    const Symmetric2 S = stress(batch, {0.5 * (cxx - 1.0), 0.5 * (cyy - 1.0), 0.5 * cxy});
    // `high` and `low` become the positive parts of both eigenvalues of h S, `stretch` the larger eigenvalue
    // of F^T F.
    const auto deviation = [](const Symmetric2& A) {
      const double8 half = 0.5 * (A.xx - A.yy);
      return sqrt_of(half * half + A.xy * A.xy);
    };
    const double8 mean = 0.5 * (S.xx + S.yy), spread = deviation(S);
    const double8 high = positive(mean + spread), low = positive(mean - spread);
    const double8 stretch = 0.5 * (cxx + cyy) + deviation({cxx, cyy, cxy});
    const double8 turned =
        select(spread > double8{}, 0.5 * (high - low) / select(spread > double8{}, spread, double8{} + 1.0),
               double8{});
    const double8 middle = 0.5 * (high + low);
    batch.tension = {middle + turned * (S.xx - mean), middle + turned * (S.yy - mean), turned * S.xy};
    const double8 at_rest = 2.0 * (batch.mu + positive(batch.lambda)), factor = stretch + high / at_rest;
    batch_stiffening_[b] = factor[0];
    for (std::size_t lane = 1; lane < pack_width; ++lane)
      batch_stiffening_[b] = std::max<double>(batch_stiffening_[b], factor[lane]);
    return times(F, S);
  });
  if (!triangles_.empty())
    stiffening_ = std::max(1.0, *std::max_element(batch_stiffening_.begin(), batch_stiffening_.end()));
}

void Membranes::add_damping_forces(const std::vector<Vec3>& v, std::vector<Vec3>& force) {
  add_forces(force, [&](std::size_t b) {
    const Batch& batch = batches_[b];
    const Columns rate = gradient(batch, v);
    const Columns P = times(batch.F, stress(batch, strain_rate(batch.F, rate)));
    return Columns{batch.damping * P.x, batch.damping * P.y};
  });
}

void Membranes::add_turn_forces(const std::vector<Vec3>& v, double seconds, std::vector<Vec3>& force) {
  add_forces(force, [&](std::size_t b) {
    const Batch& batch = batches_[b];
    const Columns &F = batch.F, rate = gradient(batch, v);
    const vector8 spin = spin_of_columns<2>({F.x, F.y}, {rate.x, rate.y});
    const Columns turned{cross(spin, F.x), cross(spin, F.y)};
    const Columns P = times(F, stress(batch, strain_rate(turned, turned)));
    const double8 damping = turn_time(spin, seconds) * batch.damping;
    return Columns{damping * P.x, damping * P.y};
  });
}

void Membranes::add_force_differentials(const std::vector<Vec3>& dx, std::vector<Vec3>& force) {
  add_forces(force, [&](std::size_t b) {
    const Batch& batch = batches_[b];
    const Columns dF = gradient(batch, dx);
    const Columns material = times(batch.F, stress(batch, strain_rate(batch.F, dF)));
    const Columns geometric = times(dF, batch.tension);
    return Columns{material.x + geometric.x, material.y + geometric.y};
  });
}

Membranes::Columns Membranes::system_stress(const Batch& batch, const BlockFactors& factors,
                                            const Columns& rate) {
  const Columns material = times(batch.F, stress(batch, strain_rate(batch.F, rate)));
  const Columns geometric = times(rate, batch.tension);
  const double8 elasticity = double8{} + factors.elasticity,
                of_material = factors.damping * batch.damping + elasticity;
  return {of_material * material.x + elasticity * geometric.x,
          of_material * material.y + elasticity * geometric.y};
}

// Column k of the block of the corners i and j is the force on corner i while corner j moves along axis k:
// A P g_i, where P belongs to the rate e_k g_j^T and g is the gradient of a corner's linear shape function.
void Membranes::append_blocks(const BlockFactors& factors, std::vector<ParticleBlock>& blocks) const {
  for (const Batch& batch : batches_) {
    const double8(&D)[2][2] = batch.inverse;
    const std::array<std::array<double8, 2>, 3> g{
        {{-(D[0][0] + D[1][0]), -(D[0][1] + D[1][1])}, {D[0][0], D[0][1]}, {D[1][0], D[1][1]}}};
    std::array<std::array<Columns, 3>, 3> P;  // by corner j and axis k
    for (std::size_t j = 0; j < 3; ++j) {
      const double8 none{};
      P[j][0] = system_stress(batch, factors, {{g[j][0], none, none}, {g[j][1], none, none}});
      P[j][1] = system_stress(batch, factors, {{none, g[j][0], none}, {none, g[j][1], none}});
      P[j][2] = system_stress(batch, factors, {{none, none, g[j][0]}, {none, none, g[j][1]}});
    }
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        std::array<vector8, 3> column;
        for (std::size_t k = 0; k < 3; ++k)
          column[k] = batch.area * (g[i][0] * P[j][k].x + g[i][1] * P[j][k].y);
        append_lanes(batch.particle[i], batch.particle[j], column, blocks);
      }
  }
}

double Membranes::energy(const std::vector<Vec3>& x) const {
  return parallel_sum(batches_.size(), ScatterAdd::batches_of_block, [&](std::size_t b, double& sum) {
    const Batch& batch = batches_[b];
    const Columns F = gradient(batch, x);
    const Symmetric2 E{0.5 * (dot(F.x, F.x) - 1.0), 0.5 * (dot(F.y, F.y) - 1.0), 0.5 * dot(F.x, F.y)};
    const Symmetric2 S = stress(batch, E);
    sum += sum_of_lanes(0.5 * batch.area * (S.xx * E.xx + S.yy * E.yy + 2.0 * S.xy * E.xy));
  });
}

// Uses psi <= h (mu + lambda) |E|^2 and, near rest, |E| <= sum of |gradient| |u| over the corners.
double Membranes::RestTriangle::stiffness() const {
  return 2 * area * (moduli.mu + std::max(moduli.lambda, 0.0));
}

double Membranes::RestTriangle::half_of_gradients() const {
  return (gradient[0] + gradient[1] + gradient[2]) / 2;
}

void Membranes::add_stiffness(std::vector<double>& stiffness) const {
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t i = 0; i < 3; ++i)
      stiffness[as_index(triangles_[t][i])] +=
          rest_[t].stiffness() * rest_[t].half_of_gradients() * rest_[t].gradient[i];
}

double Membranes::max_omega_squared(const std::vector<double>& squared_rate) const {
  double highest = 0;
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    double sum = 0;
    for (std::size_t i = 0; i < 3; ++i)
      sum += rest_[t].gradient[i] * squared_rate[as_index(triangles_[t][i])];
    highest = std::max(highest, sum / rest_[t].half_of_gradients());
  }
  return highest;
}

}  // namespace duet
