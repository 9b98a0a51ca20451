// EGL back-end on Mesa's surfaceless platform, which needs no display server and no GPU.
#define EGL_NO_X11
#include <array>
#include <string_view>

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <fmt/format.h>

#include "render/context/context.h"
#include "sim/base/error.h"

namespace duet::render {
namespace {

constexpr const char* packages = "install Mesa's EGL: apt install libegl1 libgl1-mesa-dri";

class EglContext : public Context {
 public:
  // Opens the library, creates a context and makes it current. Throws FileError.
  explicit EglContext(const std::vector<std::string>& libraries) : library_(libraries, "libegl1") {
    library_.find("eglGetProcAddress", get_proc_address_);
    library_.find("eglInitialize", initialize_);
    library_.find("eglBindAPI", bind_api_);
    library_.find("eglChooseConfig", choose_config_);
    library_.find("eglCreateContext", create_);
    library_.find("eglDestroyContext", destroy_);
    library_.find("eglMakeCurrent", make_current_);
    library_.find("eglGetError", get_error_);
    open_display();
    open_context();
  }
  ~EglContext() override {
    // The display stays initialized, because other contexts share it.
    make_current_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    destroy_(display_, context_);
  }
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  void make_current() override {
    // The API is bound per thread, and the context may be made current in another thread than the
    // constructor's.
    if (!bind_api_(EGL_OPENGL_API) || !make_current_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_))
      fail("a context without a surface cannot be made current");
  }
  Function get_proc_address(const char* name) const override { return get_proc_address_(name); }
  std::string name() const override { return "EGL"; }

 private:
  void open_display() {
    const auto get_platform_display =
        reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(get_proc_address_("eglGetPlatformDisplayEXT"));
    if (!get_platform_display) fail("eglGetPlatformDisplayEXT is missing");
    display_ = get_platform_display(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr);
    if (display_ == EGL_NO_DISPLAY) fail("Mesa's surfaceless platform is missing");
    EGLint major = 0, minor = 0;
    if (!initialize_(display_, &major, &minor)) fail("the surfaceless display cannot be initialized");
  }

  void open_context() {
    if (!bind_api_(EGL_OPENGL_API)) fail("OpenGL is missing");
    const std::array<EGLint, 5> config_attributes = {EGL_SURFACE_TYPE, 0, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT,
                                                     EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!choose_config_(display_, config_attributes.data(), &config, 1, &count) || count == 0)
      fail("no configuration draws OpenGL");
    const std::array<EGLint, 7> context_attributes = {EGL_CONTEXT_MAJOR_VERSION,
                                                      3,
                                                      EGL_CONTEXT_MINOR_VERSION,
                                                      3,
                                                      EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                                      EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                                      EGL_NONE};
    context_ = create_(display_, config, EGL_NO_CONTEXT, context_attributes.data());
    if (context_ == EGL_NO_CONTEXT) fail("it gives no OpenGL 3.3 core context");
    try {
      make_current();
    } catch (...) {
      destroy_(display_, context_);
      throw;
    }
  }

  [[noreturn]] void fail(std::string_view what) const {
    throw FileError(library_.file(),
                    fmt::format("EGL cannot draw off-screen: {} (error {:#06x})", what, get_error_()),
                    packages);
  }

  SharedLibrary library_;
  decltype(eglGetProcAddress)* get_proc_address_ = nullptr;
  decltype(eglInitialize)* initialize_ = nullptr;
  decltype(eglBindAPI)* bind_api_ = nullptr;
  decltype(eglChooseConfig)* choose_config_ = nullptr;
  decltype(eglCreateContext)* create_ = nullptr;
  decltype(eglDestroyContext)* destroy_ = nullptr;
  decltype(eglMakeCurrent)* make_current_ = nullptr;
  decltype(eglGetError)* get_error_ = nullptr;
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<Context> create_egl_context(const std::vector<std::string>& libraries) {
  return std::make_unique<EglContext>(libraries);
}

}  // namespace duet::render
