#include "sim/scene/build/add_deformable.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <set>

#include "sim/deformable/forces/shell_bending.h"
#include "sim/deformable/self_contact/thin_bodies.h"
#include "sim/scene/build/attachments.h"
#include "sim/scene/deformables.h"

namespace duet::scene {
namespace {

// Depth at which face samples begin to act, as a fraction of their spacing, so that flat contact rests on
// vertices alone. A larger value lets sharp features sink deeper into faces.
constexpr double sample_contact_offset = 1e-3;

// Returns a shell, rod or particle whose particles, elements and contact points begin at the current ends of
// the lists.
duet::DeformableBody begin_body(const DeformableBody& description, std::size_t node_count,
                                const Bodies& bodies) {
  duet::DeformableBody body;
  body.name = description.name;
  body.first_particle = static_cast<int>(bodies.particles.size());
  body.particle_count = static_cast<int>(node_count);
  body.first_tet = static_cast<int>(bodies.forces.elements.size());
  body.first_triangle = static_cast<int>(bodies.triangles.size());
  body.first_segment = static_cast<int>(bodies.segments.size());
  body.first_point = static_cast<int>(bodies.points.size());
  body.thickness = description.shape.is_particle() ? 2 * description.shape.radius : *description.thickness;
  return body;
}

// Returns the masses (kg) of the nodes from their volumes (m^3): by the density of the material or, if the
// mass of the body is given, by the density that yields this mass.
std::vector<double> masses_of(const DeformableBody& description, const Material& material,
                              std::vector<double> volumes) {
  double total = 0;
  for (const double volume : volumes) total += volume;
  const double density = description.mass ? *description.mass / total : material.density;
  for (double& volume : volumes) volume *= density;
  return volumes;
}

// Adds a contact point with its effective inverse mass sum w_i^2 / m_i, unless one of its particles is bound
// to a dynamic rigid body, which touches with its own points. Points on particles that are held, or that a
// kinematic body carries, are obstacles to rigid bodies.
void add_point(SurfacePoint point, Bodies& bodies) {
  const Particles& particles = bodies.particles;
  for (std::size_t i = 0; i < as_index(point.count); ++i)
    if (particles.mass[as_index(point.particle[i])] == 0) return;
  for (std::size_t i = 0; i < as_index(point.count); ++i)
    point.inverse_mass +=
        point.weight[i] * point.weight[i] * particles.inverse_mass[as_index(point.particle[i])];
  bodies.points.push_back(point);
}

SurfacePoint vertex_point(int particle, double reach) {
  SurfacePoint point;
  point.particle[0] = particle;
  point.contact_offset = -reach;
  return point;
}

SurfacePoint sample_point(const BoundarySample& sample, int first_particle, double reach) {
  SurfacePoint point;
  point.count = sample.weight[2] > 0 ? 3 : 2;
  for (std::size_t i = 0; i < 3; ++i) {
    point.particle[i] = first_particle + sample.node[i];
    point.weight[i] = sample.weight[i];
  }
  point.contact_offset = sample_contact_offset * sample.spacing - reach;
  return point;
}

// Adds the contact points of a body: first the vertices `nodes`, then `samples`. `reach` (m) is the distance
// at which they touch.
void add_points(const std::vector<int>& nodes, const std::vector<BoundarySample>& samples, double reach,
                duet::DeformableBody& body, Bodies& bodies) {
  body.first_point = static_cast<int>(bodies.points.size());
  for (const int node : nodes) add_point(vertex_point(body.first_particle + node, reach), bodies);
  const int vertices_end = static_cast<int>(bodies.points.size());
  for (const BoundarySample& sample : samples)
    add_point(sample_point(sample, body.first_particle, reach), bodies);
  body.point_count = static_cast<int>(bodies.points.size()) - body.first_point;
  body.sample_count = body.first_point + body.point_count - vertices_end;
}

// Returns the edges of the triangles, each once.
std::set<std::pair<int, int>> edges_of(const std::vector<Triangle>& triangles) {
  std::set<std::pair<int, int>> edges;
  for (const Triangle& t : triangles)
    for (std::size_t i = 0; i < 3; ++i) edges.insert(std::minmax(t[i], t[(i + 1) % 3]));
  return edges;
}

// Adds the contact edges of a body, given by pairs of its nodes. Contact points divide each edge into `parts`
// parts; below 2, no edge is added. As in add_point(), edges with a particle that is bound to a dynamic body
// are left out.
void add_edges(const std::set<std::pair<int, int>>& edges, int parts, double reach,
               duet::DeformableBody& body, Bodies& bodies) {
  if (parts < 2) return;
  const Particles& particles = bodies.particles;
  body.first_edge = static_cast<int>(bodies.edges.size());
  for (const auto& [a, b] : edges) {
    const BoundaryEdge edge{{body.first_particle + a, body.first_particle + b}, -reach};
    const auto is_left_out = [&](int p) { return particles.mass[as_index(p)] == 0; };
    if (std::none_of(edge.particle.begin(), edge.particle.end(), is_left_out)) bodies.edges.push_back(edge);
  }
  body.edge_count = static_cast<int>(bodies.edges.size()) - body.first_edge;
  body.parts_per_edge = parts;
}

// Adds the forces of a shell that are in the plan: springs or membranes, and bending. The bending rigidity is
// E t^3 / (12 (1 - nu^2)) times the material's factor, N m.
void add_shell_forces(const std::vector<Triangle>& triangles, const std::vector<SheetEdge>& edges,
                      const Material& material, double thickness, const EffectSet& plan, Bodies& bodies) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const std::vector<double>& inverse_mass = bodies.particles.inverse_mass;
  if (material.has_springs && plan[index(Effect::springs)])
    for (const SheetEdge& edge : edges)
      bodies.forces.edge_springs.add(
          edge_spring(edge.a, edge.b, x, material.springs.stiffness, material.springs.damping, inverse_mass));
  if (!material.has_springs && plan[index(Effect::deformable_elasticity)])
    bodies.forces.membranes.add(
        triangles, x,
        membrane_moduli(material.youngs_modulus, material.poisson_ratio, thickness, material.damping));
  if (!plan[index(Effect::bending)]) return;
  const double nu = material.poisson_ratio, cubed = thickness * thickness * thickness;
  const double rigidity = material.bending_factor * material.youngs_modulus * cubed / (12 * (1 - nu * nu));
  if (material.has_bending_springs) {
    for (const SheetEdge& edge : edges)
      if (edge.other_opposite >= 0)
        bodies.forces.bending_springs.add(edge_spring(edge.opposite, edge.other_opposite, x,
                                                      material.bending_springs.stiffness,
                                                      material.bending_springs.damping, inverse_mass));
  } else if (rigidity > 0) {
    for (const ShellBending& element : shell_bending(triangles, edges, x, rigidity, nu, material.damping))
      bodies.forces.shell_bending.add(element);
  }
}

// Adds the forces of a rod that are in the plan: stretching and bending. node(i) is the particle of the i-th
// node; for a closed rod it may lie beyond the ends.
template <class Node>
void add_rod_forces(int segments, bool is_closed, Node&& node, const Material& material, double diameter,
                    const EffectSet& plan, Bodies& bodies) {
  const std::vector<Vec3>& x = bodies.particles.x;
  const std::vector<double>& inverse_mass = bodies.particles.inverse_mass;
  const double area = std::numbers::pi / 4 * diameter * diameter, axial = material.youngs_modulus * area;
  // Bending rigidity E I of a round rod, N m^2, with I = pi d^4 / 64 = A d^2 / 16.
  const double rigidity = material.bending_factor * axial * diameter * diameter / 16;
  if (plan[index(Effect::springs)])
    for (int i = 0; i < segments; ++i)
      bodies.forces.edge_springs.add(material.has_springs
                                         ? edge_spring(node(i), node(i + 1), x, material.springs.stiffness,
                                                       material.springs.damping, inverse_mass)
                                         : rod_element(node(i), node(i + 1), x, axial, material.damping));
  if (!plan[index(Effect::bending)]) return;
  for (int i = is_closed ? 0 : 1; i < segments; ++i) {
    if (material.has_bending_springs)
      bodies.forces.bending_springs.add(edge_spring(node(i - 1), node(i + 1), x,
                                                    material.bending_springs.stiffness,
                                                    material.bending_springs.damping, inverse_mass));
    else if (rigidity > 0)
      bodies.forces.rod_bending.add(
          rod_bending(node(i - 1), node(i), node(i + 1), x, rigidity, material.damping));
  }
}

Vec3 center_of_mass(const std::vector<Vec3>& nodes, const std::vector<double>& masses) {
  Vec3 sum = Vec3::Zero();
  double mass = 0;
  for (std::size_t i = 0; i < masses.size(); ++i) {
    sum += masses[i] * nodes[i];
    mass += masses[i];
  }
  return sum / mass;
}

}  // namespace

