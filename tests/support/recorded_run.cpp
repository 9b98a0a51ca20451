#include "tests/support/recorded_run.h"

#include <algorithm>

#include "tests/support/scenes.h"

#include "sim/base/files.h"

namespace duet::test {
namespace {

io::FrameValues values_of(const Simulation& simulation, const scene::Scene& scene) {
  io::FrameValues values;
  values.frame = simulation.frame();
  values.time = simulation.frame() / scene.fps;
  simulation.rigid_motion(values.rigid);
  simulation.surface_velocities(values.velocities);
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  for (std::size_t i = scene.rigid.size(); i < surfaces.size(); ++i)
    values.points.insert(values.points.end(), surfaces[i].surface.positions.begin(),
                         surfaces[i].surface.positions.end());
  values.strain.resize(values.points.size());
  simulation.surface_stress(values.stress, values.energy_density);
  simulation.contact_loads(surfaces, values.contact);
  return values;
}

}  // namespace

io::RunDirectory record_run(const scene::Scene& scene, int last, const io::fs::path& folder,
                            const std::function<void(io::FrameValues&)>& change) {
  Simulation simulation(scene, plan(scene));
  io::RunDirectory run{folder};
  std::vector<BodySurface> surfaces;
  simulation.rest_surfaces(surfaces);
  io::Manifest manifest;
  manifest.title = scene.title;
  manifest.fps = scene.fps;
  manifest.frames = last;
  manifest.bodies = io::manifest_bodies(scene, surfaces);
  io::create_folder(run.values(0).parent_path());
  io::write_manifest(run, manifest);
  io::write_atomically(run.body_values(), io::npy_text(surfaces));
  for (int frame = 0; frame <= last; ++frame) {
    if (frame > 0) simulation.advance_frame();
    io::FrameValues values = values_of(simulation, scene);
    if (change) change(values);
    io::write_atomically(run.values(frame), io::npy_text(values));
  }
  return run;
}

io::ExportedLooks looks_of(const scene::Scene& scene, const io::Manifest& manifest) {
  io::ExportedLooks looks;
  looks.looks.emplace_back().name = "plain";
  looks.looks.insert(looks.looks.end(), scene.looks.begin(), scene.looks.end());
  for (const io::ManifestBody& body : manifest.bodies) {
    const auto look = std::find_if(looks.looks.begin(), looks.looks.end(),
                                   [&](const scene::Look& one) { return one.name == body.look; });
    looks.of_body.push_back(look == looks.looks.end() ? 0 : static_cast<int>(look - looks.looks.begin()));
  }
  looks.camera = scene.camera;
  looks.lights = scene.lights;
  looks.width = scene.render.width;
  looks.height = scene.render.height;
  return looks;
}

scene::Scene one_of_each(const Vec3& center) {
  scene::Scene scene = free_space();
  scene.gravity = Vec3(0, -9.8, 0);
  add_box(scene, "floor", center - Vec3(0, 2, 0), Vec3(6, 0.2, 6), 1).is_static = true;
  scene.rigid.back().mass.reset();
  for (const double x : {-2.0, -1.0, 0.0}) {
    const Vec3 size = x < 0 ? Vec3(0.3, 0.2, 0.4) : Vec3(0.2, 0.5, 0.2);
    add_box(scene, "box" + std::to_string(scene.rigid.size()), center + Vec3(x, 0, 0), size, 1)
        .placement.angular_velocity = Vec3(3, -2, 5);
  }
  scene::RigidBody& ball = add_ball(scene, "ball", center + Vec3(1, 0, 0), 0.2, 1);
  ball.mass.reset();
  ball.is_kinematic = true;
  scene::Spin spin;
  spin.axis = Vec3(1, 1, 0);
  spin.rate = 1;
  ball.motion.spin.push_back(spin);
  add_soft_box(scene, "soft", center + Vec3(2, 0, 0), Vec3(0.4, 0.3, 0.3), 3).placement.angular_velocity =
      Vec3(0, 4, 1);
  scene::DeformableBody cloth = scene.deformable.front();
  cloth.name = "cloth";
  cloth.placement.position = center + Vec3(0, 0, 2);
  cloth.shape.kind = scene::DeformableKind::panel;
  cloth.shape.panel_size = Vec2(0.8, 0.8);
  cloth.shape.panel_cells = Eigen::Vector2i(6, 6);
  cloth.thickness = 0.01;
  cloth.mass.reset();
  cloth.placement.angular_velocity.setZero();
  scene::Pin edge;
  edge.from = Vec3(-0.4, 0, -0.4);
  edge.to = Vec3(0.4, 0, -0.4);
  cloth.pins.push_back(edge);
  scene::DeformableBody rod = cloth;
  rod.name = "rod";
  rod.placement.position = center + Vec3(0, 0, -2);
  rod.shape.kind = scene::DeformableKind::rod;
  rod.shape.points = {Vec3(-0.5, 0, 0), Vec3(0.5, 0, 0)};
  rod.shape.segments = 8;
  rod.thickness = 0.04;
  scene::Pin end;
  end.from = Vec3(-0.5, 0, 0);
  rod.pins.push_back(end);
  scene.deformable.push_back(cloth);
  scene.deformable.push_back(rod);
  return scene;
}

}  // namespace duet::test
