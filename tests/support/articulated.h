// Small scenes with joints.
#pragma once

#include "tests/support/scenes.h"
#include <fmt/format.h>

#include "sim/base/rotation.h"

namespace duet::test {

// Adds a static box with an edge of 0.1 m, centered at `position` (m), to hang bodies from.
inline scene::RigidBody& add_peg(scene::Scene& scene, std::string_view name, const Vec3& position) {
  scene::RigidBody& peg = add_box(scene, name, position, Vec3::Constant(0.1), 1);
  peg.is_static = true;
  peg.mass.reset();
  return peg;
}

// Adds a joint called "PARENT-CHILD" at `position` (m, world frame), with the axis `axis` (world frame).
inline scene::Joint& add_joint(scene::Scene& scene, scene::JointType type, std::string_view parent,
                               std::string_view child, const Vec3& position,
                               const Vec3& axis = Vec3::UnitX()) {
  scene::Joint joint;
  joint.name = fmt::format("{}-{}", parent, child);
  joint.type = type;
  joint.parent = parent;
  joint.child = child;
  joint.world.position = position;
  joint.world.axis = axis;
  scene.joints.push_back(joint);
  return scene.joints.back();
}

// Adds a chain of links along x from the origin: each is 1 m long, 0.1 m thick and has 10 kg, and is jointed
// to the one before. With `hangs`, the first one is jointed to a static peg at the origin. `last` is the mass
// (kg) of the last link.
inline void add_chain(scene::Scene& scene, int links, scene::JointType type, bool hangs, double last = 10) {
  if (hangs) add_peg(scene, "peg", Vec3::Zero());
  for (int i = 0; i < links; ++i) {
    const std::string name = fmt::format("link{}", i);
    add_box(scene, name, Vec3(i + 0.5, 0, 0), Vec3(1, 0.1, 0.1), i + 1 == links ? last : 10);
    if (i > 0 || hangs)
      add_joint(scene, type, i > 0 ? fmt::format("link{}", i - 1) : "peg", name, Vec3(i, 0, 0),
                type == scene::JointType::point ? Vec3::UnitX() : Vec3::UnitZ());
  }
}

// Adds a closed ring of links in the plane z = 0 about `center` (m). Each lies along one edge of a regular
// polygon with edges of 1 m. The axes of all joints are z.
inline void add_loop(scene::Scene& scene, int links, scene::JointType type, const Vec3& center) {
  const double angle = 2 * EIGEN_PI / links, radius = 0.5 / std::sin(angle / 2);
  const auto corner = [&](int i) {
    return Vec3(center + radius * Vec3(std::cos(i * angle), std::sin(i * angle), 0));
  };
  for (int i = 0; i < links; ++i) {
    scene::RigidBody& link =
        add_box(scene, fmt::format("loop{}", i), (corner(i) + corner(i + 1)) / 2, Vec3(0.9, 0.1, 0.1), 10);
    const Vec3 along = corner(i + 1) - corner(i);
    link.placement.orientation = shortest_rotation(Vec3::UnitX(), along);
  }
  for (int i = 0; i < links; ++i)
    add_joint(scene, type, fmt::format("loop{}", i), fmt::format("loop{}", (i + 1) % links), corner(i + 1),
              Vec3::UnitZ());
}

}  // namespace duet::test
