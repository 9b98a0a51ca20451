// Blocked scatter-add: sums of element values around each particle, for elements that are evaluated eight at
// a time (a batch) and in parallel. The sums are the same for any number of threads.
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
#include "sim/base/prefetch.h"
#include "sim/deformable/particle_mask.h"

namespace duet {

/// Number of batches by which loops ask for memory ahead of their work.
///
/// One batch takes less time than memory to answer, and many would drive the batches at work from the cache.
inline constexpr std::size_t batches_ahead = 2;

/// Sums values of elements around the particles that are their corners (a scatter-add).
///
/// A batch holds eight elements, one in each lane of a `double8`. Successive batches form a block, which one
/// thread evaluates. A block has one partial sum for every particle that its elements touch; the partial sums
/// of a particle are then added in the order of the blocks. So few values go through memory on their way to
/// the particles, and no result depends on the number of threads.
class ScatterAdd {
 public:
  /// Number of batches in a block; the last block may have fewer.
  static constexpr std::size_t batches_of_block = 32;
  /// Largest number of corners that an element may have.
  static constexpr std::size_t max_corners = 12;
  /// For one corner of a batch, the index of the partial sum of that corner's particle within the block, in
  /// each lane.
  using Slot = std::array<std::uint16_t, pack_width>;

  /// Returns the index of the element to put into `lane` of `batch`, out of a list in which neighbors share
  /// particles.
  ///
  /// Successive elements go into different batches of a block, because additions to the same partial sum in
  /// successive lanes would wait for each other. `batches` is the number of all batches. The result may be
  /// past the end of the list; that lane must then be padded.
  static std::size_t element_of(std::size_t batch, std::size_t lane, std::size_t batches) {
    const std::size_t first = batch - batch % batches_of_block;
    return first * pack_width + lane * std::min(batches_of_block, batches - first) + batch - first;
  }
  /// Lays out the blocks for `batches` and sets the `slot` of every batch from its `particle`.
  ///
  /// `Batch::particle` and `Batch::slot` are arrays with one entry for each corner. Lanes that pad a batch
  /// must repeat a valid particle.
  template <class Batch>
  void build(std::vector<Batch>& batches, std::size_t particle_count);

  /// Restricts the functions below to the particles of `mask` until the next call; null removes the
  /// restriction.
  ///
  /// Blocks whose range of particles meets no chunk of the mask are skipped. The mask is not copied: it must
  /// live as long as it is in use.
  void limit_to(const ParticleMask* mask) { mask_ = mask; }
  /// Returns whether the mask, if there is one, contains `particle`.
  bool takes(std::size_t particle) const { return !mask_ || mask_->has(particle); }

  /// Computes the partial sums of all blocks in parallel: calls add(index of a batch, partial sums of its
  /// block).
  ///
  /// The callback adds the values of the batch's corners to the partial sums with spread(). The partial sums
  /// are zero before the first batch of a block. Each partial sum consists of `rows` Quads.
  template <std::size_t rows = 1, class Add>
  void fill(Add&& add);
  /// Adds the vector `v` and the number `fourth` of each lane to the partial sum at that lane's slot.
  ///
  /// With `rows` greater than 1, `sums` must point to the wanted row of the block's first partial sum.
  template <std::size_t rows = 1>
  static void spread(const Slot& slot, const vector8& v, const double8& fourth, double4* sums) {
    alignas(sizeof(double8)) double4 values[pack_width];
    store_rows(v, fourth, values);
    for (std::size_t lane = 0; lane < pack_width; ++lane) sums[rows * slot[lane]] += values[lane];
  }

