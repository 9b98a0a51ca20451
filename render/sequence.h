// Draws frames of a run directory into PNG files. Reads scene.toml (camera, lights, looks), manifest.json and
// mesh/.
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

// Holds the context and everything that stays the same from frame to frame. To be used from the thread that
// made it.
class SequenceRenderer {
 public:
  // Throws FileError (exit status 4) with a remedy when no off-screen OpenGL library can be used or when a
  // body of the manifest wears a look that the scene does not have; Error(usage) when the scene asks for too
  // much.
  SequenceRenderer(const scene::Scene& scene, const io::Manifest& manifest,
                   Backend backend = Backend::automatic);
  ~SequenceRenderer();
  SequenceRenderer(const SequenceRenderer&) = delete;
  SequenceRenderer& operator=(const SequenceRenderer&) = delete;

  // Draws the bodies of one frame; returns 8-bit sRGB RGB rows, top row first, scene.render.width x height.
  // The bodies must be those of the manifest, in its order. `time`: seconds, where the camera is. The same
  // bodies give the same bytes on the same machine.
  std::vector<unsigned char> draw(const std::vector<BodySurface>& bodies, double time = 0);

  // Reads mesh/NNNN.obj, draws it and writes image/NNNN.png atomically. Throws FileError when the mesh is
  // missing, is not what the run's journal lists or does not fit the manifest, or when the picture cannot be
  // written.
  void render_frame(const io::RunDirectory& run, int frame) { render_frame(run, frame, run); }
  /// The same into image/ of another folder, which need not be a run.
  void render_frame(const io::RunDirectory& run, int frame, const io::RunDirectory& to);

  std::string backend_name() const;  // "OSMesa" or "EGL"

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// PNG, 8-bit RGB, sRGB chunk, of `rgb` with 3 * width * height bytes, top row first. Throws FileError, which
/// names `path`, for another number of them.
std::string png_bytes(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb);

/// Whether the bytes are a PNG of this size whose chunks all have their checksums.
bool is_whole_png(std::string_view bytes, int width, int height);

// PNG, 8-bit RGB, sRGB chunk, written atomically. `rgb` has 3 * width * height bytes, top row first.
void write_png(const std::string& path, int width, int height, const std::vector<unsigned char>& rgb);

// Encodes image/NNNN.png of the run into <name>.mp4 by ffmpeg, a program that is looked up in PATH unless it
// is a path. Returns a note for the user: the file's path, or why there is no video ("ffmpeg is not
// installed: ..."). Never throws for a missing or failing ffmpeg. Throws FileError that names the frames
// between the first and the last whose pictures are missing, empty or not what the run's journal lists: the
// video would end before them. Gives up soon after `stop`, if there is one, becomes true.
std::string encode_video(const io::RunDirectory& run, const std::string& name, double fps,
                         const std::string& ffmpeg = "ffmpeg", const std::atomic<bool>* stop = nullptr);

}  // namespace duet::render
