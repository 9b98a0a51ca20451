#include "frame.h"

#include "bindings.h"
#include <pybind11/stl.h>

#include "sim/base/index.h"
#include "sim/step/world.h"

namespace duet::python {
namespace {

std::vector<BodySurface> surfaces_of(const Simulation& simulation) {
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  return surfaces;
}

void add_surface(const Surface& surface, Topology& topology, Topology::Body& body, std::size_t points) {
  body.points = {points, surface.positions.size()};
  body.triangles = {topology.triangles.size(), surface.triangles.size()};
  for (const auto& corners : surface.triangles) {
    std::array<std::int32_t, 3> own{}, global{};
    for (std::size_t k = 0; k < 3; ++k) {
      own[k] = corners[k].position;
      global[k] = own[k] + static_cast<std::int32_t>(points);
    }
    topology.own_triangles.push_back(own);
    topology.triangles.push_back(global);
  }
}

void add_particles(const DeformableBody& part, const Bodies& bodies, Topology& topology,
                   Topology::Body& body) {
  body.particles = {as_index(part.first_particle), as_index(part.particle_count)};
  body.tetrahedra = {as_index(part.first_tet), as_index(part.tet_count)};
  for (std::size_t t = body.tetrahedra.begin; t < body.tetrahedra.begin + body.tetrahedra.count; ++t) {
    Tet own = bodies.tets[t];
    for (int& node : own) node -= part.first_particle;
    topology.tetrahedra.push_back(bodies.tets[t]);
    topology.own_tetrahedra.push_back(own);
  }
}

void capture_rigid(const Simulation& simulation, FrameData& frame) {
  std::vector<RigidMotion> motions;
  simulation.rigid_motion(motions);
  for (const RigidMotion& motion : motions) {
    const Quat& q = motion.pose.orientation;
    const Mat3 rotation = q.toRotationMatrix();
    const Vec3& x = motion.pose.position;
    std::array<double, 16> transform{};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column)
        transform[as_index(4 * row + column)] = rotation(row, column);
      transform[as_index(4 * row + 3)] = x[row];
    }
    transform[15] = 1;
    frame.transforms.push_back(transform);
    frame.orientations.push_back({q.w(), q.x(), q.y(), q.z()});
    frame.positions.push_back(x);
    frame.rigid_velocities.push_back(motion.velocity);
    frame.angular_velocities.push_back(motion.angular_velocity);
  }
}

// Returns the number of components of a quantity.
std::size_t components(const io::PointValue& kind) { return kind.scalars ? 1 : 3; }

// Captures the quantities of io::point_values. `values` have them for the points of deformable bodies, which
// follow those of rigid bodies.
void capture_point_values(const io::FrameValues& values, FrameData& frame) {
  const std::size_t rigid = frame.points.size() - values.points.size();
  for (std::size_t k = 0; k < frame.point_values.size(); ++k) {
    const io::PointValue& kind = io::point_values[k];
    std::vector<float>& to = frame.point_values[k];
    to.assign(components(kind) * rigid, 0);
    if (kind.scalars) {
      to.insert(to.end(), kind.scalars(values).begin(), kind.scalars(values).end());
    } else {
      for (const Vec3f& v : kind.vectors(values)) to.insert(to.end(), v.data(), v.data() + 3);
    }
  }
  frame.contact_forces = values.contact.rigid_force;
  frame.contact_torques = values.contact.rigid_torque;
}

// Captures positions, velocities and other values of the surfaces. Points of rigid bodies move by v + w x
// arm.
void capture_surfaces(const Simulation& simulation, FrameData& frame) {
  frame.surfaces = surfaces_of(simulation);
  io::FrameValues values;
  io::measure_values(simulation, frame.surfaces, values);
  const std::vector<Vec3f>& soft = values.velocities;
  std::size_t next = 0;
  for (std::size_t i = 0; i < frame.surfaces.size(); ++i) {
    const Surface& surface = frame.surfaces[i].surface;
    frame.points.insert(frame.points.end(), surface.positions.begin(), surface.positions.end());
    if (const int rigid = frame.topology->bodies[i].rigid; rigid >= 0) {
      const std::size_t r = as_index(rigid);
      for (const Vec3& x : surface.positions)
        frame.velocities.push_back(frame.rigid_velocities[r] +
                                   frame.angular_velocities[r].cross(x - frame.positions[r]));
    } else {
      for (std::size_t k = 0; k < surface.positions.size(); ++k)
        frame.velocities.push_back(soft[next++].cast<double>());
    }
  }
  capture_point_values(values, frame);
}