void add_particles(const DeformableBody& description, const EffectSet& plan, const std::vector<Vec3>& nodes,
                   const std::vector<double>& mass, Bodies& bodies) {
  Particles& particles = bodies.particles;
  const Placement& placement = description.placement;
  const Vec3 center = center_of_mass(nodes, mass);
  const bool is_hard = !description.attach_springs && plan[index(Effect::hard_bindings)];
  std::vector<int> held(description.attach.size() + 1,
                        0);  // numbers of particles by body of `attach`; last: by none
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto pin =
        std::find_if(description.pins.begin(), description.pins.end(),
                     [&](const Pin& candidate) { return distance(candidate, nodes[i]) <= candidate.radius; });
    const bool is_pinned = pin != description.pins.end();
    const Vec3 arm = placement.orientation * (nodes[i] - center);
    const Vec3 velocity = placement.velocity + placement.angular_velocity.cross(arm);
    particles.x.push_back(placement.position + placement.orientation * nodes[i]);
    particles.v.push_back(is_pinned ? Vec3(Vec3::Zero()) : velocity);
    particles.mass.push_back(mass[i]);
    particles.inverse_mass.push_back(is_pinned ? 0 : 1 / mass[i]);
    if (is_pinned && !pin->body.empty())
      prescribe_particle(pin->body, static_cast<int>(particles.size()) - 1, bodies);
    if (!is_pinned && is_hard) ++held[attach(description.attach, particles.size() - 1, bodies)];
  }
  if (is_hard) check_attached(description, held);
}

