#include "tools/study/measures.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/study/closed_forms.h"
#include "tools/study/free_top.h"
#include <fmt/format.h>

#include "render/compare.h"
#include "sim/articulation/joint_solver.h"
#include "sim/step/world.h"

namespace duet::study {
namespace {

[[noreturn]] void unfit(const Measure& measure, const std::string& what) {
  throw Error(ExitStatus::usage, fmt::format("measure \"{}\": {}", measure.name, what));
}

// Returns the place of the measured body among the centers of mass.
std::size_t center_index(const Measure& measure, const World& world) {
  if (const int i = rigid_index(world, measure.body); i >= 0) return static_cast<std::size_t>(i);
  const int i = deformable_index(world, measure.body);
  if (i < 0) unfit(measure, fmt::format("the scene has no body `{}`", measure.body));
  return world.bodies.rigid.size() + static_cast<std::size_t>(i);
}

// Returns the displacement (m) of the body's center of mass from frame 0 to the end.
Vec3 displacement(const Measure& measure, const RunResult& result) {
  const World& world = result.simulation->world();
  const std::size_t i = center_index(measure, world);
  return centers_of_mass(world)[i] - result.start[i];
}

// Returns the measured body, which must be a deformable box.
const scene::DeformableBody& soft_box(const Measure& measure, const scene::Scene& scene) {
  for (const scene::DeformableBody& body : scene.deformable)
    if (body.name == measure.body && body.shape.kind == scene::DeformableKind::box) return body;
  unfit(measure, fmt::format("`{}` is no deformable box", measure.body));
}

const scene::Material& material_of(const scene::Scene& scene, const scene::DeformableBody& body) {
  return *std::find_if(scene.materials.begin(), scene.materials.end(),
                       [&](const scene::Material& material) { return material.name == body.material; });
}

// Returns the relative error of the distance down the slope.
double slide_error(const Measure& measure, const RunResult& result) {
  const double angle = measure.slope * EIGEN_PI / 180;
  const Vec3 downhill(-std::cos(angle), -std::sin(angle), 0);
  double speed = 0;
  for (const auto& body : result.scene.rigid)
    if (body.name == measure.body) speed = body.placement.velocity.dot(downhill);
  for (const auto& body : result.scene.deformable)
    if (body.name == measure.body) speed = body.placement.velocity.dot(downhill);
  const double way =
      slide_distance(measure.slope, measure.friction, result.scene.gravity.norm(), speed, result.seconds());
  return std::abs(displacement(measure, result).dot(downhill) / way - 1);
}

// Returns the angle (rad) between the orientation and the exact one.
double top_error(const Measure& measure, const RunResult& result) {
  const World& world = result.simulation->world();
  const int i = rigid_index(world, measure.body);
  if (i < 0) unfit(measure, fmt::format("the scene has no rigid body `{}`", measure.body));
  const auto index = static_cast<std::size_t>(i);
  const Vec3& inertia = world.bodies.rigid.properties[index].inertia;
  const Vec3& spin = result.scene.rigid[index].placement.angular_velocity;
  const bool fits =
      inertia[0] < inertia[1] && inertia[1] < inertia[2] && spin.x() == 0 && spin.y() > 0 && spin.z() > 0;
  if (!fits)
    unfit(measure, "the closed form is of a body with edges that shrink from x to z, spun about y and z");
  const Quat exact = FreeTop(inertia, spin.y(), spin.z()).orientation(result.seconds());
  return world.bodies.rigid.state[index].pose.orientation.angularDistance(exact);
}

// Returns the error of the angle about the axis of the first joint (rad).
double pendulum_error(const Measure& measure, const RunResult& result) {
  const World& world = result.simulation->world();
  const int i = rigid_index(world, measure.body);
  if (i < 0 || result.scene.joints.empty() || !result.scene.joints[0].world.position)
    unfit(measure,
          "the closed form is of a rigid body that hangs on the scene's first joint, with a `position`");
  const auto index = static_cast<std::size_t>(i);
  const scene::JointAxes& joint = result.scene.joints[0].world;
  const Vec3 axis = joint.axis.normalized(), down = result.scene.gravity.normalized();
  const RigidProperties& properties = world.bodies.rigid.properties[index];
  const Pose& pose = world.bodies.rigid.state[index].pose;
  const auto angle = [&](const Vec3& center) {
    const Vec3 arm = center - *joint.position;
    return std::atan2(axis.dot(down.cross(arm)), down.dot(arm));
  };
  const double length = (result.start[index] - *joint.position).norm();
  const Vec3 body_axis = pose.orientation.conjugate() * axis;
  const double inertia =
      body_axis.dot(properties.inertia.cwiseProduct(body_axis)) + properties.mass * length * length;
  const double rate = std::sqrt(properties.mass * result.scene.gravity.norm() * length / inertia);
  const double start = angle(result.start[index]);
  const double exact = std::copysign(1.0, start) * pendulum_angle(std::abs(start), rate, result.seconds());
  return std::abs(angle(pose.position) - exact);
}

// Returns the relative error of the sag.
double cantilever_error(const Measure& measure, const RunResult& result) {
  const scene::DeformableBody& beam = soft_box(measure, result.scene);
  const scene::Material& material = material_of(result.scene, beam);
  const double exact =
      mean_sag_of_cantilever(material.density * result.scene.gravity.norm(), beam.shape.size.x(),
                             beam.shape.size.y(), material.youngs_modulus);
  return std::abs(displacement(measure, result).dot(result.scene.gravity.normalized()) / exact - 1);
}

// Returns the error of the mean displacement over the sag at rest.
double bar_error(const Measure& measure, const RunResult& result) {
  const scene::DeformableBody& bar = soft_box(measure, result.scene);
  const scene::Material& material = material_of(result.scene, bar);
  const double speed = std::sqrt(material.youngs_modulus / material.density),
               gravity = result.scene.gravity.norm();
  const double length = bar.shape.size.x();
  const double exact = mean_stretch_of_bar(length, speed, gravity, result.seconds());
  // The error is relative to the sag at rest, about which the mean displacement swings, because the exact
  // displacement passes through zero.
  const double sag = gravity * length * length / (3 * speed * speed);
  return std::abs(displacement(measure, result).dot(result.scene.gravity.normalized()) - exact) / sag;
}

// Returns the mean square distance (m^2) of the six points at which a body's axes leave its box.
double rigid_square(const RigidBodies& a, const RigidBodies& b, std::size_t i) {
  const Vec3 half = (a.properties[i].shape.upper() - a.properties[i].shape.lower()) / 2;
  const Pose one = shape_pose(a, i), other = shape_pose(b, i);
  const Mat3 turn = one.orientation.toRotationMatrix() - other.orientation.toRotationMatrix();
  const double moved = (one.position - other.position).squaredNorm();
  // A rotation of a ball cannot be seen.
  if (a.properties[i].is_ball()) return moved;
  return moved + (turn * half.asDiagonal()).squaredNorm() / 3;
}

// Returns the mean square distance (m^2) of a body's particles, by mass.
double deformable_square(const World& a, const World& b, const DeformableBody& body) {
  double sum = 0, mass = 0;
  for (int i = 0; i < body.particle_count; ++i) {
    const auto p = static_cast<std::size_t>(body.first_particle) + static_cast<std::size_t>(i);
    sum += a.bodies.particles.mass[p] * (a.bodies.particles.x[p] - b.bodies.particles.x[p]).squaredNorm();
    mass += a.bodies.particles.mass[p];
  }
  return mass > 0 ? sum / mass : 0;
}

// Returns the root mean square distance (m) of the centers of mass of all bodies that move, or the distance
// of the measured body's.
double centers_difference(const Measure& measure, const World& a, const World& b) {
  const std::vector<Vec3> x = centers_of_mass(a), y = centers_of_mass(b);
  if (!measure.body.empty()) {
    const std::size_t i = center_index(measure, a);
    return (x[i] - y[i]).norm();
  }
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (i < a.bodies.rigid.size() && !a.bodies.rigid.properties[i].is_dynamic()) continue;
    sum += (x[i] - y[i]).squaredNorm();
    ++count;
  }
  return std::sqrt(sum / std::max(count, 1));
}

// Returns the largest value over the frames, at least 0.
template <class Value>
double largest(const RunResult& result, Value&& value) {
  double most = 0;
  for (const nlohmann::json& frame : result.frames) most = std::max(most, value(frame));
  return most;
}

double number(const nlohmann::json& frame, const char* key) { return frame.at(key).get<double>(); }
double energy(const nlohmann::json& frame) {
  return number(frame, "kinetic") + number(frame, "potential") + number(frame, "elastic");
}
double max_kinetic(const RunResult& result) {
  return largest(result, [](const auto& frame) { return number(frame, "kinetic"); });
}
Vec3 vector(const nlohmann::json& frame, const char* key) {
  const nlohmann::json& v = frame.at(key);
  return {v.at(0).get<double>(), v.at(1).get<double>(), v.at(2).get<double>()};
}

// Returns the largest rise of the energy (J) above that of an earlier frame.
double energy_gain(const RunResult& result) {
  double least = energy(result.frames.front()), gain = 0;
  for (const nlohmann::json& frame : result.frames) {
    gain = std::max(gain, energy(frame) - least);
    least = std::min(least, energy(frame));
  }
  return gain;
}

// Returns the largest change of a vector since frame 0.
double momentum_change(const RunResult& result, const char* key) {
  const Vec3 start = vector(result.frames.front(), key);
  return largest(result, [&](const auto& frame) { return (vector(frame, key) - start).norm(); });
}

}  // namespace

