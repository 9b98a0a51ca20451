#include "render/context/context.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/base/error.h"

namespace duet::render {

SharedLibrary::SharedLibrary(const std::vector<std::string>& names, const std::string& package)
    : package_(package) {
  for (const std::string& name : names) {
    handle_ = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL);
    if (handle_) {
      file_ = name;
      return;
    }
  }
  const char* reason = dlerror();
  throw FileError(
      fmt::format("{}", fmt::join(names, " or ")),
      fmt::format("the off-screen OpenGL library cannot be loaded: {}", reason ? reason : "no name given"),
      fmt::format("install it: apt install {}", package));
}

Context::Function SharedLibrary::address(const char* symbol) const {
  void* found = dlsym(handle_, symbol);
  if (!found)
    throw FileError(file_, fmt::format("the library lacks the function {}", symbol),
                    fmt::format("install a current one: apt install {}", package_));
  return reinterpret_cast<Context::Function>(found);
}

std::unique_ptr<Context> create_context(Backend backend, const LibraryNames& libraries) {
  if (backend == Backend::osmesa) return create_osmesa_context(libraries.osmesa);
  if (backend == Backend::egl) return create_egl_context(libraries.egl);
  std::string osmesa_problem;
  try {
    return create_osmesa_context(libraries.osmesa);
  } catch (const FileError& error) {
    osmesa_problem = error.what();
  }
  try {
    return create_egl_context(libraries.egl);
  } catch (const FileError& error) {
    throw FileError(
        "off-screen rendering",
        fmt::format("no OpenGL library can be used. OSMesa: {}. EGL: {}", osmesa_problem, error.what()),
        "one of them is enough: apt install libegl1 libgl1-mesa-dri, or, up to Debian 13, apt install "
        "libosmesa6");
  }
}

}  // namespace duet::render
