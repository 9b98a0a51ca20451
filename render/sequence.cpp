#include "render/sequence.h"

#include <filesystem>

#include <fmt/format.h>

#include "render/context/context.h"
#include "render/default_view.h"
#include "render/scene_renderer.h"
#include "render/strain_legend.h"
#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/io/values_file.h"

namespace duet::render {
namespace {

constexpr const char* mixed_runs =
    "the folder mixes two runs: simulate the scene anew, or give --out another folder";

// Returns what colors show, in words.
const char* name_of(scene::ColorBy color) {
  return color == scene::ColorBy::strain   ? "strain"
         : color == scene::ColorBy::stress ? "stress"
                                           : "pressure of contact";
}

// Returns how the bodies differ from the manifest, in words; empty if they do not.
std::string difference(const std::vector<io::ManifestBody>& expected,
                       const std::vector<BodySurface>& bodies) {
  if (bodies.size() != expected.size())
    return fmt::format("holds {} bodies, the manifest {}", bodies.size(), expected.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    const Surface& surface = bodies[i].surface;
    if (bodies[i].name != expected[i].name)
      return fmt::format("body {} is called `{}`, in the manifest `{}`", i, bodies[i].name, expected[i].name);
    if (surface.positions.size() != static_cast<std::size_t>(expected[i].vertices) ||
        surface.triangles.size() != static_cast<std::size_t>(expected[i].triangles))
      return fmt::format("body `{}` has {} vertices and {} triangles, in the manifest {} and {}",
                         bodies[i].name, surface.positions.size(), surface.triangles.size(),
                         expected[i].vertices, expected[i].triangles);
  }
  return {};
}

}  // namespace

struct SequenceRenderer::Impl {
  Impl(const scene::Scene& scene, const io::Manifest& manifest, Backend backend)
      : bodies(manifest.bodies),
        looks(assign_looks(scene, manifest)),
        render(scene.render),
        fps(scene.fps),
        context(create_context(backend)),
        gl(load_gl(*context)),
        renderer(gl, with_default_view(scene, manifest), looks) {
    for (const io::ManifestBody& body : bodies) looks_of_bodies.push_back(looks.of_body.at(body.name));
  }
  // The members are destroyed after this, the renderer's OpenGL objects before the context.
  ~Impl() { context->make_current(); }

  const std::vector<io::ManifestBody> bodies;
  const LookTable looks;
  const scene::Render render;
  const double fps;
  std::vector<int> looks_of_bodies;
  std::unique_ptr<Context> context;
  const Gl gl;
  SceneRenderer renderer;
};

SequenceRenderer::SequenceRenderer(const scene::Scene& scene, const io::Manifest& manifest, Backend backend)
    : impl_(std::make_unique<Impl>(scene, manifest, backend)) {}
SequenceRenderer::~SequenceRenderer() = default;

std::vector<unsigned char> SequenceRenderer::draw(const std::vector<BodySurface>& bodies, double time) {
  const std::string problem = difference(impl_->bodies, bodies);
  if (!problem.empty()) throw FileError("frame", problem, mixed_runs);
  const bool is_strain = impl_->render.color == scene::ColorBy::strain;
  for (std::size_t i = 0; i < bodies.size(); ++i) {
    if (impl_->looks_of_bodies[i] != impl_->looks.of_values) continue;
    const Surface& surface = bodies[i].surface;
    if ((is_strain ? surface.strain : surface.shown).empty())
      throw FileError("frame",
                      fmt::format("holds no {} of body `{}`", name_of(impl_->render.color), bodies[i].name),
                      "the run is from an earlier version: simulate it anew, or leave out render.color");
  }
  impl_->context->make_current();
  std::vector<unsigned char> picture = impl_->renderer.draw(bodies, impl_->looks_of_bodies, time);
  if (impl_->looks.of_values >= 0)
    draw_legend(picture, impl_->render.width, impl_->render.height,
                is_strain ? InvertedSquare::present : InvertedSquare::absent);
  return picture;
}

void SequenceRenderer::render_frame(const io::RunDirectory& run, int frame, const io::RunDirectory& to) {
  std::vector<BodySurface> bodies = io::read_mesh(run, frame);
  const std::string problem = difference(impl_->bodies, bodies);
  if (!problem.empty()) throw FileError(run.mesh(frame).string(), problem, mixed_runs);
  // Frames of earlier versions hold the strain in the mesh, and have no file of values.
  if (impl_->looks.of_values >= 0 && std::filesystem::exists(run.values(frame)))
    take_color(io::read_values(run, impl_->bodies, frame), impl_->bodies, impl_->render.color, bodies);
  const std::filesystem::path image = to.image(frame);
  io::create_folder(image.parent_path());
  to.write(image, png_bytes(image.string(), impl_->render.width, impl_->render.height,
                            draw(bodies, frame / impl_->fps)));
}

}  // namespace duet::render
