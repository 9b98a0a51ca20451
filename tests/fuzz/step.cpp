// A fuzzer of the step: bytes become a whole scene of a few bodies (shapes, motions, joints, materials, keys
// of the solver), which is read as a scene file and simulated for three frames. Scenes may be refused, and
// simulations may stop with an error; no number may stop being finite.
//
// With the environment variable DUET_FUZZ_SCENE=FILE the scene of the input is written to FILE:
//     DUET_FUZZ_SCENE=finding.toml build-fuzz/fuzz_step build-fuzz/findings/step/crash-...
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <initializer_list>
#include <string_view>
#include <vector>

#include "tests/fuzz/harness.h"
#include <fmt/format.h>

#include "sim/base/parallel.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

using namespace duet;

namespace {

constexpr int frames = 3;

// Turns the bytes of the input into choices. After the last byte, all of them are 0.
class Choices {
 public:
  Choices(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}

  // Returns a whole number from 0 to `count` - 1.
  int below(int count) { return size_ == 0 ? 0 : byte() % count; }
  bool yes() { return below(2) == 1; }
  std::string word(std::initializer_list<std::string_view> words) {
    return std::string(*(words.begin() + below(static_cast<int>(words.size()))));
  }
  // Returns a number from `least` to `most`.
  double number(double least, double most) { return least + (most - least) * fraction(); }
  // Returns a positive number from `least` to `most`, each power of ten as likely as the others.
  double power(double least, double most) { return std::exp(number(std::log(least), std::log(most))); }
  std::string vector(double least, double most) {
    const double x = number(least, most), y = number(least, most), z = number(least, most);
    return fmt::format("[{}, {}, {}]", x, y, z);
  }

 private:
  int byte() {
    if (size_ == 0) return 0;
    --size_;
    return *data_++;
  }
  double fraction() {
    const int high = byte();
    return (high * 256 + byte()) / 65535.0;
  }