  /// Computes the partial sums from per-particle `values`: calls add(index of a batch, rows, partial sums of
  /// its block).
  ///
  /// `rows` holds the values at the particles of the block, for gather(): they are read from memory once for
  /// a block instead of once for each corner. `Row` is double4, or float4 for single precision; the rows of
  /// float4 hold the values relative to that of the block's first particle, so that differences keep their
  /// accuracy.
  template <class Row = double4, class Add>
  void fill_from(const std::vector<Vec3>& values, Add&& add);
  /// Computes partial sums from `values` by add() like fill_from(), and others from `others` by add_other(),
  /// block after block. The others are kept for add_kept_to().
  template <class Add, class AddOther>
  void fill_both_from(const std::vector<Vec3>& values, Add&& add, const std::vector<Vec3>& others,
                      AddOther&& add_other);
  /// Calls work(index of a batch, rows) like fill_from(), but computes no sums.
  template <class Row = double4, class Work>
  void visit(const std::vector<Vec3>& values, Work&& work) const;
  /// Returns the values of one corner in all eight lanes, from the rows of fill_from() or visit().
  static vector8 gather(const double4* rows, const Slot& slot) {
    return load_rows([&](std::size_t lane) { return rows[slot[lane]]; });
  }
  /// Returns the values of one corner in all eight lanes in single precision, relative to the block's first
  /// particle.
  static vector8f gather(const float4* rows, const Slot& slot) {
    return load_rows([&](std::size_t lane) { return rows[slot[lane]]; });
  }