void add_volume_springs(const std::vector<Tet>& tets, const SpringLaw& law, Bodies& bodies) {
  std::set<std::pair<int, int>> edges;
  for (const Tet& tet : tets)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < i; ++j) edges.insert(std::minmax(tet[i], tet[j]));
  for (const auto& [a, b] : edges)
    bodies.forces.edge_springs.add(
        edge_spring(a, b, bodies.particles.x, law.stiffness, law.damping, bodies.particles.inverse_mass));
  bodies.forces.altitude_springs.add(tets, bodies.particles.x, law.stiffness, law.damping);
}

namespace {

// Largest number of face samples of a body that fitted_order() may ask for. A larger value costs time in
// contact with thin rigid bodies.
constexpr double max_samples = 20000;

// Returns the lattice order of a body's face samples, at least `order`. A rigid body that is thinner than the
// spacing of the samples could pass between them. So the order is raised until the spacing is half the
// thickness of the thinnest rigid body, as far as `max_samples` allows.
int fitted_order(int order, const TetMesh& mesh, const std::vector<Triangle>& triangles,
                 const RigidBodies& rigid) {
  double thinnest = std::numeric_limits<double>::infinity(), longest = 0;
  for (const RigidProperties& properties : rigid.properties)
    thinnest = std::min(thinnest, properties.shape.min_size());
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k)
      longest = std::max(longest, (mesh.nodes[as_index(t[k])] - mesh.nodes[as_index(t[(k + 1) % 3])]).norm());
  const double wanted = std::ceil(2 * longest / thinnest);
  // A lattice of order n has about n^2 / 2 samples per triangle.
  const double affordable = std::sqrt(2 * max_samples / static_cast<double>(triangles.size()));
  return std::max(order, static_cast<int>(std::min(wanted, affordable)));
}

}  // namespace

void add_surface_points(const TetMesh& mesh, const std::vector<Triangle>& triangles, int order, double reach,
                        duet::DeformableBody& body, Bodies& bodies) {
  std::set<int> nodes;
  for (const Triangle& t : triangles) nodes.insert(t.begin(), t.end());
  if (order > 1) order = fitted_order(order, mesh, triangles, bodies.rigid);
  add_points({nodes.begin(), nodes.end()},
             order > 1 ? boundary_samples(mesh, triangles, order) : std::vector<BoundarySample>(), reach,
             body, bodies);
  add_edges(edges_of(triangles), order, reach, body, bodies);
}

void add_surface_points(const CarriedSurface& skin, duet::DeformableBody& body, Bodies& bodies) {
  body.first_point = static_cast<int>(bodies.points.size());
  for (const CarriedSurface::Carrier& carrier : skin.carriers()) {
    SurfacePoint point;
    point.count = 4;
    point.weight = carrier.weights;
    for (std::size_t i = 0; i < 4; ++i) point.particle[i] = body.first_particle + carrier.nodes[i];
    add_point(point, bodies);
  }
  body.point_count = static_cast<int>(bodies.points.size()) - body.first_point;
}

