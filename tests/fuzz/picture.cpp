// Pictures, as `duet compare` reads them, and the check by which `duet render` finds whole ones.
#include "render/picture.h"

#include "tests/fuzz/harness.h"

#include "render/compare.h"
#include "render/sequence.h"

using namespace duet;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string bytes = fuzz::text_of(data, size);
  const auto path = fuzz::write_file("picture.png", bytes);
  render::Picture picture;
  const bool accepted = fuzz::is_accepted([&] { picture = render::read_picture(path); });
  const bool whole = render::is_whole_png(bytes, picture.width, picture.height);
  if (!accepted || !whole || picture.width > 256 || picture.height > 256) return 0;
  // What was read and is written again is the same picture.
  const std::string written = render::png_bytes(path.string(), picture.width, picture.height, picture.rgb);
  fuzz::write_file("picture.png", written);
  const render::Picture again = render::read_picture(path);
  if (!(again == picture) || render::compare(picture, again).maximum != 0)
    fuzz::report_finding("a picture that was written again is another one");
  return 0;
}
