#include "sim/scene/build/skins.h"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "sim/base/error.h"
#include "sim/geometry/level_set/shape_mesh.h"
#include "sim/geometry/mesh/triangle_mesh.h"
#include "sim/geometry/queries/triangle_tree.h"

namespace duet::scene {

BodyShape skinned(const scene::DeformableBody& description, const TetMesh& mesh, std::size_t first_particle) {
  if (!description.skin->mesh)
    throw Error(ExitStatus::usage,
                fmt::format("deformable.{}.skin: the scene was read without its meshes", description.name));
  BodyShape shape;
  shape.name = description.name;
  shape.surface.surface = mesh_surface(in_frame(*description.skin->mesh, description.skin->scale, Pose{}));
  shape.skin = CarriedSurface(shape.surface.surface, mesh);
  shape.first_particle = first_particle;
  return shape;
}

namespace {

// Returns the number of corners of a vertex's tetrahedron that dynamic rigid bodies carry, 0 to 4, and 0 for
// a vertex inside of the bone that carries all of them. `bone` becomes the index of one of these bodies.
// `carriers` has the index of the body for each particle that one carries.
int corners_in_bones(const BodyShape& skin, std::size_t vertex,
                     const std::map<std::size_t, std::size_t>& carriers, const Bodies& bodies,
                     std::size_t& bone) {
  int corners = 0;
  bool is_one_bone = true;
  for (const int node : skin.skin.carriers()[vertex].nodes) {
    const auto found = carriers.find(skin.first_particle + as_index(node));
    if (found == carriers.end()) continue;
    is_one_bone = is_one_bone && (corners == 0 || bone == found->second);
    bone = found->second;
    ++corners;
  }
  if (corners < 4 || !is_one_bone) return corners;
  const Vec3 x = skin.skin.position(vertex, bodies.particles.x.data() + skin.first_particle);
  return bodies.rigid.properties[bone].shape.distance(shape_pose(bodies.rigid, bone).to_body(x)) < 0 ? 0 : 4;
}

}  // namespace

void check_skin_contact(const Scene& scene, const scene::DeformableBody& description, const BodyShape& skin,
                        const Bodies& bodies) {
  std::map<std::size_t, std::size_t> carriers;  // particle -> index of the rigid body that carries it
  for (const EmbeddedParticle& bound : bodies.bound) carriers[bound.particle] = bound.body;
  const std::size_t count = skin.skin.carriers().size();
  std::size_t stuck = 0, bone = 0;
  std::string name;
  Vec3 place = Vec3::Zero();
  for (std::size_t i = 0; i < count; ++i) {
    if (corners_in_bones(skin, i, carriers, bodies, bone) == 0) continue;
    if (stuck++ > 0) continue;
    name = bodies.rigid.name[bone];
    place = skin.skin.position(i, bodies.particles.x.data() + skin.first_particle);
  }
  if (stuck == 0) return;
  SceneProblem problem;
  problem.file = scene.path;
  problem.line = description.at.line;
  problem.column = description.at.column;
  problem.key = fmt::format("deformable.{}.skin.contact", description.name);
  problem.message = fmt::format(
      "{} of {} vertices are in tetrahedra with a corner inside of a body of `attach`, the first in `{}` at "
      "({:.4g}, {:.4g}, {:.4g}): contact pushes particles, and cannot push a vertex that moves partly with a "
      "rigid body",
      stuck, count, name, place.x(), place.y(), place.z());
  problem.hint =
      "make the tetrahedra smaller, with shape.spacing or more cells, or the bones thinner, so that whole "
      "tetrahedra lie between bones and skin; or hold the flesh with `attach_springs`; or leave `contact` "
      "out, so that the boundary of the tetrahedra touches";
  throw SceneError({std::move(problem)});
}

SkinSize measure_skin(const BodyShape& skin, const TetMesh& mesh, const std::vector<Triangle>& boundary) {
  constexpr double rounding = 1e-9;  // error of a weight, absolute; the weights of a vertex add up to 1
  const TriangleTree tree(TriangleMesh{mesh.nodes, boundary, {}, {}});
  const Surface& surface = skin.surface.surface;
  SkinSize size{skin.name, 1, static_cast<int>(surface.triangles.size())};
  Eigen::AlignedBox3d box;
  for (std::size_t i = 0; i < surface.positions.size(); ++i) {
    box.extend(surface.positions[i]);
    const std::array<double, 4>& weights = skin.skin.carriers()[i].weights;
    // A vertex outside of all tetrahedra has a negative weight.
    const bool is_outside = *std::min_element(weights.begin(), weights.end()) < -rounding;
    double& farthest = is_outside ? size.outside : size.inside;
    farthest = std::max(farthest, tree.nearest(surface.positions[i]).distance);
  }
  size.extent = box.sizes().maxCoeff();
  return size;
}

void add_skin_size(const SkinSize& size, std::vector<SkinSize>& sizes) {
  const auto alike = std::find_if(sizes.begin(), sizes.end(), [&](const SkinSize& other) {
    return other.triangles == size.triangles && other.outside == size.outside && other.inside == size.inside;
  });
  if (alike == sizes.end())
    sizes.push_back(size);
  else
    ++alike->bodies;
}

// Mass is distributed over triangles by area, a third of it to each corner, and from a corner to its nodes by
// the barycentric weights.
void add_skin_mass(const scene::DeformableBody& description, const BodyShape& skin,
                   std::vector<double>& masses) {
  const Surface& surface = skin.surface.surface;
  std::vector<double> area(surface.positions.size(), 0);
  double total = 0;
  for (const std::array<Corner, 3>& triangle : surface.triangles) {
    std::array<Vec3, 3> x;
    for (std::size_t k = 0; k < 3; ++k)
      x[k] = surface.positions[static_cast<std::size_t>(triangle[k].position)];
    const double its_area = (x[1] - x[0]).cross(x[2] - x[0]).norm() / 2;
    for (const Corner& corner : triangle) area[static_cast<std::size_t>(corner.position)] += its_area / 3;
    total += its_area;
  }
  for (std::size_t i = 0; i < area.size(); ++i) {
    const CarriedSurface::Carrier& carrier = skin.skin.carriers()[i];
    for (std::size_t k = 0; k < 4; ++k)
      masses[static_cast<std::size_t>(carrier.nodes[k])] +=
          *description.skin->mass * area[i] / total * carrier.weights[k];
  }
  if (*std::min_element(masses.begin(), masses.end()) <= 0)
    throw Error(
        ExitStatus::usage,
        fmt::format("deformable.{}.skin.mass: {:.4g} kg on a skin that reaches {:.2g} of a tetrahedron "
                    "out of them would need negative masses; lower it, or shape.spacing",
                    description.name, *description.skin->mass, skin.skin.farthest_outside()));
}

}  // namespace duet::scene
