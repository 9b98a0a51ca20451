// Simulations for Python. The lock of the interpreter is released while a simulation is built or steps, and
// an interrupt (Ctrl-C) ends the step at hand.
#include <atomic>
#include <csignal>
#include <optional>

#include "bindings.h"
#include "frame.h"
#include <pthread.h>
#include <pybind11/stl.h>
#include <unistd.h>

#include "sim/base/error.h"
#include "sim/base/numerics.h"
#include "sim/base/parallel.h"
#include "sim/base/stop.h"
#include "sim/scene/plan.h"

namespace duet::python {
namespace {

std::atomic<bool> interrupted{false};  // set by an interrupt during a step
struct sigaction handler_of_python;    // what Python does about an interrupt
std::atomic<int> stepping{0};          // number of simulations that are built or step now

void note_interrupt(int signal, siginfo_t* info, void* context) {
  interrupted = true;
  if (handler_of_python.sa_flags & SA_SIGINFO)
    handler_of_python.sa_sigaction(signal, info, context);
  else
    handler_of_python.sa_handler(signal);
}

// Returns whether this is the main thread of the program, which is the one that Python interrupts.
bool is_main_thread() { return ::getpid() == ::gettid(); }

// Notes interrupts while the main thread works outside of the interpreter. Python's own handler is called as
// well; it raises KeyboardInterrupt once the interpreter runs again. Other threads leave interrupts alone.
class InterruptScope {
 public:
  InterruptScope() {
    ++stepping;
    if (!is_main_thread()) return;
    interrupted = false;
    ::sigaction(SIGINT, nullptr, &handler_of_python);
    if (!(handler_of_python.sa_flags & SA_SIGINFO) &&
        (handler_of_python.sa_handler == SIG_DFL || handler_of_python.sa_handler == SIG_IGN))
      return;
    struct sigaction noting = {};
    noting.sa_sigaction = note_interrupt;
    noting.sa_flags = SA_SIGINFO | SA_RESTART;
    sigemptyset(&noting.sa_mask);
    is_set_ = ::sigaction(SIGINT, &noting, nullptr) == 0;
  }
  ~InterruptScope() {
    if (is_set_) ::sigaction(SIGINT, &handler_of_python, nullptr);
    --stepping;
  }
  InterruptScope(const InterruptScope&) = delete;
  InterruptScope& operator=(const InterruptScope&) = delete;
  // Returns the flag that an interrupt sets; null in threads that interrupts leave alone.
  const std::atomic<bool>* flag() const { return is_main_thread() ? &interrupted : nullptr; }

 private:
  bool is_set_ = false;
};

// Calls work() with the lock of the interpreter released. If an interrupt ends it with Stopped, raises what
// the handler of the interrupt raises (KeyboardInterrupt by default), or calls work() again if that is
// nothing.
template <class Work>
void run_unlocked(Work&& work) {
  for (;;) {
    const InterruptScope scope;
    try {
      const py::gil_scoped_release unlocked;
      const StopScope stop(scope.flag());
      work(scope.flag());
      return;
    } catch (const Stopped&) {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    }
  }
}

// A simulation with the scene that it was made of. One thread at a time may use it.
class SteeredSimulation {
 public:
  SteeredSimulation(const scene::ReadResult& read, const std::vector<std::string>& without)
      : scene_(read.scene) {
    const EffectSet plan = scene::plan_effects(scene_, without).active();
    run_unlocked([&](const std::atomic<bool>*) { simulation_.emplace(scene_, plan); });
    topology_ = topology_of(*simulation_, scene_, nullptr);
  }

  // Calls work(simulation), unlocked, unless another thread uses the simulation.
  template <class Work>
  void work(Work&& work) {
    if (is_busy_.exchange(true))
      throw std::runtime_error("another thread uses this simulation now: give each thread one of its own");
    struct Release {
      std::atomic<bool>& flag;
      ~Release() { flag = false; }
    } const release{is_busy_};
    run_unlocked([&](const std::atomic<bool>* flag) {
      simulation_->stop_when(flag);
      work(*simulation_);
    });
  }

  void advance() {
    work([](Simulation& simulation) { simulation.advance_frame(); });
  }
  std::shared_ptr<FrameData> frame() {
    std::shared_ptr<FrameData> captured;
    work([&](Simulation& simulation) { captured = capture(simulation, topology_); });
    return captured;
  }
  void release(const std::string& name, std::optional<double> density) {
    work([&](Simulation& simulation) {
      simulation.release(name, density);
      topology_ = topology_of(simulation, scene_, topology_.get());
    });
  }
  const scene::Scene& scene() const { return scene_; }

 private:
  scene::Scene scene_;
  std::optional<Simulation> simulation_;
  std::shared_ptr<const Topology> topology_;
  std::atomic<bool> is_busy_{false};
};

Quat quaternion_of(const Doubles& numbers) {
  if (numbers.size() != 4)
    throw Error(ExitStatus::usage, "an orientation has 4 numbers: w, x, y, z of a unit quaternion");
  const double* q = numbers.data();
  return Quat(q[0], q[1], q[2], q[3]);
}

}  // namespace

void bind_simulation(py::module_& module) {
  using Sim = SteeredSimulation;
  module.attr("numerics_version") = numerics_version;
  module.def("thread_count", &thread_count);
  module.def("set_thread_count", [](int count) {
    if (stepping > 0)
      throw std::runtime_error(
          "the number of threads cannot change while a simulation steps in another thread");
    set_thread_count(count);
  });
  module.def("forget_threads", &forget_threads);
  py::class_<Sim>(module, "Simulation")
      .def(py::init<const scene::ReadResult&, const std::vector<std::string>&>())
      .def_property_readonly("number",
                             [](Sim& s) {
                               int number = 0;
                               s.work([&](Simulation& simulation) { number = simulation.frame(); });
                               return number;
                             })
      .def("advance", &Sim::advance)
      .def("frame", &Sim::frame)
      .def("aim_joint",
           [](Sim& s, const std::string& name, const Doubles& value) {
             const Vec3 target =
                 value.size() == 1 ? Vec3(value.data()[0], 0, 0) : vector_of(value, "the target of a joint");
             s.work([&](Simulation& simulation) { simulation.set_target(name, target); });
           })
      .def("aim_body",
           [](Sim& s, const std::string& name, const Doubles& position, const Doubles& orientation) {
             Pose pose;
             pose.position = vector_of(position, "a position");
             pose.orientation = quaternion_of(orientation);
             s.work([&](Simulation& simulation) { simulation.set_target(name, pose); });
           })
      .def("add_force",
           [](Sim& s, const std::string& name, const Doubles& force, const Doubles& moment,
              const std::optional<Doubles>& at) {
             const Vec3 f = vector_of(force, "a force"), m = vector_of(moment, "a moment");
             std::optional<Vec3> point;
             if (at) point = vector_of(*at, "the point of a force");
             s.work([&](Simulation& simulation) { simulation.add_force(name, f, m, point); });
           })
      .def("release", &Sim::release)
      .def("save_state",
           [](Sim& s) {
             std::vector<unsigned char> bytes;
             s.work([&](Simulation& simulation) { bytes = simulation.save_state(); });
             return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
           })
      .def("load_state", [](Sim& s, const py::bytes& state) {
        const auto text = static_cast<std::string_view>(state);
        const std::vector<unsigned char> bytes(text.begin(), text.end());
        s.work([&](Simulation& simulation) { simulation.load_state(bytes); });
      });
}

}  // namespace duet::python