void capture_contacts(const World& world, FrameData& frame) {
  const auto rigid = static_cast<std::int32_t>(frame.topology->rigid);
  if (frame.stats.frame == 0) return;
  const auto row_of = [&](int index) { return index < rigid ? index : -1; };
  const ContactSet& contacts = world.context.contact.contacts;
  for (const ContactPair& pair : contacts.pairs)
    for (int number = pair.begin; number < pair.end; ++number) {
      const ContactPoint& point = contacts.points[as_index(number)];
      if (point.impulse.isZero(0)) continue;
      // Arms are in world axes at the positions of the end of the step.
      const Vec3& center = world.bodies.rigid.state[as_index(point.host)].pose.position;
      frame.contacts.position.push_back(center + point.host_arm);
      frame.contacts.normal.push_back(point.normal);
      frame.contacts.impulse.push_back(point.impulse);
      frame.contacts.bodies.push_back(
          {point.is_rigid_pair() ? row_of(point.guest_rigid) : rigid + pair.guest_deformable,
           row_of(point.host)});
    }
}

template <class Element, class Number>
py::array rows(const std::vector<Element>& values, Rows range, py::handle owner) {
  constexpr auto columns = static_cast<py::ssize_t>(sizeof(Element) / sizeof(Number));
  const auto* data = values.empty() ? nullptr : reinterpret_cast<const Number*>(values.data() + range.begin);
  const auto count = static_cast<py::ssize_t>(range.count);
  if (columns == 1) return view(data, {count}, owner);
  return view(data, {count, columns}, owner);
}

template <class Number, class Element>
py::array all(const std::vector<Element>& values, py::handle owner) {
  return rows<Element, Number>(values, {0, values.size()}, owner);
}

// One body at one frame.
struct BodyFrame {
  std::shared_ptr<FrameData> frame;
  std::size_t number;
  const Topology::Body& body() const { return frame->topology->bodies[number]; }
};

// Returns a getter of the rows of one body in an array of the frame.
template <class Number, class Element>
auto part(std::vector<Element> FrameData::*values, Rows Topology::Body::*range) {
  return [=](const BodyFrame& b) {
    return rows<Element, Number>((*b.frame).*values, b.body().*range, py::cast(b.frame));
  };
}

// Returns a getter of the rows of one body in an array that all frames share.
template <class Element>
auto shared_part(std::vector<Element> Topology::*values, Rows Topology::Body::*range) {
  return [=](const BodyFrame& b) {
    return rows<Element, std::int32_t>((*b.frame->topology).*values, b.body().*range, py::cast(b.frame));
  };
}

// Returns a getter of the row of one body in an array of rigid bodies, which raises AttributeError for
// deformable ones.
template <class Element>
auto pose(std::vector<Element> FrameData::*values, std::vector<py::ssize_t> shape) {
  return [=](const BodyFrame& b) {
    if (b.body().rigid < 0)
      throw py::attribute_error("`" + b.body().name + "` is deformable: it has no pose and twist of its own");
    const Element& row = ((*b.frame).*values)[as_index(b.body().rigid)];
    return view(reinterpret_cast<const double*>(&row), shape, py::cast(b.frame));
  };
}

// Returns the rows of the points in `range` of the quantity with this index in io::point_values.
py::array point_values(const std::shared_ptr<FrameData>& frame, std::size_t k, Rows range) {
  const auto columns = static_cast<py::ssize_t>(components(io::point_values[k]));
  const std::vector<float>& values = frame->point_values[k];
  const float* data = values.data() + range.begin * static_cast<std::size_t>(columns);
  const auto count = static_cast<py::ssize_t>(range.count);
  if (columns == 1) return view(data, {count}, py::cast(frame));
  return view(data, {count, columns}, py::cast(frame));
}

py::dict energies_of(const FrameStats& stats) {
  return py::dict(py::arg("kinetic") = stats.kinetic, py::arg("potential") = stats.potential,
                  py::arg("elastic") = stats.elastic,
                  py::arg("total") = stats.kinetic + stats.potential + stats.elastic);
}