double state_difference(const World& a, const World& b, const std::string& body) {
  const RigidBodies &rigid_a = a.bodies.rigid, &rigid_b = b.bodies.rigid;
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < rigid_a.size(); ++i) {
    if (body.empty() ? !rigid_a.properties[i].is_dynamic() : rigid_a.name[i] != body) continue;
    sum += rigid_square(rigid_a, rigid_b, i);
    ++count;
  }
  for (const DeformableBody& soft : a.bodies.deformable) {
    if (!body.empty() && soft.name != body) continue;
    sum += deformable_square(a, b, soft);
    ++count;
  }
  return std::sqrt(sum / std::max(count, 1));
}

double evaluate(const Measure& measure, const RunResult& result, const RunResult* reference) {
  const World& world = result.simulation->world();
  switch (measure.kind) {
    case MeasureKind::slide:
      return slide_error(measure, result);
    case MeasureKind::free_top:
      return top_error(measure, result);
    case MeasureKind::pendulum:
      return pendulum_error(measure, result);
    case MeasureKind::cantilever:
      return cantilever_error(measure, result);
    case MeasureKind::vibrating_bar:
      return bar_error(measure, result);
    case MeasureKind::state: {
      const World& exact = reference->simulation->world();
      if (exact.bodies.particles.size() != world.bodies.particles.size() ||
          exact.bodies.rigid.size() != world.bodies.rigid.size())
        return std::numeric_limits<double>::quiet_NaN();
      if (!measure.body.empty()) center_index(measure, world);
      return state_difference(world, exact, measure.body);
    }
    case MeasureKind::centers:
      return centers_difference(measure, world, reference->simulation->world());
    case MeasureKind::penetration:
      return largest(result, [](const auto& frame) { return number(frame, "max_penetration"); });
    case MeasureKind::energy: {
      const double start = energy(result.frames.front());
      return largest(result, [&](const auto& frame) { return std::abs(energy(frame) - start); }) /
             max_kinetic(result);
    }
    case MeasureKind::energy_gain:
      return energy_gain(result) / max_kinetic(result);
    case MeasureKind::momentum:
      return momentum_change(result, "momentum") / std::sqrt(2 * dynamic_mass(world) * max_kinetic(result));
    case MeasureKind::angular_momentum:
      return momentum_change(result, "angular_momentum") /
             vector(result.frames.front(), "angular_momentum").norm();
    case MeasureKind::joints:
      return JointSolver::drift(world.bodies.articulation, world.bodies.rigid).gap;
    case MeasureKind::volume:
      return largest(result, [](const auto& frame) { return number(frame, "volume_error"); });
    case MeasureKind::image:
      return render::compare(render::read_picture(result.picture), render::read_picture(reference->picture))
          .rmse;
  }
  return 0;
}

}  // namespace duet::study
