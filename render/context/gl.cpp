#include "render/context/gl.h"

#include <fmt/format.h>

#include "sim/base/error.h"

namespace duet::render {
namespace {

template <class F>
void load(const Context& context, const char* name, F& function) {
  function = reinterpret_cast<F>(context.get_proc_address(name));
  if (!function)
    throw FileError(context.name(), fmt::format("the OpenGL library lacks {}", name),
                    "OpenGL 3.3 is needed: install a current Mesa (apt install libgl1-mesa-dri)");
}

}  // namespace

Gl load_gl(const Context& context) {
  Gl gl;
#define DUET_GL_LOAD(name, NAME) load(context, "gl" #name, gl.name);
  DUET_GL_FUNCTIONS(DUET_GL_LOAD)
#undef DUET_GL_LOAD
  return gl;
}

}  // namespace duet::render