// Returns the statistics that are single values, with the names of stats.jsonl.
py::dict statistics_of(const FrameStats& s) {
  using py::arg;
  py::dict dict(
      arg("frame") = s.frame, arg("time") = s.time, arg("substeps") = s.substeps, arg("dt_min") = s.dt_min,
      arg("dt_max") = s.dt_max, arg("seconds") = s.seconds, arg("processor_seconds") = s.processor_seconds,
      arg("cg_iterations") = s.cg_iterations, arg("pressure_iterations") = s.pressure_iterations,
      arg("contacts") = s.contacts, arg("max_penetration") = s.max_penetration,
      arg("volume_error") = s.volume_error, arg("min_det_F") = s.min_det_F, arg("inverted") = s.inverted,
      arg("max_stretch") = s.max_stretch, arg("self_repulsions") = s.self_repulsions,
      arg("self_collisions") = s.self_collisions, arg("kinetic") = s.kinetic, arg("potential") = s.potential,
      arg("elastic") = s.elastic, arg("momentum") = array_of(s.momentum),
      arg("angular_momentum") = array_of(s.angular_momentum), arg("hash") = s.hash);
  if (s.drawn_overlap) dict["drawn_penetration"] = s.drawn_overlap->depth;
  py::dict stages;
  for (const StageStats& stage : s.stages)
    stages[py::str(stage.name)] = py::dict(arg("seconds") = stage.seconds, arg("calls") = stage.calls);
  dict["stages"] = stages;
  return dict;
}

using Shared = std::shared_ptr<FrameData>;

void bind_body(py::module_& module) {
  using Body = Topology::Body;
  py::class_<BodyFrame> body(
      module, "BodyFrame",
      "One body at one frame. All arrays are read-only views without a copy, in world axes.");
  body.def_property_readonly(
          "name", [](const BodyFrame& b) { return b.body().name; }, "Name in the scene.")
      .def_property_readonly(
          "kind", [](const BodyFrame& b) { return b.body().kind; },
          "'rigid', 'kinematic', 'static' or 'deformable'.")
      .def_property_readonly("points", part<double>(&FrameData::points, &Body::points),
                             "(n, 3), m: points of the drawn surface.")
      .def_property_readonly("velocities", part<double>(&FrameData::velocities, &Body::points),
                             "(n, 3), m/s: velocities of the points.")
      .def_property_readonly("triangles", shared_part(&Topology::own_triangles, &Body::triangles),
                             "(m, 3): rows of `points`, counter-clockwise seen from outside.")
      .def_property_readonly("particles", part<double>(&FrameData::particles, &Body::particles),
                             "(p, 3), m: particles; none of a rigid body.")
      .def_property_readonly("particle_velocities",
                             part<double>(&FrameData::particle_velocities, &Body::particles), "(p, 3), m/s.")
      .def_property_readonly("tetrahedra", shared_part(&Topology::own_tetrahedra, &Body::tetrahedra),
                             "(t, 4): rows of `particles`.")
      .def_property_readonly("transform", pose(&FrameData::transforms, {4, 4}),
                             "(4, 4): from body space (center of mass, principal axes) to the world.")
      .def_property_readonly("position", pose(&FrameData::positions, {3}), "(3,), m: center of mass.")
      .def_property_readonly("orientation", pose(&FrameData::orientations, {4}),
                             "(4,): unit quaternion w, x, y, z.")
      .def_property_readonly("velocity", pose(&FrameData::rigid_velocities, {3}),
                             "(3,), m/s: of the center of mass.")
      .def_property_readonly("angular_velocity", pose(&FrameData::angular_velocities, {3}), "(3,), rad/s.")
      .def_property_readonly("net_contact_force", pose(&FrameData::contact_forces, {3}),
                             "(3,), N: force of contact, mean over the frame.")
      .def_property_readonly("net_contact_torque", pose(&FrameData::contact_torques, {3}),
                             "(3,), N m: torque of contact about the center of mass, mean over the frame.");
  for (std::size_t k = 0; k < std::size(io::point_values); ++k)
    body.def_property_readonly(
        io::point_values[k].name,
        [k](const BodyFrame& b) { return point_values(b.frame, k, b.body().points); },
        io::point_values[k].meaning);
}

}  // namespace

