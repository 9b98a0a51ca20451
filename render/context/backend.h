// The choice of an off-screen OpenGL library.
#pragma once

namespace duet::render {

/// The off-screen OpenGL libraries. Both draw equal bits with the same version of Mesa.
enum class Backend {
  automatic,  ///< OSMesa if it gives a context, else EGL
  osmesa,     ///< OSMesa, which Mesa dropped with version 25.1
  egl         ///< EGL on Mesa's surfaceless platform
};

}  // namespace duet::render
