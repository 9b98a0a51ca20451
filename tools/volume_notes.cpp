#include "tools/volume_notes.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/base/wording.h"
#include "sim/contact/detection/surface_intersections.h"
#include "sim/geometry/mesh/tet_mesh.h"
#include "sim/step/world.h"

namespace duet::tools {
namespace {

// Error of the volume of an incompressible body that is told: steps keep it to fractions of a percent.
constexpr double told_error = 0.02;
// Share of its volume to which a body may be squeezed without a word.
constexpr double told_share = 0.1;

// Returns the share of a volume in percent.
std::string percent(double share) {
  return share < 1e-3 ? "less than 0.1 %" : fmt::format("{:.2g} %", 100 * share);
}

// What the elements of a body amount to.
struct Amount {
  double volume = 0;  // m^3, with the sign of the elements
  double rest = 0;    // m^3, at rest
  int elements = 0;
  int inverted = 0;
};

// Returns the amounts of the deformable bodies in their order.
std::vector<Amount> amounts(const Bodies& bodies) {
  std::vector<Amount> found(bodies.deformable.size());
  const FiniteElements& elements = bodies.forces.elements;
  for (std::size_t i = 0; i < elements.tets().size(); ++i) {
    const Tet& tet = elements.tets()[i];
    const auto x = [&](std::size_t corner) -> const Vec3& {
      return bodies.particles.x[as_index(tet[corner])];
    };
    const double volume = tet_volume(x(0), x(1), x(2), x(3));
    Amount& amount = found[body_of(bodies, tet[0])];
    amount.volume += volume;
    amount.rest += elements.volume(i);
    ++amount.elements;
    if (volume <= 0) ++amount.inverted;
  }
  return found;
}

}  // namespace

bool VolumeNotes::State::take(double value, std::size_t index, const DeformableBody& deformable,
                              int at_frame) {
  const bool is_first = body.empty();
  if (reached.size() <= index) reached.resize(index + 1);
  reached[index] = true;
  if (value > worst) {
    worst = value;
    body = deformable.name;
    frame = at_frame;
  }
  return is_first;
}

std::string VolumeNotes::State::bodies() const {
  const auto count = std::count(reached.begin(), reached.end(), true);
  return fmt::format("`{}`", body) + (count < 2 ? std::string() : fmt::format(" (and {} more)", count - 1));
}

std::vector<std::string> VolumeNotes::look(const Simulation& simulation, const scene::Scene& scene,
                                           const FrameStats& stats) {
  std::vector<std::string> notes;
  if (stats.frame == 0 ||
      (stats.volume_error <= told_error && stats.min_det_F >= told_share && stats.inverted == 0))
    return notes;
  const Bodies& bodies = simulation.world().bodies;
  const std::vector<Amount> now = amounts(bodies);
  const std::string when = fmt::format("at {:.4g} s (frame {})", stats.time, stats.frame);
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (now[i].elements == 0) continue;
    const DeformableBody& body = bodies.deformable[i];
    const bool is_incompressible = scene.deformable[i].incompressible;
    const double share = now[i].volume / now[i].rest, error = std::abs(share - 1);
    if (is_incompressible && error > told_error && error_.take(error, i, body, stats.frame))
      notes.push_back(fmt::format(
          "`{}` is incompressible, but its volume is {:.2g} % off {}: the load is too heavy for the solver. "
          "{} "
          "keeps it better",
          body.name, 100 * error, when,
          scene.solver.integration == scene::Integration::implicit ? "solver.integration = \"semi_implicit\""
                                                                   : "A smaller solver.max_time_step"));
    if (!is_incompressible && share < told_share && squeezed_.take(1 - share, i, body, stats.frame))
      notes.push_back(
          fmt::format("`{}` is squeezed to {} of its volume {}: other bodies leave it no room. Give "
                      "prescribed motions room, or the material more stiffness",
                      body.name, percent(share), when));
    if (now[i].inverted > 0 && inverted_.take(now[i].inverted, i, body, stats.frame))
      notes.push_back(
          fmt::format("{} of `{}` {} inverted {}: the load deforms the body further than its elements can "
                      "follow. A stiffer or damped material, smaller elements or lighter loads avoid that",
                      counted(static_cast<std::size_t>(now[i].inverted), "element"), body.name,
                      now[i].inverted == 1 ? "is" : "are", when));
  }
  return notes;
}

std::string VolumeNotes::outcome() const {
  std::string text;
  if (!error_.body.empty())
    text += fmt::format("; volume of {} up to {:.2g} % off (frame {})", error_.bodies(), 100 * error_.worst,
                        error_.frame);
  if (!squeezed_.body.empty())
    text += fmt::format("; {} squeezed to {} of the volume (frame {})", squeezed_.bodies(),
                        percent(1 - squeezed_.worst), squeezed_.frame);
  if (!inverted_.body.empty())
    text += fmt::format("; up to {} of {} inverted (frame {})",
                        counted(static_cast<std::size_t>(inverted_.worst), "element"), inverted_.bodies(),
                        inverted_.frame);
  return text;
}

}  // namespace duet::tools
