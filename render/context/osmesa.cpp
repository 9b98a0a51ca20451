// OSMesa back-end. Its interface is declared here instead of taken from <GL/osmesa.h>: Mesa 25.1 dropped the
// library and its header, and the program must still build there and draw through EGL.
#include <array>

#include "render/context/context.h"
#include "sim/base/error.h"

#ifdef __SANITIZE_ADDRESS__
// OSMesa never frees a few hundred bytes of each context. Leaks of Duet itself stay visible.
extern "C" const char* __lsan_default_suppressions() { return "leak:libOSMesa.so"; }
#endif

namespace duet::render {
namespace {

struct OsmesaState;  // opaque, owned by the library
using Create = OsmesaState*(const int* attributes, OsmesaState* shared);
using Destroy = void(OsmesaState*);
using MakeCurrent = unsigned char(OsmesaState*, void* buffer, unsigned type, int width, int height);
using GetProcAddress = Context::Function(const char* name);

// Values of <GL/osmesa.h> and of OpenGL.
constexpr int format_attribute = 0x22, profile_attribute = 0x33, core_profile = 0x34;
constexpr int major_attribute = 0x36, minor_attribute = 0x37;
constexpr int rgba = 0x1908;                // GL_RGBA
constexpr unsigned unsigned_byte = 0x1401;  // GL_UNSIGNED_BYTE
constexpr int side = 16;  // pixels of a buffer that OSMesa asks for, although nothing is drawn into it

class OsmesaContext : public Context {
 public:
  explicit OsmesaContext(const std::vector<std::string>& libraries) : library_(libraries, "libosmesa6") {
    Create* create = nullptr;
    library_.find("OSMesaCreateContextAttribs", create);
    library_.find("OSMesaDestroyContext", destroy_);
    library_.find("OSMesaMakeCurrent", make_current_);
    library_.find("OSMesaGetProcAddress", get_proc_address_);
    const std::array<int, 9> attributes = {
        format_attribute, rgba, profile_attribute, core_profile, major_attribute, 3, minor_attribute, 3, 0};
    state_ = create(attributes.data(), nullptr);
    if (!state_)
      throw FileError(library_.file(), "OSMesa gives no OpenGL 3.3 core context",
                      "install a current Mesa: apt install libosmesa6");
    try {
      make_current();
    } catch (...) {
      destroy_(state_);
      throw;
    }
  }
  ~OsmesaContext() override { destroy_(state_); }
  OsmesaContext(const OsmesaContext&) = delete;
  OsmesaContext& operator=(const OsmesaContext&) = delete;

  void make_current() override {
    if (!make_current_(state_, buffer_.data(), unsigned_byte, side, side))
      throw FileError(library_.file(), "OSMesa cannot make its context current",
                      "see whether memory is short");
  }
  Function get_proc_address(const char* name) const override { return get_proc_address_(name); }
  std::string name() const override { return "OSMesa"; }

 private:
  SharedLibrary library_;
  Destroy* destroy_ = nullptr;
  MakeCurrent* make_current_ = nullptr;
  GetProcAddress* get_proc_address_ = nullptr;
  OsmesaState* state_ = nullptr;
  std::array<unsigned char, 4 * side * side> buffer_{};
};

}  // namespace

std::unique_ptr<Context> create_osmesa_context(const std::vector<std::string>& libraries) {
  return std::make_unique<OsmesaContext>(libraries);
}

}  // namespace duet::render
