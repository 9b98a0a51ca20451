#include "sim/geometry/mesh/sheets.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>

#include "sim/base/assert.h"
#include "sim/base/elementary.h"

namespace duet {
namespace {

constexpr double full_turn = 2 * std::numbers::pi;
// Number of chords per segment whose lengths are summed to arc lengths. More of them space the nodes more
// evenly.
constexpr int fine_pieces = 64;

// Returns nodes at equal arc lengths on the curve at(u), u in [0, 1].
Curve evenly(const std::function<Vec3(double)>& at, int segments, CurveEnds ends) {
  const bool is_closed = ends == CurveEnds::are_joined;
  const int fine = fine_pieces * segments;
  std::vector<Vec3> points;
  std::vector<double> length{0};
  for (int i = 0; i <= fine; ++i) {
    points.push_back(at(static_cast<double>(i) / fine));
    if (i > 0) length.push_back(length.back() + (points[as_index(i)] - points[as_index(i - 1)]).norm());
  }
  Curve curve;
  curve.is_closed = is_closed;
  std::size_t k = 1;
  for (int i = 0; i <= segments - (is_closed ? 1 : 0); ++i) {
    const double wanted = length.back() * i / segments;
    while (k + 1 < length.size() && length[k] < wanted) ++k;
    const double step = length[k] - length[k - 1];
    const double t = step > 0 ? std::clamp((wanted - length[k - 1]) / step, 0.0, 1.0) : 0;
    curve.nodes.push_back((1 - t) * points[k - 1] + t * points[k]);
  }
  return curve;
}

}  // namespace

Sheet panel(const Vec2& size, int cells_x, int cells_z) {
  DUET_ASSERT(size.minCoeff() > 0 && cells_x > 0 && cells_z > 0);
  Sheet sheet;
  const auto node = [&](int i, int k) { return k * (cells_x + 1) + i; };
  for (int k = 0; k <= cells_z; ++k)
    for (int i = 0; i <= cells_x; ++i)
      sheet.nodes.emplace_back(size.x() * (static_cast<double>(i) / cells_x - 0.5), 0,
                               size.y() * (static_cast<double>(k) / cells_z - 0.5));
  for (int k = 0; k < cells_z; ++k)
    for (int i = 0; i < cells_x; ++i) {
      const int a = node(i, k), b = node(i, k + 1), c = node(i + 1, k + 1), d = node(i + 1, k);
      if ((i + k) % 2 == 0) {
        sheet.triangles.push_back({a, b, c});
        sheet.triangles.push_back({a, c, d});
      } else {
        sheet.triangles.push_back({a, b, d});
        sheet.triangles.push_back({b, c, d});
      }
    }
  return sheet;
}

Sheet disc(double radius, int rings) {
  DUET_ASSERT(radius > 0 && rings > 0);
  Sheet sheet;
  sheet.nodes.emplace_back(Vec3::Zero());
  // Returns node i of ring k; numbers beyond the end of the ring wrap around.
  const auto node = [](int k, int i) { return k == 0 ? 0 : 1 + 3 * k * (k - 1) + i % (6 * k); };
  for (int k = 1; k <= rings; ++k)
    for (int i = 0; i < 6 * k; ++i) {
      const double angle = full_turn * i / (6 * k), r = radius * k / rings;
      sheet.nodes.emplace_back(r * math::sin(angle), 0, r * math::cos(angle));
    }
  for (int k = 1; k <= rings; ++k)
    for (int sector = 0; sector < 6; ++sector)
      for (int i = 0; i < k; ++i) {
        const int outer = sector * k + i, inner = sector * (k - 1) + i;
        sheet.triangles.push_back({node(k, outer), node(k, outer + 1), node(k - 1, inner)});
        if (i + 1 < k)
          sheet.triangles.push_back({node(k, outer + 1), node(k - 1, inner + 1), node(k - 1, inner)});
      }
  return sheet;
}

std::vector<SheetEdge> edges(const Sheet& sheet) {
  std::vector<SheetEdge> result;
  std::map<std::pair<int, int>, std::size_t> known;
  for (const Triangle& t : sheet.triangles)
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = t[i], b = t[(i + 1) % 3], opposite = t[(i + 2) % 3];
      const auto [entry, is_new] = known.try_emplace(std::minmax(a, b), result.size());
      if (is_new)
        result.push_back({a, b, opposite, -1});
      else
        result[entry->second].other_opposite = opposite;
    }
  return result;
}

Curve curve_through(const std::vector<Vec3>& points, int segments, CurveEnds ends) {
  DUET_ASSERT(points.size() >= 2 && segments > 0);
  const bool is_closed = ends == CurveEnds::are_joined;
  const int count = static_cast<int>(points.size()), spans = is_closed ? count : count - 1;
  // Returns control point i. An open curve goes straight on beyond its ends.
  const auto point = [&](int i) -> Vec3 {
    if (is_closed) return points[as_index((i + count) % count)];
    if (i < 0) return 2 * points[0] - points[1];
    if (i >= count) return 2 * points[as_index(count - 1)] - points[as_index(count - 2)];
    return points[as_index(i)];
  };
  const auto at = [&](double u) -> Vec3 {
    const int i = std::min(static_cast<int>(u * spans), spans - 1);
    const double t = u * spans - i;
    const Vec3 a = point(i - 1), b = point(i), c = point(i + 1), d = point(i + 2);
    return b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
  };
  return evenly(at, segments, ends);
}

Curve helix(double radius, double pitch, double turns, int segments) {
  DUET_ASSERT(segments > 0);
  return evenly(
      [&](double u) {
        const double angle = full_turn * turns * u;
        return Vec3(radius * math::cos(angle), pitch * turns * (u - 0.5), -radius * math::sin(angle));
      },
      segments, CurveEnds::are_apart);
}

Curve torus_knot(double radius, double tube, int p, int q, int segments) {
  DUET_ASSERT(segments > 0);
  return evenly(
      [&](double u) {
        const double about = full_turn * p * u, around = full_turn * q * u;
        const double r = radius + tube * math::cos(around);
        return Vec3(r * math::cos(about), tube * math::sin(around), r * math::sin(about));
      },
      segments, CurveEnds::are_joined);
}

}  // namespace duet
