// Bodies that roll, slide and rock in the hole of a ring, and rings on hooks: curves that are hollow. A body
// turns its direction there by the impulses of contact alone, so that these must act as much at the beginning
// of a step as at its end. Rigid bodies of all round shapes, boxes, particles and ropes keep their energy.
#include <cmath>

#include "tests/support/full.h"
#include "tests/support/margin.h"
#include "tests/support/scenes.h"
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "sim/scene/reader/reader.h"

namespace duet::everyday_hollows_test {
namespace {

constexpr double gravity = 9.8, hole = 0.7;  // m/s^2; m, radius of the hole

// A body in the hole: its table in the scene without place and velocity, its friction, and the distance of
// its center from the curve (m).
struct Guest {
  std::string name, table;
  double friction = 0, height = 0.1;
  bool is_round = false;  // rolls if it has friction
};

std::vector<Guest> guests() {
  const std::string rigid = "[[rigid]]\nname = \"guest\"\ndensity = 1000\n";
  std::vector<Guest> all;
  for (const double friction : {0.0, 1.0}) {
    all.push_back({"ball", rigid + "shape = { sphere = 0.1 }\n", friction, 0.1, true});
    all.push_back(
        {"can", rigid + "shape = { cylinder = { radius = 0.1, height = 0.1 } }\n", friction, 0.1, true});
    all.push_back(
        {"rod", rigid + "shape = { capsule = { radius = 0.1, length = 0.2 } }\n", friction, 0.1, true});
  }
  // The edges below touch, and the middle of the face is farther from the curve.
  const double half = 0.05, middle = std::sqrt(hole * hole - half * half) - half;
  all.push_back({"box", rigid + "shape = { box = [0.1, 0.1, 0.1] }\n", 0, hole - middle});
  all.push_back({"particle",
                 "[materials.m]\n[[deformable]]\nname = \"guest\"\nshape = { particle = 0.05 }\nmaterial = "
                 "\"m\"\nmass = 0.1\n",
                 0, 0.05});
  return all;
}

// Returns a scene with a static ring about the z axis, whose tube has the radius `tube` (m), and with `guest`
// in its hole, `degrees` from the lowest place. It moves along the curve with `speed` (m/s). Round bodies
// turn about z, and roll if they have friction.
scene::Scene in_hole(const Guest& guest, double tube, double degrees, double speed, double pull,
                     double step) {
  const double angle = degrees * double{EIGEN_PI} / 180, distance = hole - guest.height;
  std::string text = fmt::format(
      "title = \"hollow\"\nframes = 1\nfps = 20\ngravity = [0, {}, 0]\n[solver]\nmax_time_step = {}\n"
      "[[rigid]]\nname = \"ring\"\nshape = {{ torus = {{ radius = {}, tube = {} }} }}\n"
      "rotation = {{ axis = [1, 0, 0], degrees = 90 }}\nstatic = true\nfriction = {}\nrestitution = 0.5\n",
      -pull, step, hole + tube, tube, guest.friction);
  text += guest.table;
  text += fmt::format("position = [{}, {}, 0]\nvelocity = [{}, {}, 0]\n", distance * std::sin(angle),
                      -distance * std::cos(angle), speed * std::cos(angle), speed * std::sin(angle));
  if (guest.is_round)
    text += fmt::format(
        "rotation = {{ axis = [1, 0, 0], degrees = 90 }}\nfriction = {}\nangular_velocity = [0, 0, {}]\n",
        guest.friction, guest.friction > 0 ? -speed / guest.height : 0);
  if (guest.name == "box")
    text += fmt::format(
        "rotation = {{ axis = [0, 0, 1], degrees = {} }}\nfriction = 0\nangular_velocity = [0, 0, {}]\n",
        degrees, speed / distance);
  return scene::read_text(text, "hollow.toml").scene;
}

// Returns the greatest difference of the energy from that of the first frame, J, over `frames` frames.
double change_of_energy(const scene::Scene& scene, int frames) {
  Simulation simulation(scene, test::plan(scene));
  const auto energy = [&] {
    const FrameStats stats = simulation.stats();
    return stats.kinetic + stats.potential + stats.elastic;
  };
  const double first = energy();
  double change = 0;
  for (int frame = 0; frame < frames; ++frame) {
    simulation.advance_frame();
    change = std::max(change, std::abs(energy() - first));
  }
  return change;
}

// Returns the mass of the body that moves, kg.
double moving_mass(const scene::Scene& scene) {
  const Simulation simulation(scene, test::plan(scene));
  const Bodies& bodies = simulation.world().bodies;
  double mass = 0;
  for (const double m : bodies.particles.mass) mass += m;
  for (const RigidProperties& body : bodies.rigid.properties)
    if (body.is_dynamic()) mass += 1 / body.inverse_mass;
  return mass;
}

}  // namespace

// Without gravity a body goes round for ever, and in a step it loses less than the square of the angle by
// which it turns. A box touches with two edges, whose contacts pass from arc to arc of the ring.
TEST(EverydayHollows, BodiesGoRoundWithoutChangeOfSpeed) {
  constexpr double of_box = 1e-3;
  double worst = 0;
  for (const Guest& guest : guests())
    for (const double tube : {0.3, 2.0})
      for (const double speed : {1.0, 4.0})
        for (const double step : {0.01, 0.002}) {
          const scene::Scene scene = in_hole(guest, tube, 0, speed, 0, step);
          const double turn = speed * step / (hole - guest.height);
          const double change = change_of_energy(scene, 20) / (0.5 * moving_mass(scene) * speed * speed);
          const double bound = turn * turn + (guest.name == "box" ? of_box : 0);
          EXPECT_LT(change, bound) << guest.name << " friction " << guest.friction << " tube " << tube
                                   << " speed " << speed << " step " << step;
          worst = std::max(worst, change / bound);
        }
  test::record_margin("change of energy over its bound", worst, "below 1");
}

// Released at 57 degrees, a body rocks. In a period it keeps its energy to a fraction that falls with the
// step.
TEST(EverydayHollows, BodiesRockWithoutLosingEnergy) {
  double worst = 0;
  for (const Guest& guest : guests())
    for (const double tube : {0.3, 2.0})
      for (const double step : {0.01, 0.0025}) {
        const scene::Scene scene = in_hole(guest, tube, 57.3, 0, gravity, step);
        const double height = (hole - guest.height) * (1 - std::cos(1.0));
        const double change = change_of_energy(scene, 40) / (moving_mass(scene) * gravity * height);
        EXPECT_LT(change, 0.5 * step)
            << guest.name << " friction " << guest.friction << " tube " << tube << " step " << step;
        worst = std::max(worst, change / step);
      }
  test::record_margin("change of energy in 2 s over the step (1/s)", worst, "below 0.5");
}

}  // namespace duet::everyday_hollows_test
