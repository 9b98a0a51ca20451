#include "sim/io/run_directory.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/io/files.h"

namespace duet::io {

fs::path RunDirectory::mesh(int frame) const { return root / "mesh" / fmt::format("{:04}.obj", frame); }
fs::path RunDirectory::level_set(int frame) const {
  return root / "levelset" / fmt::format("{:04}.vdb", frame);
}
fs::path RunDirectory::image(int frame) const { return root / "image" / fmt::format("{:04}.png", frame); }

std::vector<ManifestBody> manifest_bodies(const scene::Scene& scene,
                                          const std::vector<BodySurface>& surfaces) {
  std::vector<ManifestBody> bodies;
  const auto add = [&](const auto& body, const char* kind, const std::string& material) {
    const Surface& surface = surfaces.at(bodies.size()).surface;
    bodies.push_back({body.name, kind, body.look, material, static_cast<int>(surface.positions.size()),
                      static_cast<int>(surface.triangles.size())});
  };
  for (const scene::RigidBody& body : scene.rigid)
    add(body, body.is_static ? "static" : body.is_kinematic ? "kinematic" : "rigid", {});
  for (const scene::DeformableBody& body : scene.deformable) add(body, "deformable", body.material);
  return bodies;
}

void write_manifest(const RunDirectory& run, const Manifest& manifest) {
  nlohmann::ordered_json bodies = nlohmann::ordered_json::array();
  for (const ManifestBody& body : manifest.bodies) {
    nlohmann::ordered_json entry = {{"name", body.name}, {"kind", body.kind}, {"look", body.look}};
    if (!body.material.empty()) entry["material"] = body.material;
    entry["vertices"] = body.vertices;
    entry["triangles"] = body.triangles;
    bodies.push_back(std::move(entry));
  }
  const nlohmann::ordered_json document = {
      {"title", manifest.title},     {"scene", manifest.scene},           {"command", manifest.command},
      {"version", manifest.version}, {"git_commit", manifest.git_commit}, {"machine", manifest.machine},
      {"fps", manifest.fps},         {"frames", manifest.frames},         {"units", manifest.units},
      {"bodies", std::move(bodies)}};
  using Json = nlohmann::ordered_json;
  write_atomically(run.manifest(), document.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

Manifest read_manifest(const RunDirectory& run) {
  const std::string text = read_file(run.manifest());
  try {
    const nlohmann::json document = nlohmann::json::parse(text);
    Manifest manifest;
    document.at("title").get_to(manifest.title);
    document.at("scene").get_to(manifest.scene);
    document.at("command").get_to(manifest.command);
    document.at("version").get_to(manifest.version);
    document.at("git_commit").get_to(manifest.git_commit);
    document.at("machine").get_to(manifest.machine);
    document.at("fps").get_to(manifest.fps);
    document.at("frames").get_to(manifest.frames);
    document.at("units").get_to(manifest.units);
    for (const nlohmann::json& entry : document.at("bodies"))
      manifest.bodies.push_back({entry.at("name"), entry.at("kind"), entry.at("look"),
                                 entry.value("material", ""), entry.at("vertices"), entry.at("triangles")});
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    throw FileError(run.manifest().string(), fmt::format("is no manifest of a run: {}", error.what()),
                    "simulate the scene anew, or give the folder of another run");
  }
}

}  // namespace duet::io
