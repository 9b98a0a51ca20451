#include "sim/solve/island_gradients.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/base/assert.h"
#include "sim/base/parallel.h"
#include "sim/base/stop.h"

namespace duet {
namespace {

constexpr int first_projections = 4;  // projections of the first residual, see conjugate_gradient()
// Largest norm of a residual over the least one before. The projection is approximate, so that directions
// keep a part that violates constraints. Where little else is left of a residual, steps along it are
// thousands of times too long, and the search would diverge.
constexpr double most_growth = 100;

// Returns the larger value; a NaN in `a` stays.
double larger(double a, double b) { return b <= a || std::isnan(a) ? a : b; }

// Limits the system and the projection to searched islands during its lifetime. At the end, the projection
// works with the masses of the particles again.
class Limits {
 public:
  Limits(VelocitySystem& system, ContactProjection* projection, const Islands& islands)
      : system_(system), projection_(projection) {
    system.limit_to(&islands);
    if (projection) projection->limit_to(&islands);
  }
  ~Limits() {
    system_.limit_to(nullptr);
    if (!projection_) return;
    projection_->limit_to(nullptr);
    projection_->use_inverse_masses(nullptr);
  }
  Limits(const Limits&) = delete;
  Limits& operator=(const Limits&) = delete;

 private:
  VelocitySystem& system_;
  ContactProjection* projection_;
};

// The search of one solve: sums, step lengths and updates for each island.
class Search {
 public:
  Search(VelocitySystem& system, Islands& islands, IslandSearch& scratch)
      : system_(system), islands_(islands), state_(scratch.state), partial_(scratch.partial) {
    state_.assign(islands.size(), {});
    partial_.resize(islands.ranges().size());
  }

  // Forgets the least norms.
  void restart() {
    for (State& state : state_) state.least = std::numeric_limits<double>::infinity();
  }
  // Computes the norms of the residual `r`, and the weights <r, r> / <r, r>_before of the last directions.
  void measure(const GeneralizedVelocity& r) {
    sum_up([&](std::size_t p) { return system_.particle_measure(p, r); },
           [&](std::size_t i) { return system_.rigid_measure(i, r); });
    for_each_searched([](State& state) {
      state.norm = std::sqrt(state.sum.norm);
      state.least = std::min(state.least, state.norm);
      state.share = state.sum.inner / state.left;
      state.left = state.sum.inner;
    });
  }
  // Computes the step lengths <r, r> / <s, q> along the direction `s` with the product `q`. Takes islands out
  // of the search where only rounding is left, <s, q> <= 0.
  void find_step(const GeneralizedVelocity& s, const GeneralizedVelocity& q) {
    using Measure = VelocitySystem::Measure;
    sum_up(
        [&](std::size_t p) {
          return Measure{system_.particle_inner(p, s.particle[p], q.particle[p]), 0};
        },
        [&](std::size_t i) {
          return Measure{system_.rigid_inner(i, s, q), 0};
        });
    for (std::size_t i = 0; i < state_.size(); ++i) {
      if (!islands_.is_searched(i)) continue;
      State& state = state_[i];
      state.share = state.left / state.sum.inner;
      if (!(state.sum.inner > 0)) islands_.leave(i);
    }
    islands_.update();
  }
  // Updates x += share s and r -= share q, and adds share times the damping forces of the last product to
  // those of x.
  void advance(const GeneralizedVelocity& s, const GeneralizedVelocity& q, GeneralizedVelocity& x,
               GeneralizedVelocity& r) {
    const std::vector<Vec3>& force = system_.forces();
    std::vector<Vec3>* collected = system_.collected();
    for_each_range([&](std::size_t p, double share) {
      x.particle[p] += share * s.particle[p];
      r.particle[p] -= share * q.particle[p];
      if (collected) (*collected)[p] += share * force[p];
    });
    for_each_body([&](std::size_t i, double share) {
      x.linear[i] += share * s.linear[i];
      x.angular[i] += share * s.angular[i];
      r.linear[i] -= share * q.linear[i];
      r.angular[i] -= share * q.angular[i];
    });
  }
  // Updates s = r + share s.
  void turn(const GeneralizedVelocity& r, GeneralizedVelocity& s) {
    for_each_range(
        [&](std::size_t p, double share) { s.particle[p] = r.particle[p] + share * s.particle[p]; });
    for_each_body([&](std::size_t i, double share) {
      s.linear[i] = r.linear[i] + share * s.linear[i];
      s.angular[i] = r.angular[i] + share * s.angular[i];
    });
  }

