// Sums over the elements around each particle, for elements that are evaluated eight at a time (a batch) and
// in parallel: the same for any number of threads. Batches that follow each other make a block. It has a sum
// for every particle that they touch, so that few values go through memory on their way to the particles.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "sim/base/pack_vector.h"
#include "sim/base/parallel.h"
#include "sim/deformable/particle_mask.h"

namespace duet {

class BlockSums {
 public:
  static constexpr std::size_t batches_of_block = 32;
  static constexpr std::size_t most_corners = 4;  // of an element
  // Where the block of a batch has the sums of what lies in each lane.
  using Slot = std::array<std::uint16_t, pack_width>;

  // The element to put into a lane, of a list in which neighbours share particles: they come into different
  // batches of a block, as sums that follow upon each other would wait for each other. May be past the end.
  static std::size_t element_of(std::size_t batch, std::size_t lane, std::size_t batches) {
    const std::size_t first = batch - batch % batches_of_block;
    return first * pack_width + lane * std::min(batches_of_block, batches - first) + batch - first;
  }
  // Sets the `slot`s of all batches from their `particle`s: arrays of one entry a corner.
  template <class Batch>
  void build(std::vector<Batch>& batches, std::size_t particle_count);

  // The functions below leave out the particles that `mask` does not have, and the blocks that touch none of
  // its chunks, until the next call; null for none.
  void limit_to(const ParticleMask* mask) { mask_ = mask; }
  bool takes(std::size_t particle) const { return !mask_ || mask_->has(particle); }

  // Calls add(index of a batch, sums of its block), which is to spread() what the batch has for its corners.
  // A particle has as many sums as there are `rows`.
  template <std::size_t rows = 1, class Add>
  void fill(Add&& add);
  template <std::size_t rows = 1>
  static void spread(const Slot& slot, const PackVector& v, const Pack& fourth, Quad* sums) {
    alignas(sizeof(Pack)) Quad values[pack_width];
    store_rows(v, fourth, values);
    for (std::size_t lane = 0; lane < pack_width; ++lane) sums[rows * slot[lane]] += values[lane];
  }

  // fill() for what is made of `values` of the particles: calls add(index of a batch, rows, sums), where
  // `rows` has the values at the batch's slots, for gather(). They are sought in memory once a block instead
  // of once a corner.
  // Row is Quad, or QuadF for single precision: rows then have the values relative to one of their block.
  template <class Row = Quad, class Add>
  void fill_from(const std::vector<Vec3>& values, Add&& add);
  // The same without sums: calls work(index of a batch, rows).
  template <class Row = Quad, class Work>
  void visit(const std::vector<Vec3>& values, Work&& work) const;
  static PackVector gather(const Quad* rows, const Slot& slot) {
    return load_rows([&](std::size_t lane) { return rows[slot[lane]]; });
  }
  static PackVectorF gather(const QuadF* rows, const Slot& slot) {
    return load_rows([&](std::size_t lane) { return rows[slot[lane]]; });
  }