std::shared_ptr<const Topology> topology_of(const Simulation& simulation, const scene::Scene& scene,
                                            const Topology* before) {
  auto topology = std::make_shared<Topology>();
  const Bodies& bodies = simulation.world().bodies;
  topology->rigid = scene.rigid.size();
  std::size_t points = 0, number = 0;
  const std::vector<BodySurface> surfaces = surfaces_of(simulation);
  topology->listed = before ? before->listed : io::manifest_bodies(scene, surfaces);
  for (const BodySurface& surface : surfaces) {
    Topology::Body body;
    body.name = surface.name;
    if (number < topology->rigid) {
      body.rigid = static_cast<int>(number);
      const RigidProperties& properties = bodies.rigid.properties[number];
      body.kind = properties.is_dynamic() ? "rigid" : properties.is_kinematic ? "kinematic" : "static";
    } else {
      body.kind = "deformable";
      add_particles(bodies.deformable[number - topology->rigid], bodies, *topology, body);
    }
    add_surface(surface.surface, *topology, body, points);
    points += body.points.count;
    topology->bodies.push_back(std::move(body));
    ++number;
  }
  return topology;
}

std::shared_ptr<FrameData> capture(const Simulation& simulation, std::shared_ptr<const Topology> topology) {
  auto frame = std::make_shared<FrameData>();
  frame->topology = std::move(topology);
  frame->stats = simulation.stats();
  const World& world = simulation.world();
  capture_rigid(simulation, *frame);
  capture_surfaces(simulation, *frame);
  frame->particles = world.bodies.particles.x;
  frame->particle_velocities = world.bodies.particles.v;
  capture_contacts(world, *frame);
  return frame;
}

void bind_frame(py::module_& module) {
  bind_body(module);
  const auto column = [](auto member) {
    return [member](const Shared& f) { return all<double>((*f).*member, py::cast(f)); };
  };
  py::class_<FrameData, Shared> frame(module, "FrameData");
  for (std::size_t k = 0; k < std::size(io::point_values); ++k)
    frame.def_property_readonly(io::point_values[k].name, [k](const Shared& f) {
      return point_values(f, k, {0, f->points.size()});
    });
  frame.def_property_readonly("number", [](const Shared& f) { return f->stats.frame; })
      .def_property_readonly("time", [](const Shared& f) { return f->stats.time; })
      .def_property_readonly("hash", [](const Shared& f) { return f->stats.hash; })
      .def_property_readonly("energies", [](const Shared& f) { return energies_of(f->stats); })
      .def_property_readonly("statistics", [](const Shared& f) { return statistics_of(f->stats); })
      .def_property_readonly("names",
                             [](const Shared& f) {
                               std::vector<std::string> names;
                               for (const auto& body : f->topology->bodies) names.push_back(body.name);
                               return names;
                             })
      .def("body",
           [](const Shared& f, std::size_t number) {
             return BodyFrame{f, number};
           })
      .def_property_readonly("points", column(&FrameData::points))
      .def_property_readonly("velocities", column(&FrameData::velocities))
      .def_property_readonly(
          "triangles", [](const Shared& f) { return all<std::int32_t>(f->topology->triangles, py::cast(f)); })
      .def_property_readonly(
          "tetrahedra",
          [](const Shared& f) { return all<std::int32_t>(f->topology->tetrahedra, py::cast(f)); })
      .def_property_readonly("particles", column(&FrameData::particles))
      .def_property_readonly("particle_velocities", column(&FrameData::particle_velocities))
      .def_property_readonly("positions", column(&FrameData::positions))
      .def_property_readonly("orientations", column(&FrameData::orientations))
      .def_property_readonly("linear_velocities", column(&FrameData::rigid_velocities))
      .def_property_readonly("angular_velocities", column(&FrameData::angular_velocities))
      .def_property_readonly("contact_forces", column(&FrameData::contact_forces))
      .def_property_readonly("contact_torques", column(&FrameData::contact_torques))
      .def_property_readonly("transforms",
                             [](const Shared& f) {
                               return view(reinterpret_cast<const double*>(f->transforms.data()),
                                           {static_cast<py::ssize_t>(f->transforms.size()), 4, 4},
                                           py::cast(f));
                             })
      .def_property_readonly("contact_positions",
                             [](const Shared& f) { return all<double>(f->contacts.position, py::cast(f)); })
      .def_property_readonly("contact_normals",
                             [](const Shared& f) { return all<double>(f->contacts.normal, py::cast(f)); })
      .def_property_readonly("contact_impulses",
                             [](const Shared& f) { return all<double>(f->contacts.impulse, py::cast(f)); })
      .def_property_readonly("contact_bodies", [](const Shared& f) {
        return all<std::int32_t>(f->contacts.bodies, py::cast(f));
      });
}

}  // namespace duet::python