BodyShape add_shell(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                    Bodies& bodies) {
  const Material& material = material_of(scene, description);
  const double thickness = *description.thickness;
  const Sheet sheet = rest_sheet(description.shape);
  std::vector<double> volumes(sheet.nodes.size(), 0);
  for (const Triangle& t : sheet.triangles) {
    const Vec3& a = sheet.nodes[as_index(t[0])];
    const Vec3 area = (sheet.nodes[as_index(t[1])] - a).cross(sheet.nodes[as_index(t[2])] - a) / 2;
    for (const int i : t) volumes[as_index(i)] += area.norm() * thickness / 3;
  }
  duet::DeformableBody body = begin_body(description, sheet.nodes.size(), bodies);
  add_particles(description, plan, sheet.nodes, masses_of(description, material, std::move(volumes)), bodies);

  std::vector<Triangle> triangles = sheet.triangles;
  for (Triangle& triangle : triangles)
    for (int& i : triangle) i += body.first_particle;
  std::vector<SheetEdge> sheet_edges = edges(sheet);
  for (SheetEdge& edge : sheet_edges)
    for (int* i : {&edge.a, &edge.b, &edge.opposite, &edge.other_opposite})
      if (*i >= 0) *i += body.first_particle;
  add_shell_forces(triangles, sheet_edges, material, thickness, plan, bodies);

  body.triangle_count = static_cast<int>(triangles.size());
  bodies.triangles.insert(bodies.triangles.end(), triangles.begin(), triangles.end());
  add_surface_points({sheet.nodes, {}}, sheet.triangles, scene.solver.face_samples, thickness / 2, body,
                     bodies);
  bodies.deformable.push_back(body);
  const ThickSheet thick(sheet, thickness);
  return {description.name,
          {thick.rest(), {}},
          ThinShape{thick, as_index(body.first_particle), sheet.nodes.size()}};
}

BodyShape add_rod(const Scene& scene, const EffectSet& plan, const DeformableBody& description,
                  Bodies& bodies) {
  const Material& material = material_of(scene, description);
  const double diameter = *description.thickness;
  const Curve curve = rest_curve(description.shape);
  const int count = static_cast<int>(curve.nodes.size()), segments = curve.is_closed ? count : count - 1;
  std::vector<double> volumes(curve.nodes.size(), 0);
  std::vector<BoundarySample> samples;
  std::set<std::pair<int, int>> edges;
  const int order = scene.solver.face_samples;
  for (int i = 0; i < segments; ++i) {
    const int next = (i + 1) % count;
    edges.insert(std::minmax(i, next));
    const double length = (curve.nodes[as_index(next)] - curve.nodes[as_index(i)]).norm();
    for (const int node : {i, next})
      volumes[as_index(node)] += length / 2 * std::numbers::pi / 4 * diameter * diameter;
    for (int k = 1; k < order; ++k) {
      const double w = static_cast<double>(k) / order;
      samples.push_back({{i, next, i}, {1 - w, w, 0}, length});
    }
  }
  duet::DeformableBody body = begin_body(description, curve.nodes.size(), bodies);
  add_particles(description, plan, curve.nodes, masses_of(description, material, std::move(volumes)), bodies);
  const auto node = [&](int i) { return body.first_particle + (i + count) % count; };
  add_rod_forces(segments, curve.is_closed, node, material, diameter, plan, bodies);

  for (int i = 0; i < segments; ++i) bodies.segments.push_back({node(i), node(i + 1)});
  body.segment_count = segments;
  std::vector<int> nodes(curve.nodes.size());
  std::iota(nodes.begin(), nodes.end(), 0);
  add_points(nodes, samples, diameter / 2, body, bodies);
  add_edges(edges, order, diameter / 2, body, bodies);
  bodies.deformable.push_back(body);
  const Tube tube(curve, diameter / 2);
  return {description.name,
          {tube.rest(), {}},
          ThinShape{tube, as_index(body.first_particle), curve.nodes.size()}};
}

BodyShape add_particle(const Scene& scene, const DeformableBody& description, Bodies& bodies) {
  const double radius = description.shape.radius;
  const double volume = 4.0 / 3 * std::numbers::pi * radius * radius * radius;
  duet::DeformableBody body = begin_body(description, 1, bodies);
  add_particles(description, EffectSet(), {Vec3::Zero()},
                masses_of(description, material_of(scene, description), {volume}), bodies);
  add_points({0}, {}, radius, body, bodies);
  bodies.deformable.push_back(body);
  const Bead bead(radius);
  return {description.name, {bead.rest(), {}}, ThinShape{bead, as_index(body.first_particle), 1}};
}

}  // namespace duet::scene
