// Finds out whether this system has OSMesa, which Mesa dropped with version 25.1.
#pragma once

#include <algorithm>
#include <string>

#include <dlfcn.h>

#include "render/context/context.h"

namespace duet::test {

// Returns whether the run-time linker can open one of the files that the renderer looks for as OSMesa. A
// library that has been opened stays loaded.
inline bool has_osmesa() {
  return std::ranges::any_of(render::LibraryNames{}.osmesa, [](const std::string& name) {
    return dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL) != nullptr;
  });
}

}  // namespace duet::test
