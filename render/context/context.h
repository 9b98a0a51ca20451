// OpenGL 3.3 core contexts without display, window or GPU. The libraries are opened at run time, so that a
// program that never draws starts without them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/context/backend.h"

namespace duet::render {

/// An off-screen OpenGL 3.3 core context.
class Context {
 public:
  /// Pointer to a function of OpenGL, to be cast to its type.
  using Function = void (*)();

  /// Destroys the context; objects of OpenGL in it must be gone.
  virtual ~Context() = default;
  /// Makes the context current in the calling thread. It has no drawable surface: draw into framebuffer
  /// objects. Throws FileError.
  virtual void make_current() = 0;
  /// Returns the OpenGL function called `name`, or null if there is none. The context must be current.
  virtual Function get_proc_address(const char* name) const = 0;
  /// Returns the name of the back-end: "OSMesa" or "EGL".
  virtual std::string name() const = 0;
};

/// File names under which the run-time linker looks for the libraries, tried in order.
struct LibraryNames {
  std::vector<std::string> osmesa = {"libOSMesa.so.8", "libOSMesa.so.6"};  ///< OSMesa
  std::vector<std::string> egl = {"libEGL.so.1"};                          ///< EGL
};

/// Creates a context and makes it current in the calling thread. Backend::automatic tries OSMesa, then EGL.
/// Throws FileError that says what is missing and which package has it.
std::unique_ptr<Context> create_context(Backend backend, const LibraryNames& libraries = {});

/// Creates a context of OSMesa, from the first of `libraries` that can be opened. Throws FileError.
std::unique_ptr<Context> create_osmesa_context(const std::vector<std::string>& libraries);
/// Creates a surfaceless context of EGL, from the first of `libraries` that can be opened. Throws FileError.
std::unique_ptr<Context> create_egl_context(const std::vector<std::string>& libraries);

/// A shared library that stays loaded until the program ends. Mesa leaves threads and thread-local
/// destructors behind, and the code that they need must not be unmapped.
class SharedLibrary {
 public:
  /// Opens the first of `names` that can be opened. Throws FileError that advises to install `package`, the
  /// name of a Debian package.
  SharedLibrary(const std::vector<std::string>& names, const std::string& package);
  /// Returns the name under which the library was opened.
  const std::string& file() const { return file_; }

  /// Sets `function` to the exported symbol. `F` is the type of the function. Throws FileError if the library
  /// lacks the symbol.
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
