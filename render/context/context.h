// An OpenGL 3.3 core context without display, window or GPU. The libraries are opened at run time, so that a
// program that never draws starts without them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/context/backend.h"

namespace duet::render {

class Context {
 public:
  using Function = void (*)();

  virtual ~Context() = default;
  // Makes the context current in the calling thread. It has no drawable surface: draw into framebuffer
  // objects.
  virtual void make_current() = 0;
  // The OpenGL function called `name`, or null. The context must be current.
  virtual Function get_proc_address(const char* name) const = 0;
  virtual std::string name() const = 0;
};

// File names under which the run-time linker looks for the libraries, tried in order.
struct LibraryNames {
  std::vector<std::string> osmesa = {"libOSMesa.so.8", "libOSMesa.so.6"};
  std::vector<std::string> egl = {"libEGL.so.1"};
};

// A new context, current in the calling thread. Throws FileError that says what is missing and which package
// has it.
std::unique_ptr<Context> create_context(Backend backend, const LibraryNames& libraries = {});

// One back-end each; throw FileError.
std::unique_ptr<Context> create_osmesa_context(const std::vector<std::string>& libraries);
std::unique_ptr<Context> create_egl_context(const std::vector<std::string>& libraries);

// A shared library that stays loaded until the program ends: Mesa leaves threads and thread-local destructors
// behind, and code that they need must not be unmapped.
class SharedLibrary {
 public:
  // Opens the first of `names` that can be. Throws FileError; `package` is the Debian package to install.
  SharedLibrary(const std::vector<std::string>& names, const std::string& package);
  const std::string& file() const { return file_; }

  // Sets `function` to the exported symbol. Throws FileError when there is none.
  template <class F>
  void find(const char* symbol, F*& function) const {
    function = reinterpret_cast<F*>(address(symbol));
  }

 private:
  Context::Function address(const char* symbol) const;

  std::string file_, package_;
  void* handle_ = nullptr;
};

}  // namespace duet::render
