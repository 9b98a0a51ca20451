#include "sim/scene/explain.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/scene/accuracy.h"
#include "sim/scene/schema.h"

namespace duet::scene {
namespace {

// Mass ratio of bodies above which a warning is given: sweeps over contacts converge slowly there.
constexpr double large_mass_ratio = 100;
// Distance of a skin from the contact surface above which a warning is given, as a fraction of the skin's
// extent: three pixels if the body is 300 pixels wide.
constexpr double max_of_extent = 0.01;
// Thickness of a mesh, in cells of its level set, below which a warning is given: such a mesh has hardly an
// inside.
constexpr double min_cells = 3;
// Poisson's ratio below which a warning is given, unless the model is St. Venant and Kirchhoff's. At -0.575
// and above, a ball that hits a wall at the speed at which its kinetic energy is that of a strain of 0.16
// stays whole with all models (tests/hard/material.toml, auxetic_thrown).
constexpr double min_poisson_ratio = -0.5;
// Steps per frame above which a warning is given: the frame takes minutes rather than seconds.
constexpr int many_substeps = 1000;

std::string title_of(const Scene& scene) {
  std::string title = scene.title.empty() ? scene.path : scene.title;
  if (!scene.figure.empty()) title += fmt::format(" (figure {})", scene.figure);
  return title;
}

void write_effects(std::string& out, const EffectPlan& plan) {
  out += "effects\n";
  for (const PlannedEffect& planned : plan.effects)
    if (planned.active) out += fmt::format("  {:<25} {}\n", name(planned.effect), planned.reason);
  for (const PlannedEffect& planned : plan.effects)
    if (!planned.active) out += fmt::format("  {:<25} off: {}\n", name(planned.effect), planned.reason);
}

// Writes a line for each step of the paper: "  IV   1 advance position, 3 back to v^^n".
void write_stages(std::string& out, const WorldSizes& sizes) {
  out += "stages of a step";
  std::string_view step;
  for (const std::string_view stage : sizes.stages) {
    const std::string_view number = stage.substr(0, stage.find_first_of(". "));
    out += number == step ? ", " : fmt::format("\n  {:<4} ", number);
    out += stage.substr(number.size() + 1);
    step = number;
  }
  out += '\n';
}

// Returns the bodies that share a size (GridSize, TetSize or SkinSize) as text: "`bowl`", "`bowl` and 3 more
// bodies".
template <class Shared>
std::string sharers(const Shared& shared) {
  if (shared.bodies == 1) return fmt::format("`{}`", shared.body);
  return fmt::format("`{}` and {} more {}", shared.body, shared.bodies - 1,
                     shared.bodies == 2 ? "body" : "bodies");
}

void write_sizes(std::string& out, const WorldSizes& sizes) {
  out += fmt::format("sizes\n  {} dynamic, {} kinematic and {} static rigid bodies, {} surface samples\n",
                     sizes.rigid_dynamic, sizes.rigid_kinematic, sizes.rigid_static, sizes.rigid_samples);
  for (const GridSize& grid : sizes.grids)
    out += fmt::format("  level set of {}: {} x {} x {} nodes {:.3g} m apart, at its thickest {:.3g} m\n",
                       sharers(grid), grid.nodes.x(), grid.nodes.y(), grid.nodes.z(), grid.spacing,
                       grid.thickness);
  out += fmt::format(
      "  {} deformable bodies: {} particles, {} tetrahedra, {} surface triangles, {} face samples\n",
      sizes.deformable, sizes.particles, sizes.tets, sizes.surface_triangles, sizes.face_samples);
  for (const TetSize& mesh : sizes.tet_meshes)
    out += fmt::format(
        "  {} tetrahedra of {}: smallest altitude {:.3g} m, dihedral angles {:.1f} to {:.1f} degrees\n",
        mesh.tets, sharers(mesh), mesh.min_altitude, mesh.min_angle, mesh.max_angle);
  for (const SkinSize& skin : sizes.skins)
    out += fmt::format(
        "  {} triangles drawn of {}: at most {:.2g} m outside of the tetrahedra, which touch in their place, "
        "and {:.2g} m below "
        "their boundary\n",
        skin.triangles, sharers(skin), skin.outside, skin.inside);
  if (sizes.heaviest > 0)
    out += fmt::format("masses\n  {:.6g} kg to {:.6g} kg, ratio {:.4g}:1\n", sizes.lightest, sizes.heaviest,
                       mass_ratio(sizes));
}

// Returns why solver.relaxation does not raise the elastic bound.
const char* why_not_relaxed(const Solver& solver) {
  if (solver.integration == Integration::implicit) return "elasticity is implicit";
  if (solver.compression == Compression::followed) return "compression is \"followed\"";
  return "no neo-Hookean material that is not incompressible, nor springs, are damped for so long";
}

void write_time(std::string& out, const Scene& scene, const WorldSizes& sizes,
                const TimeStepEstimate& estimate) {
  out += fmt::format("time\n  {} frames at {:.6g} 1/s: {:.6g} s\n", scene.frames, scene.fps,
                     scene.frames / scene.fps);
  if (estimate.elastic_bound > 0)
    out += fmt::format("  elastic bound on the time step {:.4g} s, of which solver.cfl = {:.4g} is used\n",
                       estimate.elastic_bound, scene.solver.cfl);
  if (estimate.elastic_bound > sizes.undamped_elastic_dt)
    out += fmt::format("  (that of undamped materials would be {:.4g} s: solver.relaxation = {:.4g})\n",
                       sizes.undamped_elastic_dt, scene.solver.relaxation);
  else if (scene.solver.relaxation > 0)
    out += fmt::format("  (solver.relaxation = {:.4g} lifts nothing: {})\n", scene.solver.relaxation,
                       why_not_relaxed(scene.solver));
  out += fmt::format("  at least {} substeps a frame of at most {:.4g} s; fast bodies that meet take more\n",
                     estimate.substeps_per_frame, estimate.time_step);
  out += fmt::format("  the first step is bounded by {}: {:.4g} s\n", sizes.time_step_bound, sizes.time_step);
}

// Returns an error as text: "3.1 mm", "0.34 %", "2e-06 rad". `unit` is empty for a relative error.
std::string error_text(double error, std::string_view unit) {
  if (unit.empty()) return fmt::format("{:.2g} %", 100 * error);
  return unit == "m" ? fmt::format("{:.2g} mm", 1000 * error) : fmt::format("{:.2g} {}", error, unit);
}

// Writes the errors of the presets in the studies, and their cost relative to the preset `standard`.
void write_accuracy(std::string& out, const Scene& scene) {
  const auto chosen = static_cast<std::size_t>(scene.solver.accuracy);
  constexpr auto standard = static_cast<std::size_t>(Accuracy::standard);
  out += fmt::format(
      "accuracy\n  {}; errors that the presets left in short studies (tests/PROTOCOL.md), and their time:\n",
      accuracy_names[chosen]);
  for (const PresetStudy& study : preset_studies()) {
    out += fmt::format("  {:<44}", fmt::format("{}, {}:", study.study, study.measure));
    for (std::size_t i = 0; i < study.error.size(); ++i)
      out += fmt::format("  {}{} {} x {:.2g}", i == chosen ? "*" : "", accuracy_names[i],
                         error_text(study.error[i], study.unit), study.seconds[i] / study.seconds[standard]);
    out += '\n';
  }
}

}  // namespace

TimeStepEstimate estimate_time_step(const Scene& scene, const WorldSizes& sizes) {
  TimeStepEstimate estimate;
  if (scene.solver.integration != Integration::implicit) estimate.elastic_bound = sizes.elastic_dt;
  const double frame = 1 / scene.fps;
  double limit = std::min(frame, scene.solver.max_time_step);
  if (estimate.elastic_bound > 0) limit = std::min(limit, scene.solver.cfl * estimate.elastic_bound);
  // The factor keeps rounding from adding a step if the frame is a whole number of limits.
  estimate.substeps_per_frame = static_cast<int>(std::min(std::ceil(frame / limit * (1 - 1e-12)), 1e9));
  estimate.time_step = frame / estimate.substeps_per_frame;
  return estimate;
}

std::string step_warning(const Scene& scene, const WorldSizes& sizes) {
  constexpr const char* remedy =
      "a larger `fps` or solver.max_time_step, slower motion, or bodies that are softer, coarser or heavier "
      "allow fewer";
  const double lasting = estimate_time_step(scene, sizes).substeps_per_frame;
  const double first = sizes.time_step > 0 ? 1 / scene.fps / sizes.time_step : 0;
  if (std::max(lasting, first) <= std::min<double>(many_substeps, scene.solver.max_substeps)) return {};
  if (lasting > scene.solver.max_substeps)
    return fmt::format(
        "{:.7g} substeps a frame are more than solver.max_substeps = {} allows, and the run will stop: {}",
        lasting, scene.solver.max_substeps, remedy);
  if (first > 2 * lasting)
    return fmt::format(
        "the first step is {:.3g} s long, bounded by {}, and a frame takes {:.3g} of that length: {}",
        sizes.time_step, sizes.time_step_bound, first, remedy);
  return fmt::format("{:.7g} substeps a frame: {}", lasting, remedy);
}

double mass_ratio(const WorldSizes& sizes) {
  return sizes.lightest > 0 ? sizes.heaviest / sizes.lightest : 1;
}

namespace {

// Returns whether incompressible bodies may gain energy, because damping acts on the velocities that contact
// and elastic forces have changed before the pressures respond to them.
bool is_damped_before_pressures(const Scene& scene) {
  return scene.solver.velocity_constraints == VelocityConstraints::before_solve &&
         std::any_of(scene.deformable.begin(), scene.deformable.end(),
                     [](const DeformableBody& body) { return body.incompressible; });
}

// Returns the warning for a skin that lies far from the contact surface.
std::string skin_warning(const SkinSize& skin) {
  // A distance below a tenth of the other one is not mentioned.
  const double least = 0.1 * std::max(skin.outside, skin.inside);
  std::string what;
  if (skin.outside > least) what = fmt::format("may enter other bodies by {:.2g} m", skin.outside);
  if (skin.inside > least)
    what += fmt::format("{}may stay {:.2g} m away from them", what.empty() ? "" : ", or ", skin.inside);
  return fmt::format(
      "what is drawn of {} {}, as the tetrahedra below it touch in its place: give it a smaller "
      "shape.spacing, "
      "or a `skin` with contact = true",
      sharers(skin), what);
}

}  // namespace

std::vector<std::string> skin_warnings(const WorldSizes& sizes) {
  std::vector<std::string> found;
  for (const SkinSize& skin : sizes.skins)
    if (std::max(skin.outside, skin.inside) > max_of_extent * skin.extent)
      found.push_back(skin_warning(skin));
  return found;
}

std::vector<std::string> material_warnings(const Scene& scene) {
  std::vector<std::string> found;
  for (const Material& material : scene.materials) {
    const bool is_of_elements =
        !material.has_springs &&
        std::any_of(scene.deformable.begin(), scene.deformable.end(), [&](const DeformableBody& body) {
          return body.material == material.name && body.shape.is_volume();
        });
    if (is_of_elements && material.poisson_ratio < min_poisson_ratio &&
        material.model != MaterialModel::st_venant_kirchhoff)
      found.push_back(
          fmt::format("material `{}`: with a Poisson's ratio of {:.4g}, below {:.4g}, elements that are "
                      "strongly compressed "
                      "fail with this model: set model = \"st_venant_kirchhoff\"",
                      material.name, material.poisson_ratio, min_poisson_ratio));
  }
  return found;
}

std::vector<std::string> warnings(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes) {
  std::vector<std::string> found;
  if (sizes.rigid_dynamic + sizes.rigid_kinematic + sizes.deformable == 0)
    found.emplace_back("nothing moves: every body is static");
  if (sizes.deformable > 0 && (!scene.joints.empty() || sizes.thin > 0) &&
      mass_ratio(sizes) > large_mass_ratio && scene.solver.integration != Integration::implicit)
    found.push_back(fmt::format(
        "the mass ratio {:.4g}:1 is above {:.0f}:1: if heavy deformable bodies sink into light rigid ones "
        "that joints hold or that touch sheets or rods, set solver.integration = \"implicit\"",
        mass_ratio(sizes), large_mass_ratio));
  if (is_damped_before_pressures(scene))
    found.emplace_back(
        "incompressible bodies in contact may gain energy with solver.velocity_constraints = "
        "\"before_solve\": use \"after_solve\"");
  for (const InitialOverlap& overlap : sizes.initial_overlaps) found.push_back(describe_separation(overlap));
  for (const GridSize& grid : sizes.grids)
    if (grid.thickness < min_cells * grid.spacing)
      found.push_back(fmt::format(
          "the mesh of {} is at its thickest {:.3g} m, less than {:.0f} cells of its level set: raise "
          "shape.cells, or other bodies may pass through",
          sharers(grid), grid.thickness, min_cells));
  for (std::string& warning : material_warnings(scene)) found.push_back(std::move(warning));
  for (const LooseBone& loose : sizes.loose_bones)
    found.push_back(fmt::format(
        "`{}` holds {} of `{}`, all on one line, and can turn about it without moving the flesh: make "
        "the tetrahedra smaller than the bone is thick, or the bone thicker",
        loose.bone, loose.particles == 1 ? "one particle" : fmt::format("{} particles", loose.particles),
        loose.flesh));
  for (std::string& warning : skin_warnings(sizes)) found.push_back(std::move(warning));
  if (std::string warning = step_warning(scene, sizes); !warning.empty()) found.push_back(std::move(warning));
  for (const PlannedEffect& planned : plan.effects)
    if (planned.reason == removed_by_user)
      found.push_back(
          fmt::format("{} is removed by --without, though the scene calls for it", name(planned.effect)));
  return found;
}

namespace {

// Returns the warnings about the scene and those in `further`.
std::vector<std::string> all_warnings(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes,
                                      const std::vector<std::string>& further) {
  std::vector<std::string> found = warnings(scene, plan, sizes);
  found.insert(found.end(), further.begin(), further.end());
  return found;
}

// Returns the list of the effects of the plan, with their reasons.
nlohmann::json effects_json(const EffectPlan& plan) {
  nlohmann::json list = nlohmann::json::array();
  for (const PlannedEffect& planned : plan.effects)
    list.push_back({{"name", name(planned.effect)}, {"active", planned.active}, {"reason", planned.reason}});
  return list;
}

// Returns the list of the grids of level sets.
nlohmann::json grids_json(const WorldSizes& sizes) {
  nlohmann::json list = nlohmann::json::array();
  for (const GridSize& grid : sizes.grids)
    list.push_back({{"body", grid.body},
                    {"bodies", grid.bodies},
                    {"nodes", {grid.nodes.x(), grid.nodes.y(), grid.nodes.z()}},
                    {"spacing", grid.spacing},
                    {"thickness", grid.thickness}});
  return list;
}

// Returns the list of the meshes of tetrahedra.
nlohmann::json tet_meshes_json(const WorldSizes& sizes) {
  nlohmann::json list = nlohmann::json::array();
  for (const TetSize& mesh : sizes.tet_meshes)
    list.push_back({{"body", mesh.body},
                    {"bodies", mesh.bodies},
                    {"tets", mesh.tets},
                    {"smallest_altitude", mesh.min_altitude},
                    {"dihedral_angles", {mesh.min_angle, mesh.max_angle}}});
  return list;
}

// Returns the list of the skins, with their distances from the tetrahedra.
nlohmann::json skins_json(const WorldSizes& sizes) {
  nlohmann::json list = nlohmann::json::array();
  for (const SkinSize& skin : sizes.skins)
    list.push_back({{"body", skin.body},
                    {"bodies", skin.bodies},
                    {"triangles", skin.triangles},
                    {"outside", skin.outside},
                    {"inside", skin.inside}});
  return list;
}

// Returns the list of the overlaps at frame 0.
nlohmann::json overlaps_json(const WorldSizes& sizes) {
  nlohmann::json list = nlohmann::json::array();
  for (const InitialOverlap& overlap : sizes.initial_overlaps)
    list.push_back({{"bodies", {overlap.first, overlap.second}},
                    {"depth", overlap.depth},
                    {"place", {overlap.place.x(), overlap.place.y(), overlap.place.z()}},
                    {"left", overlap.left}});
  return list;
}

// Returns the list of what the presets cost and gain in the studies of accuracy.
nlohmann::json studies_json() {
  nlohmann::json list = nlohmann::json::array();
  for (const PresetStudy& study : preset_studies())
    list.push_back({{"study", study.study},
                    {"measure", study.measure},
                    {"unit", study.unit},
                    {"error", study.error},
                    {"seconds", study.seconds}});
  return list;
}

}  // namespace

std::string explain(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes,
                    const std::vector<std::string>& further) {
  std::string out = title_of(scene) + "\n\n";
  write_effects(out, plan);
  write_stages(out, sizes);
  write_sizes(out, sizes);
  write_time(out, scene, sizes, estimate_time_step(scene, sizes));
  write_accuracy(out, scene);
  const std::vector<std::string> found = all_warnings(scene, plan, sizes, further);
  out += found.empty() ? "no warnings\n" : "warnings\n";
  for (const std::string& warning : found) out += fmt::format("  {}\n", warning);
  return out;
}

nlohmann::json explain_json(const Scene& scene, const EffectPlan& plan, const WorldSizes& sizes,
                            const std::vector<std::string>& further) {
  const TimeStepEstimate estimate = estimate_time_step(scene, sizes);
  return {
      {"scene", scene.path},
      {"title", scene.title},
      {"figure", scene.figure},
      {"frames", scene.frames},
      {"fps", scene.fps},
      {"effects", effects_json(plan)},
      {"stages", sizes.stages},
      {"sizes",
       {{"rigid_dynamic", sizes.rigid_dynamic},
        {"rigid_kinematic", sizes.rigid_kinematic},
        {"rigid_static", sizes.rigid_static},
        {"rigid_samples", sizes.rigid_samples},
        {"grids", grids_json(sizes)},
        {"skins", skins_json(sizes)},
        {"deformable", sizes.deformable},
        {"particles", sizes.particles},
        {"tets", sizes.tets},
        {"tet_meshes", tet_meshes_json(sizes)},
        {"surface_triangles", sizes.surface_triangles},
        {"face_samples", sizes.face_samples}}},
      {"masses", {{"lightest", sizes.lightest}, {"heaviest", sizes.heaviest}, {"ratio", mass_ratio(sizes)}}},
      {"time",
       {{"elastic_bound", estimate.elastic_bound},
        {"time_step", estimate.time_step},
        {"substeps_per_frame", estimate.substeps_per_frame},
        {"first_step", sizes.time_step},
        {"first_step_bound", sizes.time_step_bound}}},
      {"accuracy",
       {{"preset", accuracy_names[static_cast<std::size_t>(scene.solver.accuracy)]},
        {"studies", studies_json()}}},
      {"initial_overlaps", overlaps_json(sizes)},
      {"warnings", all_warnings(scene, plan, sizes, further)}};
}

}  // namespace duet::scene