  const std::uint8_t* data_;
  std::size_t size_;
};

// Returns a closed shape of about the size of 1 m. `cells` belongs to soft boxes alone.
std::string shape(Choices& choose, bool soft) {
  const double a = choose.power(0.05, 1), b = choose.power(0.05, 1);
  switch (choose.below(5)) {
    case 0:
      return fmt::format("{{ sphere = {} }}", a);
    case 1:
      return fmt::format("{{ capsule = {{ radius = {}, length = {} }} }}", a, b);
    case 2:
      return fmt::format("{{ cylinder = {{ radius = {}, height = {} }} }}", a, b);
    case 3:
      return fmt::format("{{ torus = {{ radius = {}, tube = {} }} }}", a, a * choose.number(0.2, 0.6));
    default:
      return fmt::format("{{ box = [{}, {}, {}]{} }}", a, b, choose.power(0.05, 1),
                         soft ? ", cells = [2, 2, 2]" : "");
  }
}

// Returns a shape of a deformable body with few elements.
std::string soft_shape(Choices& choose, bool& is_thin) {
  is_thin = choose.below(3) == 0;
  if (!is_thin) {
    if (choose.below(4) == 0) return shape(choose, true);
    return fmt::format("{{ box = [{}, {}, {}], cells = [{}, {}, {}], pattern = \"{}\" }}",
                       choose.power(0.1, 2), choose.power(0.1, 2), choose.power(0.1, 2), 1 + choose.below(3),
                       1 + choose.below(3), 1 + choose.below(3), choose.word({"five", "six", "bcc"}));
  }
  switch (choose.below(3)) {
    case 0:
      return fmt::format("{{ panel = {{ size = [{}, {}], cells = [{}, {}] }} }}", choose.power(0.2, 2),
                         choose.power(0.2, 2), 1 + choose.below(5), 1 + choose.below(5));
    case 1:
      return fmt::format("{{ disc = {{ radius = {}, rings = {} }} }}", choose.power(0.2, 1),
                         1 + choose.below(3));
    default:
      return fmt::format("{{ rod = {{ points = [{}, {}], segments = {} }} }}", choose.vector(-1, 1),
                         choose.vector(-1, 1), 3 + choose.below(6));
  }
}

// Returns where and how a body begins, near the others: overlaps are part of the game.
std::string placement(Choices& choose, int number, bool moves) {
  std::string text = fmt::format("position = [{}, {}, {}]\n", choose.number(-1, 1),
                                 0.2 + number * choose.number(0, 1), choose.number(-1, 1));
  if (choose.yes())
    text += fmt::format("rotation = {{ axis = [1, {}, 0.5], degrees = {} }}\n", choose.number(-1, 1),
                        choose.number(-180, 180));
  if (moves && choose.yes()) text += "velocity = " + choose.vector(-10, 10) + "\n";
  if (moves && choose.yes()) text += "angular_velocity = " + choose.vector(-20, 20) + "\n";
  return text;
}

std::string motion(Choices& choose) {
  switch (choose.below(3)) {
    case 0:
      return fmt::format("motion = {{ spin = [{{ axis = [0, {}, 1], rate = {} }}] }}\n", choose.number(-1, 1),
                         choose.number(-20, 20));
    case 1:
      return fmt::format("motion = {{ sinusoid = [{{ amplitude = {}, frequency = {} }}] }}\n",
                         choose.vector(-1, 1), choose.power(0.1, 20));
    default:
      return fmt::format(
          "motion = {{ keyframes = [{{ time = 0, position = {} }}, {{ time = {}, position = {} }}] }}\n",
          choose.vector(-1, 1), choose.power(0.001, 1), choose.vector(-1, 1));
  }
}

std::string rigid(Choices& choose, int number) {
  std::string text = fmt::format("[[rigid]]\nname = \"r{}\"\nshape = {}\n", number, shape(choose, false));
  const int kind = choose.below(6);
  text += placement(choose, number, kind > 1);
  if (kind == 0) return text + "static = true\n";
  if (kind == 1) return text + motion(choose);
  text += choose.yes() ? fmt::format("mass = {}\n", choose.power(1e-3, 1e5))
                       : fmt::format("density = {}\n", choose.power(1, 2e4));
  return text + fmt::format("friction = {}\nrestitution = {}\n", choose.number(0, 2), choose.number(0, 1));
}

std::string deformable(Choices& choose, int number, int rigid_count) {
  bool is_thin = false;
  const std::string body = soft_shape(choose, is_thin);
  std::string text = fmt::format("[[deformable]]\nname = \"d{}\"\nshape = {}\nmaterial = \"m{}\"\n", number,
                                 body, choose.below(2));
  text += placement(choose, number + rigid_count, true);
  if (is_thin) text += fmt::format("thickness = {}\n", choose.power(1e-3, 0.1));
  if (!is_thin && choose.below(3) == 0) text += "incompressible = true\n";
  if (choose.below(3) == 0) text += choose.yes() ? "self_collision = true\n" : "self_collision = false\n";
  if (!is_thin && rigid_count > 0 && choose.below(4) == 0)
    text += fmt::format("attach = [\"r{}\"]\n", choose.below(rigid_count));
  if (choose.below(4) == 0)
    text +=
        fmt::format("pins = [{{ from = {}, radius = {} }}]\n", choose.vector(-1, 1), choose.power(0.1, 1));
  return text;
}

std::string joint(Choices& choose, int number, int rigid_count) {
  const int child = choose.below(rigid_count), parent = choose.below(rigid_count + 1);
  std::string text = fmt::format(
      "[[joints]]\nname = \"j{}\"\ntype = \"{}\"\nparent = \"{}\"\nchild = \"r{}\"\nposition = {}\naxis = "
      "[1, {}, 0]\n",
      number, choose.word({"point", "hinge", "universal", "prismatic", "prismatic_twist", "weld"}),
      parent == rigid_count ? "ground" : fmt::format("r{}", parent), child, choose.vector(-1, 1),
      choose.number(-1, 1));
  if (choose.below(3) == 0)
    text += fmt::format("control = {{ gain = {}, target = {{ turn = {} }} }}\n", choose.power(1, 1e6),
                        choose.vector(-120, 120));
  return text;
}

std::string material(Choices& choose, int number) {
  return fmt::format(
      "[materials.m{}]\ndensity = {}\nyoungs_modulus = {}\npoisson_ratio = {}\ndamping = {}\nmodel = "
      "\"{}\"\n{}",
      number, choose.power(1, 2e4), choose.power(100, 1e9), choose.number(-0.5, 0.499), choose.power(1e-6, 1),
      choose.word({"neo_hookean", "corotated", "st_venant_kirchhoff"}),
      choose.below(4) == 0 ? fmt::format("springs = {{ stiffness = {} }}\n", choose.power(1, 1e5)) : "");
}

// Returns a scene file. 60 substeps a frame bound the time that it takes; a scene that needs more stops.
std::string scene_of(Choices& choose) {
  std::string text = fmt::format("gravity = {}\n[solver]\nmax_substeps = 60\n", choose.vector(-10, 10));
  text += fmt::format("integration = \"{}\"\n", choose.word({"semi_implicit", "implicit"}));
  text += fmt::format("accuracy = \"{}\"\n", choose.word({"standard", "draft", "fine"}));
  text += fmt::format("velocity_constraints = \"{}\"\n", choose.word({"after_solve", "before_solve"}));
  text += fmt::format("rigid_push_out = \"{}\"\n", choose.word({"all_contacts", "deepest_points"}));
  text += fmt::format("push_out_order = \"{}\"\n", choose.word({"together", "levels", "frozen_levels"}));
  text += fmt::format("shock_propagation = \"{}\"\n", choose.word({"auto", "on", "off"}));
  text += fmt::format("orientation = \"{}\"\n", choose.word({"exact", "first_order", "second_order"}));
  text += fmt::format("whole_islands = {}\nkeep_spin = {}\ncontact_reduction = {}\n", choose.yes(),
                      choose.yes(), choose.yes());
  if (choose.below(4) != 0)
    text +=
        fmt::format("[ground]\nfriction = {}\nrestitution = {}\n", choose.number(0, 2), choose.number(0, 1));
  text += material(choose, 0) + material(choose, 1);
  const int rigid_count = 1 + choose.below(4), soft_count = choose.below(3);
  for (int i = 0; i < rigid_count; ++i) text += rigid(choose, i);
  for (int i = 0; i < soft_count; ++i) text += deformable(choose, i, rigid_count);
  const int joint_count = choose.below(3);
  for (int i = 0; i < joint_count; ++i) text += joint(choose, i, rigid_count);
  return text;
}

// Ends the program with a finding if a number of the frame is not finite.
void require_finite(const Simulation& simulation) {
  const FrameStats stats = simulation.stats();
  for (const double value : {stats.kinetic, stats.potential, stats.elastic, stats.max_penetration,
                             stats.volume_error, stats.max_stretch, stats.momentum.sum()})
    if (!std::isfinite(value))
      fuzz::report_finding(fmt::format("a statistic of frame {} is {}", stats.frame, value));
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  for (const BodySurface& body : surfaces)
    for (const Vec3& position : body.surface.positions)
      if (!position.allFinite())
        fuzz::report_finding(fmt::format("`{}` is not finite in frame {}", body.name, stats.frame));
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  set_thread_count(1);
  Choices choose(data, size);
  const std::string text = scene_of(choose);
  if (const char* file = std::getenv("DUET_FUZZ_SCENE")) std::ofstream(file) << text;
  fuzz::is_accepted(
      [&] {
        const scene::Scene scene = scene::read_text(text, "step.toml").scene;
        Simulation simulation(scene, scene::plan_effects(scene).active());
        for (int frame = 0; frame < frames; ++frame) {
          simulation.advance_frame();
          require_finite(simulation);
        }
      },
      30);
  return 0;
}
