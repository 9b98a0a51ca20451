// Draws frames of a run directory into PNG files and encodes the video. Reads scene.toml (camera, lights,
// looks), manifest.json, mesh/ and, for strain, stress and contact, values/.
#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "render/context/backend.h"
#include "sim/io/run_directory.h"
#include "sim/scene/scene.h"

namespace duet::render {

/// Draws the frames of one run. Holds the OpenGL context and everything that stays equal from frame to frame.
/// It must be used in the thread that made it.
class SequenceRenderer {
 public:
  /// Creates a context by `backend`. Throws FileError (exit status 4) that names a remedy if no off-screen
  /// OpenGL library can be used, or if a body of `manifest` has a look that `scene` does not define; Error
  /// (usage) if the scene asks for more than the renderer holds.
  SequenceRenderer(const scene::Scene& scene, const io::Manifest& manifest,
                   Backend backend = Backend::automatic);
  /// Destroys the objects of OpenGL, then the context.
  ~SequenceRenderer();
  SequenceRenderer(const SequenceRenderer&) = delete;
  SequenceRenderer& operator=(const SequenceRenderer&) = delete;

  /// Draws the bodies of one frame as the camera sees them at `time` (s). Returns 3 * width * height bytes of
  /// 8-bit sRGB in rows from the top, for the size of scene.render. `bodies` must be those of the manifest,
  /// in its order: FileError if they are not, or if a body lacks what its colors are to show
  /// (io::take_color). Equal bodies give equal bytes on one machine.
  std::vector<unsigned char> draw(const std::vector<BodySurface>& bodies, double time = 0);

  /// Reads mesh/NNNN.obj of `run`, draws it and writes image/NNNN.png of the same run atomically. Throws
  /// FileError if the mesh is missing, is not the one in the run's journal or does not fit the manifest, or
  /// if the picture cannot be written.
  void render_frame(const io::RunDirectory& run, int frame) { render_frame(run, frame, run); }
  /// Draws a frame of `run` into image/NNNN.png of the folder `to`, which need not be a run. Otherwise equals
  /// the overload with one folder.
  void render_frame(const io::RunDirectory& run, int frame, const io::RunDirectory& to);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns a PNG file (8-bit RGB with an sRGB chunk) of `rgb`, which has 3 * width * height bytes in rows
/// from the top. The command `maker` is named in a text chunk unless it is empty. Throws FileError that names
/// `path` if the number of bytes is another.
std::string png_bytes(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb,
                      const std::string& maker = {});

/// Returns whether `bytes` are a PNG of `width` x `height` pixels whose chunks all match their checksums and
/// end with IEND.
bool is_whole_png(std::string_view bytes, int width, int height);

/// Writes png_bytes() to a file atomically. Throws FileError.
void write_png(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb,
               const std::string& maker = {});

/// Returns whether a file begins as png_bytes() of this `maker`. Throws FileError if it cannot be read.
bool is_made_by(const std::filesystem::path& file, const std::string& maker);

/// Encodes image/NNNN.png of `run` into NAME.mp4 there, `fps` pictures a second. `ffmpeg` is looked up in
/// PATH unless it is a path. Returns a note for the user: the path of the file, or why there is no video ("no
/// video: ffmpeg is not installed ..."); a missing or failing ffmpeg is no exception. Throws FileError if
/// pictures between the first and the last are missing, empty or not those of the run's journal, and names
/// their frames: the video would end before them. Gives up soon after `*stop` becomes true; null: never.
std::string encode_video(const io::RunDirectory& run, const std::string& name, double fps,
                         const std::string& ffmpeg = "ffmpeg", const std::atomic<bool>* stop = nullptr);

/// Returns whether NAME.mp4 is whole and was made by encode_video() of the pictures that the run's journal
/// lists now.
bool is_encoded(const io::RunDirectory& run, const std::string& name);

}  // namespace duet::render
