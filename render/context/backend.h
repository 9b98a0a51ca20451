// Which off-screen OpenGL library draws.
#pragma once

namespace duet::render {

// automatic tries OSMesa, then EGL surfaceless. Both draw the same bits with the same Mesa.
enum class Backend { automatic, osmesa, egl };

}  // namespace duet::render
