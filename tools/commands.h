// The program's commands: one file each. main.cpp makes their options from the command line and prints the
// outcome.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/report.h"

#include "render/compare.h"
#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {

// Which scene, and what is changed in it.
struct SceneChoice {
  std::string name;                  // a path, or the name of a scene that ships
  std::string accuracy;              // draft, standard or fine; empty: the scene's own
  std::vector<std::string> set;      // "key=value"
  std::vector<std::string> without;  // effects to leave out
  scene::FileMap files = {};         // of a run that is repeated: its copies of the mesh files
};

// --frames N or A:B.
struct Frames {
  std::optional<int> first;  // A
  int last = 0;              // N or B
};
Frames parse_frames(const std::string& text);  // throws Error (usage)

struct SimulateOptions {
  SceneChoice scene;
  std::string out;               // folder; empty: out/<scene>
  bool overwrite = false;        // replace a run that the folder holds
  std::optional<Frames> frames;  // none: all of the scene
  int threads = 0;               // 0: all cores
  bool resume = false;
  std::optional<double> stop_after;  // s of wall time, after which no further frame is begun; none: never
  bool allow_other_build = false;    // resume frames of other numerics, too
  bool ledger = false;               // momentum and energy of every stage
  bool hash_stages = false;          // the state after every stage, as hashes
  bool draw = false;                 // `duet run`: also pictures and a video
  bool stats_only = false;           // no meshes and level sets
  std::vector<std::string> formats;  // that the run is exported to at its end
  std::string command;               // as typed, to be typed again
  std::string resume_command;        // the same with --resume
};

struct NewOptions {
  std::string name;           // path of the scene to write, with or without the ending .toml
  std::string template_name;  // empty: drop
  std::string mesh;           // closed surface that falls on a step; empty: none
  bool overwrite = false;     // replace a file that is there
};

struct PreviewOptions {
  SceneChoice scene;
  std::optional<int> frame;    // to draw, or the last one of `moments`; none: 0, or the last of the scene
  std::optional<int> moments;  // frames on one sheet; none: one picture
  std::string out;             // PNG file; empty: out/<scene>-preview.png
  std::optional<int> width, height;  // of a picture, pixels; none: 320 x 180, or as --set says
};

struct RenderOptions {
  std::string run;               // folder of a run, or the name of a run in out/
  std::string out;               // folder of the pictures and the video; empty: that of the run
  bool skip_existing = false;    // leave pictures that are whole as they are
  std::optional<Frames> frames;  // none: all that were simulated
  std::vector<std::string> set;  // "key=value" of camera, lights, looks, sky and render
};

struct CheckOptions {
  SceneChoice scene;
  bool reference = false;
};

struct ExplainOptions {
  SceneChoice scene;
  bool json = false;
};

struct TetrahedralizeOptions {
  std::string in;                 // a triangle mesh
  std::string out;                // .mesh or .vtk
  std::optional<double> spacing;  // m; at most one of spacing and cells
  std::optional<int> cells;       // along the longest extent
  bool graded = false, json = false;
};

struct StudyOptions {
  std::string spec;
  std::string out;      // folder; empty: out/studies/<name of the spec>
  std::string program;  // the duet that simulates; empty: this one
  int jobs = 1;         // untimed runs at the same time
  bool untimed = false;
  bool json = false;  // no table on standard output
};

struct ReportOptions {
  std::string run;  // folder of a run, or the name of a run in out/
};

struct VerifyOptions {
  std::string run;  // folder of a run, or the name of a run in out/
};

struct CacheOptions {
  bool clear = false;
};

struct OverlapOptions {
  SceneChoice scene;
  std::string out;        // folder of its run; empty: out/<scene>
  double spacing = 0.02;  // m
  bool json = false;
};

struct ExportOptions {
  std::string run;                  // folder of a run, or the name of a run in out/
  std::string format;               // a name of export_formats()
  std::string out;                  // file or folder; empty: in the run's folder export/
  std::vector<std::string> bodies;  // patterns of names; empty: all bodies
  std::optional<Frames> frames;     // none: all that are there
  std::string up = "y";             // or "z"
  double scale = 1;                 // units of the export in a meter
  bool compress = false;
  std::optional<double> max_megabytes;  // of glb and usd; none: the format's own bound
  bool overwrite = false;
};

struct ViewOptions {
  std::string run;                  // folder of a run, or the name of a run in out/
  std::string out;                  // HTML file; empty: view.html in the run's folder
  std::vector<std::string> bodies;  // patterns of names; empty: all bodies
  std::optional<Frames> frames;     // none: all that are there
  double max_megabytes = 40;        // of the page; frames are left out where it would be larger
  bool overwrite = false;
};

struct HashesOptions {
  std::vector<std::string> scenes;  // entries of tests/hashes/frames.toml; empty: all
  std::string folder;               // of the expected hashes; empty: tests/hashes
  std::vector<std::string> stages;  // two runs with hashes.jsonl, instead of scenes
  int threads = 0;                  // 0: all cores
  double seconds = 0;               // of processor time, after which a scene ends at its next frame; 0: never
  bool full = false;                // also the later frames
  bool write = false;
  bool json = false;
};

struct CompareOptions {
  std::string a, b;              // two pictures, or two folders of pictures or runs
  std::optional<Frames> frames;  // of folders; none: all pictures
  render::Bounds bounds;
  std::string picture;  // where the difference is drawn to; empty: nowhere
  bool quiet = false, json = false;
};

/// The word as it can be typed into a shell: in quotes where it holds more than letters, digits and signs
/// that shells leave alone.
std::string shell_word(const std::string& word);

Outcome new_scene(const NewOptions& options);
Outcome preview(const PreviewOptions& options, Report& report);
Outcome simulate(const SimulateOptions& options, Report& report);
Outcome render(const RenderOptions& options, Report& report);
Outcome check(const CheckOptions& options);
Outcome explain(const ExplainOptions& options);
Outcome tetrahedralize(const TetrahedralizeOptions& options, Report& report);
Outcome study(const StudyOptions& options, Report& report);
Outcome report_run(const ReportOptions& options);
Outcome verify(const VerifyOptions& options, Report& report);
Outcome overlaps(const OverlapOptions& options);
Outcome compare(const CompareOptions& options);
Outcome hashes(const HashesOptions& options);
Outcome export_run(const ExportOptions& options, Report& report);
/// Throws Error (usage) where there is no such format.
void require_format(const std::string& name);
std::string export_formats();  // their names and what they are, a line each
Outcome view(const ViewOptions& options, Report& report);
Outcome cache(const CacheOptions& options);
Outcome list();

}  // namespace duet::tools
