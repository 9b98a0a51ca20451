// Checkpoints with a right checksum and wrong content. The input edits the saved state of a small scene with
// contacts, joints and deformable bodies: each edit has 2 bytes for its place, 1 for its kind and 8 for a
// value. A state that load_state() accepts must be one that can be simulated. If the first byte of the input
// is odd, the rest is a whole checkpoint file instead.
#include "sim/io/checkpoint.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <span>
#include <vector>

#include "tests/fuzz/harness.h"

#include "sim/base/parallel.h"
#include "sim/scene/plan.h"
#include "sim/scene/reader/reader.h"
#include "sim/simulation/simulation.h"

using namespace duet;

namespace {

// max_substeps ends the frames of states whose speeds ask for many steps.
const std::string scene_text = R"(
[ground]
[solver]
max_substeps = 40
[materials.jelly]
youngs_modulus = 3e4
[[rigid]]
name = "base"
shape = { box = [1, 0.2, 1] }
position = [0, 0.1, 0]
mass = 3
[[rigid]]
name = "door"
shape = { box = [0.2, 0.6, 1] }
position = [0.4, 0.5, 0]
mass = 1
[[rigid]]
name = "mover"
shape = { sphere = 0.2 }
position = [-2, 0.3, 0]
motion = { sinusoid = [{ amplitude = [0.1, 0, 0], frequency = 1 }] }
[[rigid]]
name = "ball"
shape = { sphere = 0.2 }
position = [-0.2, 0.399, 0]
mass = 1
[[joints]]
name = "hinge"
type = "hinge"
parent = "base"
child = "door"
position = [0.4, 0.2, 0]
axis = [0, 0, 1]
control = {}
[[deformable]]
name = "block"
shape = { box = [0.4, 0.4, 0.4], cells = [1, 1, 1] }
position = [2, 0.2, 0]
material = "jelly"
incompressible = true
[[deformable]]
name = "cloth"
shape = { panel = { size = [0.5, 0.5], cells = [2, 2] } }
thickness = 0.01
position = [2, 0.45, 0]
material = "jelly"
)";

struct Subject {
  scene::Scene scene = scene::read_text(scene_text, "checkpoint.toml").scene;
  Simulation simulation{scene, scene::plan_effects(scene).active()};
  std::vector<unsigned char> state;

  Subject() {
    for (int frame = 0; frame < 3; ++frame) simulation.advance_frame();
    state = simulation.save_state();
  }
};

// Changes the state by edits of 11 bytes each.
void apply_edits(std::span<const std::uint8_t> input, std::vector<unsigned char>& state) {
  constexpr std::size_t edit = 11;
  for (; input.size() >= edit; input = input.subspan(edit)) {
    if (state.empty()) return;
    const std::size_t place = static_cast<std::size_t>(input[0] | input[1] << 8) % state.size();
    const std::size_t number = std::min<std::size_t>(place / 8 * 8, state.size() / 8 * 8);
    const auto* value = input.data() + 3;
    const auto put = [&](std::size_t at, std::size_t size) {
      std::memcpy(state.data() + at, value, std::min(size, state.size() - at));
    };
    switch (input[2] % 6) {
      case 0:
        put(number, 8);
        break;
      case 1:
        put(number, 4);
        break;
      case 2:
        state[place] ^= static_cast<unsigned char>(1U << (*value % 8));
        break;
      case 3:
        state.resize(place);
        break;
      case 4:  // a further contact, equal to the bytes before
        state.insert(state.end(),
                     state.end() - static_cast<std::ptrdiff_t>(std::min<std::size_t>(place, state.size())),
                     state.end());
        break;
      default:
        put(number + 4, 4);
    }
  }
}

// Throws nothing if the state is finite, and ends the program if it is not.
void require_finite(const Simulation& simulation) {
  std::vector<BodySurface> surfaces;
  simulation.surfaces(surfaces);
  for (const BodySurface& body : surfaces)
    for (const Vec3& position : body.surface.positions)
      if (!position.allFinite())
        fuzz::report_finding("`" + body.name + "` has a position that is not finite");
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  set_thread_count(1);
  static Subject subject;
  if (size > 0 && data[0] % 2 == 1) {
    const io::RunDirectory run{fuzz::memory_folder(), {}};
    fuzz::write_file("checkpoint/0001.bin", fuzz::text_of(data + 1, size - 1));
    fuzz::is_accepted([&] { static_cast<void>(io::find_checkpoint(run, 0)); });
    return 0;
  }
  std::vector<unsigned char> state = subject.state;
  if (size > 0) apply_edits({data + 1, size - 1}, state);
  subject.simulation.load_state(subject.state);
  if (!fuzz::is_accepted([&] { subject.simulation.load_state(state); })) {
    // What does not fit leaves the state as it was.
    if (subject.simulation.save_state() != subject.state)
      fuzz::report_finding("a state that was refused has changed the simulation");
    return 0;
  }
  fuzz::is_accepted([&] {
    subject.simulation.advance_frame();
    require_finite(subject.simulation);
  });
  return 0;
}
