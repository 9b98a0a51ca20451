#include "tools/study/run_result.h"

#include "tools/scene_files.h"
#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/io/checkpoint.h"
#include "sim/io/json_text.h"
#include "sim/scene/plan.h"
#include "sim/step/world.h"

namespace duet::study {
namespace {

// Returns the index of a body in a list of bodies or names; -1: there is none of this name.
template <class Body>
int index_of(const std::vector<Body>& bodies, const std::string& name) {
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if constexpr (std::is_same_v<Body, std::string>) {
      if (bodies[i] == name) return static_cast<int>(i);
    } else {
      if (bodies[i].name == name) return static_cast<int>(i);
    }
  }
  return -1;
}

}  // namespace

std::vector<nlohmann::json> read_stats(const fs::path& folder) {
  const io::RunDirectory run = io::open_run(folder);
  const fs::path path = run.stats();
  const std::string text = run.read(path);
  std::vector<nlohmann::json> frames;
  for (std::size_t begin = 0, end = 0; (end = text.find('\n', begin)) != std::string::npos; begin = end + 1) {
    frames.push_back(io::parse_json(std::string_view(text).substr(begin, end - begin)));
    if (!frames.back().is_object() || !frames.back().contains("hash"))
      throw FileError(path.string(), "holds a line that is no frame's statistics",
                      "simulate the scene again");
    if (frames.back().value("frame", nlohmann::json()) != frames.size() - 1)
      throw FileError(path.string(),
                      fmt::format("lacks frame {}: line {} is of frame {}", frames.size() - 1, frames.size(),
                                  frames.back().value("frame", nlohmann::json()).dump()),
                      "simulate the scene again");
  }
  if (frames.empty()) throw FileError(path.string(), "holds no frame", "simulate the scene again");
  return frames;
}

RunResult load_result(const Run& run) {
  RunResult result;
  const scene::ReadResult read = tools::read_scene(run.scene);
  const EffectSet effects = scene::plan_effects(read.scene, run.scene.without).active();
  result.scene = read.scene;
  result.frames = read_stats(run.folder);
  result.simulation = std::make_unique<Simulation>(read.scene, effects);
  result.start = centers_of_mass(result.simulation->world());
  const std::uint64_t identity = tools::run_identity(run.scene, read, effects);
  const io::CheckpointSearch search = io::find_checkpoint({run.folder}, identity);
  if (!search.found || search.found->frame != run.frames)
    throw FileError(run.folder.string(), "lacks the state of its last frame",
                    "remove the folder, and study again");
  tools::load_checkpoint({run.folder}, *search.found, *result.simulation);
  return result;
}

std::vector<Vec3> centers_of_mass(const World& world) {
  const Bodies& bodies = world.bodies;
  std::vector<Vec3> centers;
  for (const RigidState& state : bodies.rigid.state) centers.push_back(state.pose.position);
  for (const DeformableBody& body : bodies.deformable) {
    Vec3 sum = Vec3::Zero();
    double mass = 0;
    for (int i = 0; i < body.particle_count; ++i) {
      const auto p = static_cast<std::size_t>(body.first_particle) + static_cast<std::size_t>(i);
      sum += bodies.particles.mass[p] * bodies.particles.x[p];
      mass += bodies.particles.mass[p];
    }
    centers.push_back(sum / mass);
  }
  return centers;
}

int rigid_index(const World& world, const std::string& name) {
  return index_of(world.bodies.rigid.name, name);
}
int deformable_index(const World& world, const std::string& name) {
  return index_of(world.bodies.deformable, name);
}

double dynamic_mass(const World& world) {
  double mass = 0;
  for (const RigidProperties& properties : world.bodies.rigid.properties)
    if (properties.is_dynamic()) mass += properties.mass;
  for (const double particle : world.bodies.particles.mass) mass += particle;
  return mass;
}

std::int64_t unknowns(const World& world) {
  std::int64_t count = 0;
  for (const RigidProperties& properties : world.bodies.rigid.properties)
    count += properties.is_dynamic() ? 6 : 0;
  for (std::size_t p = 0; p < world.bodies.particles.size(); ++p)
    count += is_held(world.bodies.particles, p) ? 0 : 3;
  return count;
}

}  // namespace duet::study
