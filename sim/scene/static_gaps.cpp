#include "sim/scene/static_gaps.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/base/index.h"
#include "sim/coupling/body_bounds.h"
#include "sim/coupling/seams.h"

namespace duet {
namespace {

constexpr double widest = 0.1;  // of the smallest size: wider ones are there to be seen

}  // namespace

std::vector<StaticGap> static_gaps(const Bodies& bodies) {
  std::vector<BodyBounds> bounds;
  bound_bodies(bodies, bounds);
  bounds.resize(bodies.rigid.size());
  std::vector<StaticGap> gaps;
  if (std::none_of(bounds.begin(), bounds.end(), [](const BodyBounds& body) { return body.is_dynamic; }))
    return gaps;
  const auto is_piece = [](const BodyBounds& body) { return body.is_static && !body.is_half_space; };
  for (std::size_t a = 0; a < bounds.size(); ++a)
    for (std::size_t b = a + 1; is_piece(bounds[a]) && b < bounds.size(); ++b) {
      if (!is_piece(bounds[b])) continue;
      const double gap = separation(bounds[a], bounds[b]),
                   size = std::min(bounds[a].thickness, bounds[b].thickness);
      if (gap > adjoin_within * size && gap < widest * size)
        gaps.push_back({bodies.rigid.name[a], bodies.rigid.name[b], gap});
    }
  return gaps;
}

std::string describe_gaps(const std::vector<StaticGap>& gaps) {
  if (gaps.empty()) return {};
  const std::string more =
      gaps.size() > 1 ? fmt::format(" (and {} more pair{})", gaps.size() - 1, gaps.size() > 2 ? "s" : "")
                      : "";
  return fmt::format(
      "the static bodies `{}` and `{}` stand {:.3g} m apart{}: what rolls or slides over such a gap may be "
      "stopped or thrown up by the second one; put them flush, then they are one floor",
      gaps[0].first, gaps[0].second, gaps[0].gap, more);
}

}  // namespace duet