  /// Calls work(particle, sum) in parallel for all particles that have elements.
  ///
  /// `sum` is an array of `rows` Quads, the total over all blocks.
  template <std::size_t rows = 1, class Work>
  void for_each(Work&& work) const {
    for_each<rows>(values_, work);
  }
  /// Adds the first three components of each particle's sum to its entry of `totals`.
  void add_to(std::vector<Vec3>& totals) const {
    for_each([&](std::size_t p, const std::array<double4, 1>& sum) {
      totals[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
    });
  }
  /// Adds the first three components of the sums that fill_both_from() has kept, under the same mask.
  void add_kept_to(std::vector<Vec3>& totals) const {
    for_each<1>(kept_, [&](std::size_t p, const std::array<double4, 1>& sum) {
      totals[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
    });
  }
  /// Adds the first three components of each particle's sum to `totals` and the fourth to `fourth`, unless
  /// `fourth` is empty.
  void add_to(std::vector<Vec3>& totals, std::vector<double>& fourth) const {
    if (fourth.empty()) return add_to(totals);
    for_each([&](std::size_t p, const std::array<double4, 1>& sum) {
      totals[p] += Vec3(sum[0][0], sum[0][1], sum[0][2]);
      fourth[p] += sum[0][3];
    });
  }

 private:
  // Number of partial sums by which for_each() asks for memory ahead of its additions.
  static constexpr std::size_t sums_ahead = 24;

  // Returns whether no particle between the block's first and last one is in the mask.
  bool is_idle(std::size_t block) const {
    return mask_ && !mask_->meets(particle_[first_[block]], particle_[first_[block + 1] - 1]);
  }
  // Calls of fill() and visit() for the batches [begin, end) of a block. What `add` and `work` call becomes
  // part of them, so that the values of a batch stay in registers and what two formulas share is computed
  // once.
  template <std::size_t rows, class Add>
  void fill_block(std::size_t begin, std::size_t end, Add& add);
  template <class Row, class Work>
  void visit_block(std::size_t begin, std::size_t end, const std::vector<Vec3>& values, Work&& work) const;
  // Returns the work of visit_block() that computes the partial sums in `all` by add().
  template <class Row, class Add>
  auto sums_by(Add& add, std::vector<double4>& all) const {
    return [&](std::size_t b, const Row* rows) {
      const std::size_t block = b / batches_of_block;
      double4* sums = all.data() + first_[block];
      if (b % batches_of_block == 0) std::fill(sums, all.data() + first_[block + 1], double4{});
      add(b, rows, sums);
    };
  }
  template <std::size_t rows, class Work>
  void for_each(const std::vector<double4>& values, Work&& work) const;

  const ParticleMask* mask_ = nullptr;
  std::size_t batches_ = 0;
  std::vector<std::size_t> first_;       // by block: index of its first partial sum; one entry past the last
  std::vector<std::uint32_t> particle_;  // by partial sum: its particle, ascending within a block
  std::vector<std::uint32_t> start_;     // by particle: its first entry in sum_; one entry past the last
  // Indices of partial sums, grouped by particle, and sums_ahead more valid ones.
  std::vector<std::uint32_t> sum_;
  std::vector<double4> values_;  // the partial sums, `rows` Quads each
  std::vector<double4> kept_;    // those of fill_both_from(), one double4 each
};

template <class Batch>
void ScatterAdd::build(std::vector<Batch>& batches, std::size_t particle_count) {
  batches_ = batches.size();
  std::vector<int> here;  // particles of the block, ascending, each once
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
  sum_.assign(particle_.size() + sums_ahead, 0);
  std::vector<std::uint32_t> next = start_;
  for (std::size_t k = 0; k < particle_.size(); ++k)
    sum_[next[particle_[k]]++] = static_cast<std::uint32_t>(k);
  values_.resize(particle_.size());
}

template <std::size_t rows, class Add>
void ScatterAdd::fill(Add&& add) {
  values_.resize(std::max(values_.size(), rows * particle_.size()));
  parallel_for(batches_, batches_of_block,
               [&](std::size_t begin, std::size_t end) { fill_block<rows>(begin, end, add); });
}

template <std::size_t rows, class Add>
[[gnu::flatten]] void ScatterAdd::fill_block(std::size_t begin, std::size_t end, Add& add) {
  const std::size_t block = begin / batches_of_block;
  if (is_idle(block)) return;
  double4* sums = values_.data() + rows * first_[block];
  std::fill(sums, values_.data() + rows * first_[block + 1], double4{});
  for (std::size_t b = begin; b < end; ++b) add(b, sums);
}

template <class Row, class Work>
void ScatterAdd::visit(const std::vector<Vec3>& values, Work&& work) const {
  parallel_for(batches_, batches_of_block,
               [&](std::size_t begin, std::size_t end) { visit_block<Row>(begin, end, values, work); });
}

template <class Row, class Work>
[[gnu::flatten]] void ScatterAdd::visit_block(std::size_t begin, std::size_t end,
                                              const std::vector<Vec3>& values, Work&& work) const {
  const std::size_t block = begin / batches_of_block;
  if (is_idle(block)) return;
  const std::size_t first = first_[block], last = first_[block + 1];
  Row rows[max_corners * batches_of_block * pack_width];
  using Scalar = std::remove_cvref_t<decltype(rows[0][0])>;
  const Vec3 origin = std::is_same_v<Row, double4> ? Vec3(Vec3::Zero()) : values[particle_[first]];
  for (std::size_t k = first; k < last; ++k) {
    const Vec3 value = values[particle_[k]] - origin;
    rows[k - first] =
        Row{static_cast<Scalar>(value[0]), static_cast<Scalar>(value[1]), static_cast<Scalar>(value[2]), 0};
  }
  for (std::size_t b = begin; b < end; ++b) work(b, rows);
}

template <class Row, class Add>
void ScatterAdd::fill_from(const std::vector<Vec3>& values, Add&& add) {
  visit<Row>(values, sums_by<Row>(add, values_));
}

template <class Add, class AddOther>
void ScatterAdd::fill_both_from(const std::vector<Vec3>& values, Add&& add, const std::vector<Vec3>& others,
                                AddOther&& add_other) {
  kept_.resize(particle_.size());
  parallel_for(batches_, batches_of_block, [&](std::size_t begin, std::size_t end) {
    visit_block<double4>(begin, end, values, sums_by<double4>(add, values_));
    visit_block<double4>(begin, end, others, sums_by<double4>(add_other, kept_));
  });
}

template <std::size_t rows, class Work>
void ScatterAdd::for_each(const std::vector<double4>& values, Work&& work) const {
  if (batches_ == 0) return;
  constexpr std::size_t grain = ParticleMask::chunk;
  parallel_for(start_.size() - 1, grain, [&](std::size_t begin, std::size_t end) {
    if (mask_ && !mask_->has_chunk(begin / grain)) return;
    for (std::size_t p = begin; p < end; ++p) {
      if (start_[p] == start_[p + 1]) continue;
      std::array<double4, rows> sum{};
      for (std::uint32_t k = start_[p]; k < start_[p + 1]; ++k) {
        __builtin_prefetch(&values[rows * sum_[k + sums_ahead]]);
        for (std::size_t row = 0; row < rows; ++row) sum[row] += values[rows * sum_[k] + row];
      }
      work(p, sum);
    }
  });
}

}  // namespace duet
