#include "sim/io/run_directory.h"

#include <algorithm>
#include <limits>

#include <fmt/format.h>

#include "sim/base/files.h"
#include "sim/base/frame_limits.h"
#include "sim/io/json_text.h"
#include "sim/io/run_journal.h"

namespace duet::io {
namespace {

void write_origin(nlohmann::ordered_json& object, const Origin& origin) {
  object["version"] = origin.version;
  object["git_commit"] = origin.git_commit;
  object["compiler"] = origin.compiler;
  object["variant"] = origin.variant;
  object["numerics"] = origin.numerics;
  object["machine"] = origin.machine;
}

// Thrown while a manifest is parsed: says in words for a FileError what is wrong with it.
struct BadManifest {
  std::string what;
};

// Returns the number object[key]. Throws BadManifest if it is not a number from `least` to `most`.
double number_within(const nlohmann::json& object, const char* key, double least, double most) {
  const nlohmann::json& value = object.at(key);
  const double number = value.is_number() ? value.get<double>() : std::numeric_limits<double>::quiet_NaN();
  if (!(number >= least && number <= most))
    throw BadManifest{fmt::format("`{}` must be a number from {:.10g} to {:.10g}, is {}", key, least, most,
                                  value.dump().substr(0, 40))};
  return number;
}

double integer_within(const nlohmann::json& object, const char* key, double least, double most) {
  const double number = number_within(object, key, least, most);
  if (!object.at(key).is_number_integer())
    throw BadManifest{fmt::format("`{}` must be an integer, is {}", key, object.at(key).dump())};
  return number;
}

int count_within(const nlohmann::json& object, const char* key, int most) {
  return static_cast<int>(integer_within(object, key, 0, most));
}

std::uint32_t read_numerics(const nlohmann::json& object) {
  constexpr auto most = std::numeric_limits<std::uint32_t>::max();
  if (!object.contains("numerics")) return 0;
  return static_cast<std::uint32_t>(integer_within(object, "numerics", 0, most));
}

Origin read_origin(const nlohmann::json& object) {
  return {object.at("version"),        object.at("git_commit"), object.value("compiler", ""),
          object.value("variant", ""), read_numerics(object),   object.at("machine")};
}

nlohmann::ordered_json to_json(const Vec3& x) { return {x.x(), x.y(), x.z()}; }

std::optional<Eigen::AlignedBox3d> read_box(const nlohmann::json& body) {
  if (!body.contains("box")) return std::nullopt;
  const auto corner = [&](std::size_t which) {
    const nlohmann::json& x = body.at("box").at(which);
    const Vec3 place(x.at(0).get<double>(), x.at(1).get<double>(), x.at(2).get<double>());
    if (!place.allFinite()) throw BadManifest{"`box` must be of finite numbers"};
    return place;
  };
  return Eigen::AlignedBox3d(corner(0), corner(1));
}

// Remedy for files that differ from the journal.
constexpr const char* unlike_journal =
    "`duet verify RUN` names all damaged files: put them back from a copy, or simulate the scene anew";

}  // namespace

fs::path RunDirectory::mesh(int frame) const { return root / "mesh" / fmt::format("{:04}.obj", frame); }
fs::path RunDirectory::level_set(int frame) const {
  return root / "levelset" / fmt::format("{:04}.vdb", frame);
}
fs::path RunDirectory::values(int frame) const { return root / "values" / fmt::format("{:04}.npy", frame); }
fs::path RunDirectory::image(int frame) const { return root / "image" / fmt::format("{:04}.png", frame); }

void RunDirectory::write(const fs::path& path, const std::string& bytes) const {
  if (!journal) return write_atomically(path, bytes);
  const FileMark mark = mark_of(bytes);
  // If the journal lists these very bytes, the file is as listed before and after the write: no line
  // "replacing" is needed.
  const std::optional<RunJournal::Entry> listed = journal->entry(path);
  if (!listed || listed->mark != mark) journal->replace(path, mark);
  write_atomically(path, bytes);
  journal->list(path, mark);
}

std::string RunDirectory::read(const fs::path& path) const {
  std::string bytes = read_file(path);
  if (const std::string fault = journal ? journal->fault(path, bytes) : ""; !fault.empty())
    throw FileError(path.string(), fault, unlike_journal);
  return bytes;
}

void RunDirectory::remove(const fs::path& path) const {
  if (journal) journal->remove(path);
  remove_file(path);
}

void RunDirectory::require_whole(const fs::path& path) const {
  if (const std::string fault = journal ? journal->fault(path) : ""; !fault.empty())
    throw FileError(path.string(), fault, unlike_journal);
}

RunDirectory open_run(const fs::path& root) { return {root, RunJournal::read(root)}; }

std::vector<ManifestBody> manifest_bodies(const scene::Scene& scene,
                                          const std::vector<BodySurface>& surfaces) {
  std::vector<ManifestBody> bodies;
  const auto add = [&](const auto& body, const char* kind, const std::string& material) {
    const Surface& surface = surfaces.at(bodies.size()).surface;
    Eigen::AlignedBox3d box;
    for (const Vec3& x : surface.positions) box.extend(x);
    bodies.push_back({body.name, kind, body.look, material, static_cast<int>(surface.positions.size()),
                      static_cast<int>(surface.triangles.size()), box,
                      static_cast<int>(surface.normals.size()), static_cast<int>(surface.uvs.size()),
                      !surface.strain.empty()});
  };
  for (const scene::RigidBody& body : scene.rigid)
    add(body, body.is_static ? "static" : body.is_kinematic ? "kinematic" : "rigid", {});
  for (const scene::DeformableBody& body : scene.deformable) add(body, "deformable", body.material);
  return bodies;
}

std::string program_text(const Origin& origin) {
  std::string text = fmt::format("duet {} ({})", origin.version, origin.git_commit);
  for (const std::string& part : {origin.compiler, origin.variant})
    if (!part.empty()) text += ", " + part;
  return text;
}

std::vector<EarlierFrames> earlier_frames(const Manifest& before, int last_frame, const Origin& now) {
  std::vector<EarlierFrames> earlier = before.earlier;
  earlier.push_back({last_frame, before.origin});
  // If the newest checkpoints were lost, frames after `last_frame` are there and will be computed again:
  // entries that reach beyond it are cut off.
  const auto last = std::find_if(earlier.begin(), earlier.end(), [&](const EarlierFrames& frames) {
    return frames.last_frame >= last_frame;
  });
  last->last_frame = last_frame;
  earlier.erase(last + 1, earlier.end());
  if (earlier.back().origin == now) earlier.pop_back();
  return earlier;
}

void write_manifest(const RunDirectory& run, const Manifest& manifest) {
  nlohmann::ordered_json bodies = nlohmann::ordered_json::array();
  for (const ManifestBody& body : manifest.bodies) {
    nlohmann::ordered_json entry = {{"name", body.name}, {"kind", body.kind}, {"look", body.look}};
    if (!body.material.empty()) entry["material"] = body.material;
    entry["vertices"] = body.vertices;
    entry["triangles"] = body.triangles;
    entry["normals"] = body.normals;
    entry["uvs"] = body.uvs;
    if (body.is_deformable()) entry["has_strain"] = body.has_strain;
    if (body.box && !body.box->isEmpty()) entry["box"] = {to_json(body.box->min()), to_json(body.box->max())};
    bodies.push_back(std::move(entry));
  }
  using Json = nlohmann::ordered_json;
  Json document = {{"title", manifest.title}, {"scene", manifest.scene}, {"command", manifest.command}};
  write_origin(document, manifest.origin);
  for (const EarlierFrames& frames : manifest.earlier) {
    Json entry = {{"last_frame", frames.last_frame}};
    write_origin(entry, frames.origin);
    document["earlier"].push_back(std::move(entry));
  }
  document["fps"] = manifest.fps;
  document["frames"] = manifest.frames;
  document["units"] = manifest.units;
  document["bodies"] = std::move(bodies);
  run.write(run.manifest(), document.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

Manifest read_manifest(const RunDirectory& run) {
  const std::string text = run.read(run.manifest());
  const auto fail = [&](const std::string& what) {
    throw FileError(run.manifest().string(), "is no manifest of a run: " + what,
                    "simulate the scene anew, or give the folder of another run");
  };
  if (json_depth(text) > max_json_depth) fail("it nests too deep");
  try {
    const nlohmann::json document = nlohmann::json::parse(text);
    Manifest manifest;
    document.at("title").get_to(manifest.title);
    document.at("scene").get_to(manifest.scene);
    document.at("command").get_to(manifest.command);
    manifest.origin = read_origin(document);
    for (const nlohmann::json& entry : document.value("earlier", nlohmann::json::array()))
      manifest.earlier.push_back({count_within(entry, "last_frame", max_frames), read_origin(entry)});
    manifest.fps = number_within(document, "fps", min_fps, max_fps);
    manifest.frames = count_within(document, "frames", max_frames);
    document.at("units").get_to(manifest.units);
    constexpr int max_elements = std::numeric_limits<int>::max();
    for (const nlohmann::json& entry : document.at("bodies"))
      manifest.bodies.push_back({entry.at("name"), entry.at("kind"), entry.at("look"),
                                 entry.value("material", ""), count_within(entry, "vertices", max_elements),
                                 count_within(entry, "triangles", max_elements), read_box(entry),
                                 entry.contains("normals") ? count_within(entry, "normals", max_elements) : 0,
                                 entry.contains("uvs") ? count_within(entry, "uvs", max_elements) : 0,
                                 entry.value("has_strain", true)});
    return manifest;
  } catch (const nlohmann::json::exception& error) {
    fail(error.what());
  } catch (const BadManifest& error) {
    fail(error.what);
  }
  return {};
}

}  // namespace duet::io