  // Calls work(particle, its sums over all blocks: an array of `rows` Quads) in parallel, for the particles
  // that have elements.
  template <std::size_t rows = 1, class Work>
  void for_each(Work&& work) const;
  // Adds the first three members of each particle's sum.
  void add_to(std::vector<Vec3>& totals) const {
    for_each([&](std::size_t p, const std::array<Quad, 1>& sum) {
      totals[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
    });
  }
  // And the fourth, unless `fourth` is empty.
  void add_to(std::vector<Vec3>& totals, std::vector<double>& fourth) const {
    if (fourth.empty()) return add_to(totals);
    for_each([&](std::size_t p, const std::array<Quad, 1>& sum) {
      totals[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
      fourth[p] += sum[0][3];
    });
  }

 private:
  bool is_idle(std::size_t block) const {
    return mask_ && !mask_->meets(particle_[first_[block]], particle_[first_[block + 1] - 1]);
  }

  const ParticleMask* mask_ = nullptr;
  std::size_t batches_ = 0;
  std::vector<std::size_t> first_;       // sum of every block, and one past the last
  std::vector<std::uint32_t> particle_;  // of every sum of the blocks, ascending in each
  std::vector<std::uint32_t> start_;     // of every particle's entries in the next, and one past the last
  std::vector<std::uint32_t> sum_;       // the blocks' sums by particle
  std::vector<Quad> values_;
};

template <class Batch>
void BlockSums::build(std::vector<Batch>& batches, std::size_t particle_count) {
  batches_ = batches.size();
  std::vector<int> here;  // the particles of one block's sums
  particle_.clear();
  first_.assign(1, 0);
  for (std::size_t begin = 0; begin < batches.size(); begin += batches_of_block) {
    const auto block = std::span(batches).subspan(begin, std::min(batches_of_block, batches.size() - begin));
    here.clear();
    for (const Batch& batch : block)
      for (const auto& corner : batch.particle) here.insert(here.end(), corner.begin(), corner.end());
    std::sort(here.begin(), here.end());
    here.erase(std::unique(here.begin(), here.end()), here.end());
    for (Batch& batch : block)
      for (std::size_t i = 0; i < batch.particle.size(); ++i)
        for (std::size_t lane = 0; lane < pack_width; ++lane)
          batch.slot[i][lane] = static_cast<std::uint16_t>(
              std::lower_bound(here.begin(), here.end(), batch.particle[i][lane]) - here.begin());
    particle_.insert(particle_.end(), here.begin(), here.end());
    first_.push_back(particle_.size());
  }
  start_.assign(particle_count + 1, 0);
  for (const std::uint32_t p : particle_) ++start_[p + std::size_t{1}];
  for (std::size_t p = 0; p < particle_count; ++p) start_[p + 1] += start_[p];
  sum_.resize(particle_.size());
  std::vector<std::uint32_t> next = start_;
  for (std::size_t k = 0; k < particle_.size(); ++k)
    sum_[next[particle_[k]]++] = static_cast<std::uint32_t>(k);
  values_.resize(particle_.size());
}

template <std::size_t rows, class Add>
void BlockSums::fill(Add&& add) {
  values_.resize(std::max(values_.size(), rows * sum_.size()));
  parallel_for(batches_, batches_of_block, [&](std::size_t begin, std::size_t end) {
    const std::size_t block = begin / batches_of_block;
    if (is_idle(block)) return;
    Quad* sums = values_.data() + rows * first_[block];
    std::fill(sums, values_.data() + rows * first_[block + 1], Quad{});
    for (std::size_t b = begin; b < end; ++b) add(b, sums);
  });
}

template <class Row, class Work>
void BlockSums::visit(const std::vector<Vec3>& values, Work&& work) const {
  parallel_for(batches_, batches_of_block, [&](std::size_t begin, std::size_t end) {
    if (is_idle(begin / batches_of_block)) return;
    const std::size_t first = first_[begin / batches_of_block], last = first_[begin / batches_of_block + 1];
    Row rows[most_corners * batches_of_block * pack_width];
    using Scalar = std::remove_cvref_t<decltype(rows[0][0])>;
    const Vec3 origin = std::is_same_v<Row, Quad> ? Vec3(Vec3::Zero()) : values[particle_[first]];
    for (std::size_t k = first; k < last; ++k) {
      const Vec3 value = values[particle_[k]] - origin;
      rows[k - first] =
          Row{static_cast<Scalar>(value[0]), static_cast<Scalar>(value[1]), static_cast<Scalar>(value[2]), 0};
    }
    for (std::size_t b = begin; b < end; ++b) work(b, rows);
  });
}

template <class Row, class Add>
void BlockSums::fill_from(const std::vector<Vec3>& values, Add&& add) {
  visit<Row>(values, [&](std::size_t b, const Row* rows) {
    const std::size_t block = b / batches_of_block;
    Quad* sums = values_.data() + first_[block];
    if (b % batches_of_block == 0) std::fill(sums, values_.data() + first_[block + 1], Quad{});
    add(b, rows, sums);
  });
}

template <std::size_t rows, class Work>
void BlockSums::for_each(Work&& work) const {
  if (batches_ == 0) return;
  constexpr std::size_t grain = ParticleMask::chunk;
  parallel_for(start_.size() - 1, grain, [&](std::size_t begin, std::size_t end) {
    if (mask_ && !mask_->has_chunk(begin / grain)) return;
    for (std::size_t p = begin; p < end; ++p) {
      if (start_[p] == start_[p + 1]) continue;
      std::array<Quad, rows> sum{};
      for (std::uint32_t k = start_[p]; k < start_[p + 1]; ++k)
        for (std::size_t row = 0; row < rows; ++row) sum[row] += values_[rows * sum_[k] + row];
      work(p, sum);
    }
  });
}

}  // namespace duet