  // Takes islands out of the search whose residual has a norm of at most `tolerance`, or which diverge.
  void leave_finished(double tolerance) {
    const auto is_finished = [&](const State& state) {
      return state.norm <= tolerance || state.norm > most_growth * state.least;
    };
    for (std::size_t i = 0; i < state_.size(); ++i)
      if (islands_.is_searched(i) && is_finished(state_[i])) islands_.leave(i);
    islands_.update();
  }
  // Returns the largest norm of all islands, m/s, also of those that have converged.
  double largest_norm() const {
    double largest = 0;
    for (const State& state : state_) largest = larger(largest, state.norm);
    return largest;
  }

 private:
  using State = IslandSearch::State;

  // Calls work(state) for every searched island.
  template <class Work>
  void for_each_searched(Work&& work) {
    for (std::size_t i = 0; i < state_.size(); ++i)
      if (islands_.is_searched(i)) work(state_[i]);
  }
  // Calls work(particle, share of its island) for the particles of searched islands.
  template <class Work>
  void for_each_range(Work&& work) const {
    const std::vector<Islands::Range>& ranges = islands_.ranges();
    parallel_for(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k)
        for (std::size_t p = ranges[k].begin; p < ranges[k].end; ++p) work(p, state_[ranges[k].island].share);
    });
  }
  // Calls work(body, share of its island) for the rigid bodies of searched islands.
  template <class Work>
  void for_each_body(Work&& work) const {
    for (std::size_t i = 0; i < system_.rigid_count(); ++i)
      if (islands_.is_searched_rigid(i))
        work(i, state_[static_cast<std::size_t>(islands_.of_rigid(i))].share);
  }
  // Sums up measures of particles and rigid bodies for every searched island, in a fixed order.
  template <class OfParticle, class OfBody>
  void sum_up(OfParticle&& of_particle, OfBody&& of_body) {
    const std::vector<Islands::Range>& ranges = islands_.ranges();
    parallel_for(ranges.size(), 1, [&](std::size_t begin, std::size_t end) {
      for (std::size_t k = begin; k < end; ++k) {
        VelocitySystem::Measure sum;
        for (std::size_t p = ranges[k].begin; p < ranges[k].end; ++p) sum.add(of_particle(p));
        partial_[k] = sum;
      }
    });
    for_each_searched([](State& state) { state.sum = {}; });
    for (std::size_t k = 0; k < ranges.size(); ++k) state_[ranges[k].island].sum.add(partial_[k]);
    for (std::size_t i = 0; i < system_.rigid_count(); ++i)
      if (islands_.is_searched_rigid(i))
        state_[static_cast<std::size_t>(islands_.of_rigid(i))].sum.add(of_body(i));
  }

  VelocitySystem& system_;
  Islands& islands_;
  std::vector<State>& state_;
  std::vector<VelocitySystem::Measure>& partial_;
};

}  // namespace

CgResult solve_islands(VelocitySystem& system, ContactProjection* projection, BlockJacobi& masses,
                       AssembleBlocks blocks, Islands& islands, const GeneralizedVelocity& b,
                       double tolerance, int max_iterations, GeneralizedVelocity& x, IslandSearch& scratch) {
  DUET_ASSERT(tolerance >= 0 && max_iterations >= 0);
  GeneralizedVelocity &r = scratch.residual, &s = scratch.direction, &q = scratch.image;
  Search search(system, islands, scratch);
  CgResult result;
  const auto finish = [&] {
    result.residual = search.largest_norm();
    result.converged = result.residual <= tolerance;
    return result;
  };
  if (blocks == AssembleBlocks::all) VelocitySystem::forget(masses);  // also if this solve assembles none
  system.apply(x, q);
  system.accumulate(1);
  VelocitySystem::subtract(b, q, r);
  VelocitySystem::copy(r, s);
  system.project(s);
  search.measure(s);
  search.leave_finished(tolerance);
  if (islands.searched() == 0) return finish();

  const Limits limits(system, projection, islands);
  system.use(masses, AssembleBlocks::missing);
  system.apply_preconditioner(r);
  if (projection) projection->use_inverse_masses(&masses.inverse);
  for (int i = 0; i < first_projections; ++i) system.project(r);
  search.restart();  // with the norm in the new inner product
  search.measure(r);
  search.leave_finished(tolerance);
  VelocitySystem::copy(r, s);
  system.expect_reduction(search.largest_norm() / tolerance);
  for (; islands.searched() > 0 && result.iterations < max_iterations; ++result.iterations) {
    stop_if_asked();
    if (!std::isfinite(search.largest_norm())) break;
    system.apply(s, q);
    system.project(q);
    search.find_step(s, q);
    search.advance(s, q, x, r);
    system.project(r);
    search.measure(r);
    search.leave_finished(tolerance);
    search.turn(r, s);
  }
  return finish();
}

}  // namespace duet
