#include "sim/scene/reader/deformable_reader.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>

#include <fmt/format.h>

#include "sim/scene/deformables.h"
#include "sim/scene/reader/table_reader.h"

namespace duet::scene {
namespace {

// Keys of the kinds of shapes, in the order of DeformableKind.
constexpr std::array<std::string_view, 13> deformable_kinds = {
    "box",   "sphere", "capsule", "cylinder", "torus", "mesh",    "tets",
    "panel", "disc",   "rod",     "helix",    "knot",  "particle"};

// Reports flaws of the points of a rod. Returns whether there are none.
bool check_points(const DeformableShape& shape, const toml::node& at, const std::string& path,
                  Problems& problems) {
  if (!at.is_table() || !(*at.as_table())["points"].is_array()) return false;  // reported before
  const std::size_t least = shape.is_closed ? 3 : 2;
  if (shape.points.size() < least) {
    problems.add(at.source(), path + ".points", fmt::format("has {} points", shape.points.size()),
                 shape.is_closed ? "a closed rod needs three or more" : "a rod needs two or more");
    return false;
  }
  for (std::size_t i = 1; i < shape.points.size(); ++i)
    if (shape.points[i] == shape.points[i - 1]) {
      problems.add(at.source(), fmt::format("{}.points[{}]", path, i),
                   "is the same point as the one before it", "remove one of them");
      return false;
    }
  return true;
}

// Reports flaws of a knot. Returns whether there are none.
bool check_knot(const DeformableShape& shape, const toml::node& at, const std::string& path,
                Problems& problems) {
  const std::size_t before = problems.count();
  if (shape.tube > 0 && shape.radius > 0 && shape.tube >= shape.radius)
    problems.add(
        at.source(), path + ".tube",
        fmt::format("{:.6g} m must be less than the ring's radius {:.6g} m", shape.tube, shape.radius),
        "the knot winds about its ring");
  if (std::gcd(shape.winding.x(), shape.winding.y()) != 1)
    problems.add(at.source(), path + ".winding",
                 fmt::format("{} and {} have a common divisor: the curve would run over itself",
                             shape.winding.x(), shape.winding.y()),
                 "[2, 3] is the trefoil");
  return problems.count() == before;
}

// Reports keys that the kind of the shape does not have, and a missing thickness.
void check_volume_keys(const DeformableBody& body, const toml::table& table, const std::string& path,
                       Problems& problems) {
  const toml::node* given = table.get("thickness");
  if (body.shape.is_particle()) {
    for (const std::string_view key : {"thickness", "incompressible", "self_collision", "collision_thickness",
                                       "collision_friction", "angular_velocity", "rotation"})
      if (const toml::node* node = table.get(key))
        problems.add(node->source(), fmt::format("{}.{}", path, key), "has no effect on a particle",
                     "it has a radius and neither a surface nor a spin");
    return;
  }
  if (body.shape.is_volume() && given)
    problems.add(given->source(), path + ".thickness", "has no effect on a volume",
                 "it belongs to shells and rods");
  if (const toml::node* node = table.get("incompressible"); node && !body.shape.is_volume())
    problems.add(node->source(), path + ".incompressible", "has no effect on a shell or rod",
                 "it has no volume to keep");
  if (!body.shape.is_volume() && !given)
    problems.add(table.source(), path + ".thickness", "missing key",
                 body.shape.is_shell() ? "in m, for example 0.001 for cloth" : "in m, the rod's diameter");
}

// Checks the keys of skins and of bonds to bones, and reads the mesh of a skin.
void check_additions(DeformableBody& body, const toml::table& table, const std::string& path,
                     ShapeReader& shapes, Problems& problems) {
  const toml::node* springs = table.get("attach_springs");
  if (springs && body.attach.empty())
    problems.add(springs->source(), path + ".attach_springs", "has no effect without `attach`",
                 "name the bones in `attach`");
  if (const toml::node* drawn = table.get("drawn");
      drawn && (body.skin || body.shape.kind != DeformableKind::mesh))
    problems.add(drawn->source(), path + ".drawn",
                 body.skin ? "has no effect beside a `skin`" : "has no effect on a shape that is no mesh",
                 body.skin ? "the skin is drawn" : "leave it out");
  const toml::node* skin = table.get("skin");
  if (!skin || !skin->is_table() || !body.skin) return;
  if (!body.shape.is_volume())
    problems.add(skin->source(), path + ".skin", "has no effect on a body without tetrahedra",
                 "it belongs to volumes");
  else
    shapes.check(*body.skin, *skin->as_table(), path + ".skin");
}

// Returns whether a volume that needs a mesh or tetrahedra from a file has them.
bool has_its_mesh(const DeformableShape& shape) {
  return shape.kind == DeformableKind::tets ? shape.tets != nullptr
                                            : shape.kind != DeformableKind::mesh || shape.surface.mesh;
}

// Makes the mesh that a volume fills its skin, if it has none and the mesh is to be drawn. The boundary of
// the tetrahedra is coarser than the mesh.
void draw_own_mesh(DeformableBody& body) {
  const Shape& surface = body.shape.surface;
  if (body.skin || body.shape.kind != DeformableKind::mesh || body.drawn == DrawnSurface::tetrahedra) return;
  Skin& skin = body.skin.emplace();
  skin.mesh_file = surface.mesh_file;
  skin.scale = surface.scale;
  skin.mesh = surface.mesh;
}

// Reports pins that hold no particle, which is a mistake in their position.
void check_pins(const DeformableBody& body, const toml::table& table, const std::string& path,
                Problems& problems) {
  const toml::node* pins = table.get("pins");
  if (!pins) return;
  const std::vector<Vec3> nodes = rest_nodes(body);
  const std::vector<ListedTable> tables = listed_tables(*pins, path + ".pins");
  for (std::size_t i = 0; i < body.pins.size() && i < tables.size(); ++i) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& node : nodes) nearest = std::min(nearest, distance(body.pins[i], node));
    if (nearest > body.pins[i].radius)
      problems.add(tables[i].table->source(), tables[i].path,
                   fmt::format("holds no particle: the nearest one is {:.4g} m away, the radius is {:.4g} m",
                               nearest, body.pins[i].radius),
                   "pins are in the coordinates of the shape at rest; move it, or raise its radius");
  }
}

}  // namespace

