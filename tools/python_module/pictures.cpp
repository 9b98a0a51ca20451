// Pictures for Python: drawing frames of simulations and runs, and differences of pictures.
#include <algorithm>
#include <iterator>
#include <string_view>
#include <thread>

#include "bindings.h"
#include "frame.h"
#include <pybind11/stl.h>

#include "render/compare.h"
#include "render/sequence.h"
#include "sim/base/error.h"
#include "sim/io/run_directory.h"
#include "sim/io/values_file.h"

namespace duet::python {
namespace {

using Bytes = py::array_t<unsigned char, py::array::c_style>;

// Draws frames of one scene. The context of OpenGL belongs to the thread that made it.
class Renderer {
 public:
  Renderer(const scene::Scene& scene, const io::Manifest& manifest)
      : size_(scene.render), thread_(std::this_thread::get_id()) {
    const py::gil_scoped_release unlocked;
    renderer_ = std::make_unique<render::SequenceRenderer>(scene, manifest);
  }

  // Draws a frame of a simulation, with the quantity that render.color asks for.
  Bytes draw(const FrameData& frame) {
    if (size_.color != scene::ColorBy::stress && size_.color != scene::ColorBy::contact)
      return draw(frame.surfaces, frame.stats.time);
    const char* wanted = size_.color == scene::ColorBy::stress ? "stress" : "contact_pressure";
    const auto* kind = std::find_if(std::begin(io::point_values), std::end(io::point_values),
                                    [&](const auto& one) { return std::string_view(one.name) == wanted; });
    const std::vector<float>& values =
        frame.point_values[static_cast<std::size_t>(kind - std::begin(io::point_values))];
    std::vector<BodySurface> surfaces = frame.surfaces;
    for (std::size_t i = frame.topology->rigid; i < surfaces.size(); ++i) {
      const Rows rows = frame.topology->bodies[i].points;
      const auto first = values.begin() + static_cast<std::ptrdiff_t>(rows.begin);
      surfaces[i].surface.shown.assign(first, first + static_cast<std::ptrdiff_t>(rows.count));
    }
    return draw(surfaces, frame.stats.time);
  }
  Bytes draw(const std::vector<BodySurface>& bodies, double time) {
    if (std::this_thread::get_id() != thread_)
      throw std::runtime_error("a renderer draws in the thread that made it alone");
    std::vector<unsigned char> rgb;
    {
      const py::gil_scoped_release unlocked;
      rgb = renderer_->draw(bodies, time);
    }
    auto* held = new std::vector<unsigned char>(std::move(rgb));
    const py::capsule owner(held, [](void* p) { delete static_cast<std::vector<unsigned char>*>(p); });
    return Bytes({size_.height, size_.width, 3}, held->data(), owner);
  }

 private:
  scene::Render size_;
  std::thread::id thread_;
  std::unique_ptr<render::SequenceRenderer> renderer_;
};

// A run directory with a renderer for it.
class RunRenderer {
 public:
  RunRenderer(const std::string& root, const std::vector<std::string>& overrides)
      : run_(io::open_run(root)), manifest_(io::read_manifest(run_)) {
    run_.require_whole(run_.scene());
    scene_ = scene::read(run_.scene().string(), overrides, scene::Meshes::leave).scene;
    renderer_ = std::make_unique<Renderer>(scene_, manifest_);
  }
  Bytes draw(int frame) {
    std::vector<BodySurface> bodies;
    {
      const py::gil_scoped_release unlocked;
      bodies = io::read_mesh(run_, frame);
      if (scene_.render.color != scene::ColorBy::look)
        io::take_color(io::read_values(run_, manifest_.bodies, frame), manifest_.bodies, scene_.render.color,
                       bodies);
    }
    return renderer_->draw(bodies, frame / manifest_.fps);
  }

 private:
  io::RunDirectory run_;
  io::Manifest manifest_;
  scene::Scene scene_;
  std::unique_ptr<Renderer> renderer_;
};

std::unique_ptr<Renderer> renderer_of(const scene::ReadResult& read, const FrameData& frame) {
  io::Manifest manifest;
  manifest.fps = read.scene.fps;
  manifest.frames = read.scene.frames;
  manifest.bodies = frame.topology->listed;
  return std::make_unique<Renderer>(read.scene, manifest);
}

render::Picture picture_of(const Bytes& array) {
  if (array.ndim() != 3 || array.shape(2) != 3)
    throw Error(ExitStatus::usage, "a picture is an array of bytes of the shape (height, width, 3)");
  render::Picture picture;
  picture.width = static_cast<int>(array.shape(1));
  picture.height = static_cast<int>(array.shape(0));
  picture.rgb.assign(array.data(), array.data() + array.size());
  return picture;
}

py::dict difference(const Bytes& a, const Bytes& b, int tolerance) {
  const render::Picture first = picture_of(a), second = picture_of(b);
  render::Difference d;
  {
    const py::gil_scoped_release unlocked;
    d = render::compare(first, second, tolerance);
  }
  render::DifferenceBounds bounds;
  bounds.tolerance = tolerance;
  return py::dict(py::arg("same") = render::broken_bounds(d, bounds).empty(), py::arg("maximum") = d.maximum,
                  py::arg("mean") = d.mean, py::arg("rmse") = d.rmse, py::arg("share") = d.share,
                  py::arg("largest_patch") = d.max_patch, py::arg("ssim") = d.ssim);
}

}  // namespace

void bind_pictures(py::module_& module) {
  py::class_<Renderer>(module, "Renderer")
      .def(py::init(&renderer_of))
      .def("draw", [](Renderer& r, const FrameData& frame) { return r.draw(frame); });
  py::class_<RunRenderer>(module, "RunRenderer")
      .def(py::init<const std::string&, const std::vector<std::string>&>())
      .def("draw", &RunRenderer::draw);
  module.def("difference", &difference, py::arg("a"), py::arg("b"), py::arg("tolerance"));
}

}  // namespace duet::python
