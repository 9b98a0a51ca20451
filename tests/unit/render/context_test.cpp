#include "render/context/context.h"

#include "tests/support/osmesa.h"
#include "tests/support/text.h"
#include <gtest/gtest.h>

#include "render/context/gl.h"
#include "sim/base/error.h"

namespace duet::render::context_test {
namespace {

const LibraryNames no_library = {.osmesa = {"libduet-none.so.8", "libduet-none.so.6"},
                                 .egl = {"libduet-none.so.1"}};

// Returns the message of the FileError with which making a context ends, and checks its exit status.
std::string failure(Backend backend, const LibraryNames& libraries) {
  try {
    create_context(backend, libraries);
  } catch (const FileError& error) {
    EXPECT_EQ(error.status(), ExitStatus::files);
    return error.what();
  }
  return "no failure";
}

using test::contains;

TEST(Context, AMissingLibraryIsNamedWithItsPackage) {
  const std::string osmesa = failure(Backend::osmesa, no_library);
  EXPECT_TRUE(contains(osmesa, "libduet-none.so.8 or libduet-none.so.6")) << osmesa;
  EXPECT_TRUE(contains(osmesa, "apt install libosmesa6")) << osmesa;
  EXPECT_FALSE(contains(osmesa, "libegl1")) << osmesa;

  const std::string egl = failure(Backend::egl, no_library);
  EXPECT_TRUE(contains(egl, "libduet-none.so.1")) << egl;
  EXPECT_TRUE(contains(egl, "apt install libegl1")) << egl;

  const std::string both = failure(Backend::automatic, no_library);
  EXPECT_TRUE(contains(both, "libduet-none.so.8")) << both;
  EXPECT_TRUE(contains(both, "libduet-none.so.1")) << both;
  EXPECT_TRUE(contains(both, "libosmesa6") && contains(both, "libegl1")) << both;
}

TEST(Context, ALibraryThatIsNoOpenGlIsRefused) {
  const std::string message = failure(Backend::osmesa, {.osmesa = {"libc.so.6"}, .egl = {}});
  EXPECT_TRUE(contains(message, "OSMesaCreateContextAttribs")) << message;
}

TEST(Context, AutomaticFallsBackToTheOtherLibrary) {
  const std::unique_ptr<Context> context =
      create_context(Backend::automatic, {.osmesa = no_library.osmesa, .egl = LibraryNames{}.egl});
  EXPECT_EQ(context->name(), "EGL");
}

TEST(Context, AutomaticPrefersOsmesaWhereTheSystemHasIt) {
  EXPECT_EQ(create_context(Backend::automatic)->name(), test::has_osmesa() ? "OSMesa" : "EGL");
}

TEST(Context, OsmesaIsGivenOrNamedAsMissing) {
  if (test::has_osmesa()) {
    EXPECT_EQ(create_context(Backend::osmesa)->name(), "OSMesa");
  } else {
    const std::string message = failure(Backend::osmesa, {});
    EXPECT_TRUE(contains(message, "libOSMesa.so.8")) << message;
  }
}

TEST(Context, GivesOpenGl33) {
  std::vector<Backend> backends = {Backend::egl};
  if (test::has_osmesa()) backends.push_back(Backend::osmesa);
  for (const Backend backend : backends) {
    const std::unique_ptr<Context> context = create_context(backend);
    const Gl gl = load_gl(*context);
    GLint major = 0, minor = 0;
    gl.GetIntegerv(GL_MAJOR_VERSION, &major);
    gl.GetIntegerv(GL_MINOR_VERSION, &minor);
    EXPECT_GE(10 * major + minor, 33) << context->name();
  }
}

}  // namespace
}  // namespace duet::render::context_test
