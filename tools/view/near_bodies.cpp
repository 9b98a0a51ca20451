#include "tools/view/near_bodies.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "sim/io/export/tracks.h"

namespace duet::view {
namespace {

TriangleMesh mesh_of(const Surface& surface) {
  TriangleMesh mesh;
  mesh.positions = surface.positions;
  for (const std::array<Corner, 3>& t : surface.triangles)
    mesh.triangles.push_back({t[0].position, t[1].position, t[2].position});
  return mesh;
}

bool is_static(const io::ExportedBody& body) { return body.kind == "static"; }

Eigen::AlignedBox3d widened(Eigen::AlignedBox3d box, double by) {
  box.min().array() -= by;
  box.max().array() += by;
  return box;
}

// As io::place, without the normals, which nobody asks for here.
void place_positions(const io::ExportedBody& body, const io::FrameValues& values, std::vector<Vec3>& out) {
  if (!body.is_rigid()) {
    for (std::size_t i = 0; i < out.size(); ++i) out[i] = values.points.at(body.first_point + i);
    return;
  }
  const Pose& pose = values.rigid.at(as_index(body.row)).pose;
  const Mat3 rotation = pose.orientation.toRotationMatrix();
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = rotation * body.rest.positions[i] + pose.position;
}

}  // namespace

NearBodies::NearBodies(const io::ExportedRun& run, std::optional<double> ground)
    : run_(run),
      ground_(ground),
      shape_of_(io::first_with_same_surface(run.bodies())),
      trees_(run.bodies().size()),
      meshes_(run.bodies().size()),
      boxes_(run.bodies().size()) {
  for (const io::ExportedBody& body : run.bodies()) placed_.push_back(body.rest);
}

std::vector<std::vector<std::uint8_t>> NearBodies::at(const io::FrameValues& values) {
  place_bodies(values);
  marks_.assign(placed_.size(), {});
  if (ground_)
    for (std::size_t i = 0; i < placed_.size(); ++i)
      if (!is_static(run_.bodies()[i])) mark_near_ground(i);
  // Sweep along x: of boxes in the order of their lower ends, only those that begin before another one ends
  // meet it.
  std::vector<std::size_t> order(placed_.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return boxes_[a].min().x() < boxes_[b].min().x(); });
  for (std::size_t i = 0; i < order.size(); ++i) {
    const std::size_t a = order[i];
    const double reach = near_fraction * boxes_[a].diagonal().norm();
    for (std::size_t k = i + 1; k < order.size(); ++k) {
      const std::size_t b = order[k];
      if (boxes_[b].min().x() > boxes_[a].max().x() + reach) break;
      if (is_static(run_.bodies()[a]) && is_static(run_.bodies()[b])) continue;
      if (!widened(boxes_[a], reach).intersects(boxes_[b])) continue;
      mark_near(a, b, values);
      mark_near(b, a, values);
    }
  }
  return std::move(marks_);
}

void NearBodies::place_bodies(const io::FrameValues& values) {
  for (std::size_t i = 0; i < placed_.size(); ++i) {
    const io::ExportedBody& body = run_.bodies()[i];
    if (!body.is_rigid()) trees_[i].reset();
    place_positions(body, values, placed_[i].positions);
    boxes_[i].setEmpty();
    for (const Vec3& x : placed_[i].positions) boxes_[i].extend(x);
  }
}

void NearBodies::mark_near_ground(std::size_t body) {
  const double reach = near_fraction * boxes_[body].diagonal().norm();
  if (boxes_[body].min().y() > *ground_ + reach) return;
  for (std::size_t i = 0; i < placed_[body].positions.size(); ++i)
    mark(body, i, placed_[body].positions[i].y() - *ground_, reach);
}

void NearBodies::mark_near(std::size_t guest, std::size_t host, const io::FrameValues& values) {
  const double reach =
      near_fraction * std::min(boxes_[guest].diagonal().norm(), boxes_[host].diagonal().norm());
  const Eigen::AlignedBox3d around = widened(boxes_[host], reach);
  const io::ExportedBody& body = run_.bodies()[host];
  const Pose pose = body.is_rigid() ? values.rigid.at(as_index(body.row)).pose : Pose();
  for (std::size_t i = 0; i < placed_[guest].positions.size(); ++i) {
    const Vec3& position = placed_[guest].positions[i];
    if (!around.contains(position)) continue;
    const TriangleTree& tree = tree_of(host);
    const TriangleMesh& mesh = meshes_[shape_of_[host]];
    const Vec3 x = pose.orientation.conjugate() * (position - pose.position);
    double squared = reach * reach;
    tree.query(widened(Eigen::AlignedBox3d(x, x), reach), [&](int t) {
      const auto triangle = as_index(t);
      const Vec3 nearest =
          nearest_point(mesh.corner(triangle, 0), mesh.corner(triangle, 1), mesh.corner(triangle, 2), x);
      squared = std::min(squared, (nearest - x).squaredNorm());
    });
    mark(guest, i, std::sqrt(squared), reach);
  }
}

void NearBodies::mark(std::size_t body, std::size_t position, double distance, double reach) {
  if (!(distance < reach)) return;
  std::vector<std::uint8_t>& marks = marks_[body];
  if (marks.empty()) marks.resize(placed_[body].positions.size());
  const auto byte = static_cast<std::uint8_t>(std::ceil(255 * (1 - std::max(distance, 0.0) / reach)));
  marks[position] = std::max(marks[position], byte);
}

const TriangleTree& NearBodies::tree_of(std::size_t body) {
  const std::size_t shape = shape_of_[body];
  if (!trees_[shape]) {
    const io::ExportedBody& first = run_.bodies()[shape];
    meshes_[shape] = mesh_of(first.is_rigid() ? first.rest : placed_[shape]);
    trees_[shape].emplace(meshes_[shape]);
  }
  return *trees_[shape];
}

}  // namespace duet::view