void check_deformable(DeformableBody& body, const toml::table& body_table, const std::string& path,
                      ShapeReader& shapes, Problems& problems) {
  const toml::table* table = body_table["shape"].as_table();
  if (!table) return;
  const std::string at = path + ".shape";
  const std::size_t before = problems.count();
  const auto kind = only_kind(*table, deformable_kinds, at, problems);
  if (!kind) return;
  DeformableShape& shape = body.shape;
  shape.kind = static_cast<DeformableKind>(*kind);
  const toml::node& value = *table->get(deformable_kinds[*kind]);
  const std::string key = fmt::format("{}.{}", at, deformable_kinds[*kind]);
  check_volume_keys(body, body_table, path, problems);
  check_additions(body, body_table, path, shapes, problems);
  if (shape.is_volume()) {
    shapes.check(shape, *table, at);
    draw_own_mesh(body);
  } else {
    for (const std::string_view other : {"cells", "pattern", "spacing", "graded", "scale"})
      if (const toml::node* node = table->get(other))
        problems.add(node->source(), fmt::format("{}.{}", at, other),
                     fmt::format("has no effect on a {}", deformable_kinds[*kind]), "it belongs to a volume");
  }
  if (shape.kind == DeformableKind::rod && !check_points(shape, value, key, problems)) return;
  if (shape.kind == DeformableKind::knot && !check_knot(shape, value, key, problems)) return;
  const bool is_readable = shape.kind == DeformableKind::box ? value.is_array()
                           : shape.is_volume()               ? has_its_mesh(shape)
                           : shape.is_particle()             ? value.is_number()
                                                             : value.is_table();
  if (is_readable && problems.count() == before) check_pins(body, body_table, path, problems);
}

}  // namespace duet::scene
