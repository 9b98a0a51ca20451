// A run directory made from formulas: rigid bodies move along lines and turn about axes, and the points of
// deformable ones swing.
#pragma once

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "sim/base/files.h"
#include "sim/base/scratch_folder.h"
#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/io/export/exported_run.h"
#include "sim/io/values_file.h"

namespace duet::test {

// Returns a cube with edges of length `edge` (m). Its edges are sharp, or the faces around a corner share a
// normal.
inline Surface cube(double edge, bool is_sharp) {
  Surface surface;
  for (int i = 0; i < 8; ++i)
    surface.positions.emplace_back(edge * ((i & 1) - 0.5), edge * ((i >> 1 & 1) - 0.5),
                                   edge * ((i >> 2) - 0.5));
  surface.uvs = {Vec2f(0, 0), Vec2f(1, 0), Vec2f(0, 1), Vec2f(1, 1)};
  const std::array<std::array<int, 4>, 6> faces{
      {{0, 2, 1, 3}, {4, 5, 6, 7}, {0, 1, 4, 5}, {2, 6, 3, 7}, {0, 4, 2, 6}, {1, 3, 5, 7}}};
  for (int f = 0; f < 6; ++f) {
    const auto corner = [&](int k) {
      const int at = faces[static_cast<std::size_t>(f)][static_cast<std::size_t>(k)];
      return Corner{at, k, is_sharp ? f : at};
    };
    surface.triangles.push_back({corner(0), corner(1), corner(3)});
    surface.triangles.push_back({corner(0), corner(3), corner(2)});
  }
  surface.normals.resize(is_sharp ? 6 : 8);
  update_normals(surface);
  return surface;
}

// Writes a run directory with a rigid, a static and two deformable bodies, and knows its values at every
// frame.
class SampleRun {
 public:
  static constexpr double fps = 1000;  // 1/s: so high that differences between frames are nearly velocities

  // Makes the run; `shift` (m) moves everything away from the origin.
  explicit SampleRun(const Vec3& shift = Vec3::Zero()) : shift_(shift) {
    bodies.push_back({"block", cube(0.5, true)});
    bodies.push_back({"wall", cube(2, true)});
    bodies.push_back({"jelly", cube(0.25, false)});
    bodies.push_back({"jelly.2", cube(0.125, false)});
    for (std::size_t i : {2, 3})
      for (Vec3& x : bodies[i].surface.positions) x += home(i);
    manifest.title = "Sample";
    manifest.scene = "sample.toml";
    manifest.fps = fps;
    manifest.frames = 5;
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Surface& s = bodies[i].surface;
      const auto count = [](const auto& values) { return static_cast<int>(values.size()); };
      manifest.bodies.push_back({bodies[i].name,
                                 i == 0   ? "rigid"
                                 : i == 1 ? "static"
                                          : "deformable",
                                 "", "", count(s.positions), count(s.triangles), std::nullopt,
                                 count(s.normals), count(s.uvs)});
    }
    io::create_folder(run.values(0).parent_path());
    io::write_manifest(run, manifest);
    run.write(run.body_values(), io::npy_text(bodies));
    for (int frame = 0; frame <= manifest.frames; ++frame)
      run.write(run.values(frame), io::npy_text(values(frame)));
  }

  // Returns what the file of a frame holds.
  io::FrameValues values(int frame) const {
    io::FrameValues result;
    result.frame = frame;
    result.time = frame / fps;
    const double t = result.time;
    const Vec3 spin(1, 2, -0.5);
    RigidMotion block, wall;
    block.velocity = Vec3(0.3, -1.0 / 3, 2);
    block.angular_velocity = spin;
    block.pose.position = home(0) + t * block.velocity;
    block.pose.orientation = Quat(Eigen::AngleAxisd(spin.norm() * t, spin.normalized())) *
                             Quat(Eigen::AngleAxisd(0.7, Vec3(1, 1, 0).normalized()));
    wall.pose.position = home(1);
    wall.pose.orientation = Quat(Eigen::AngleAxisd(0.1, Vec3::UnitZ()));
    result.rigid = {block, wall};
    result.contact.rigid_force = {Vec3(1, 2, 3 + frame), Vec3(-1, 0.1, frame)};
    result.contact.rigid_torque = {Vec3(4, 5 + frame, 6), Vec3(0, -1.0 / 3, frame)};
    for (std::size_t i : {2, 3})
      for (const Vec3& x : bodies[i].surface.positions) {
        const Vec3 arm = x - home(i);
        result.points.push_back(x + std::sin(3 * t) * Vec3(arm.y(), 2 * arm.z(), arm.x()) +
                                t * Vec3(0, -1, 0));
        result.velocities.push_back(
            (3 * std::cos(3 * t) * Vec3(arm.y(), 2 * arm.z(), arm.x()) + Vec3(0, -1, 0)).cast<float>());
        result.strain.push_back(static_cast<float>(0.1 * frame + arm.x()));
        result.stress.push_back(static_cast<float>(1e6 * (1 + frame + arm.y())));
        result.energy_density.push_back(static_cast<float>(1e3 * (1 + frame + arm.z())));
        result.contact.force.push_back((frame * Vec3(arm.x(), 2, 3 * arm.z())).cast<float>());
        result.contact.pressure.push_back(static_cast<float>(100 * (1 + frame + arm.x())));
      }
    return result;
  }

  io::ExportedRun exported(const io::ExportChoice& choice = {}) const { return {run, choice}; }

  ScratchFolder scratch;
  io::RunDirectory run{scratch / "run"};
  io::Manifest manifest;
  std::vector<BodySurface> bodies;  // surfaces at rest

 private:
  Vec3 home(std::size_t body) const { return shift_ + Vec3(2.0 * static_cast<double>(body), 1.0 / 7, -1); }

  Vec3 shift_;
};

// Returns two looks, which bodies wear in turn, and a view.
inline io::ExportedLooks sample_looks() {
  io::ExportedLooks looks;
  looks.looks.resize(2);
  looks.looks[0].name = "Red";
  looks.looks[0].color = Vec3(0.7, 0.1, 0.05);
  looks.looks[0].roughness = 0.25;
  looks.looks[0].metallic = 1;
  looks.looks[1].name = "red";
  looks.looks[1].opacity = 0.5;
  looks.looks[1].pattern = "checker";
  looks.of_body = {0, 1, 0, 1};
  looks.lights.resize(1);
  looks.lights[0].position = Vec3(1, 2, 3);
  return looks;
}

}  // namespace duet::test
