// The commands of the program `duet`, each in a source file of its own, and their options. command_line.cpp
// fills in the options; main.cpp prints the outcomes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/report.h"

#include "render/compare.h"
#include "sim/base/error.h"
#include "sim/scene/reader/reader.h"

namespace duet::tools {

// The choice of a scene and of changes to it.
struct SceneChoice {
  std::string name;                  // path, or name of a scene that ships
  std::string accuracy;              // draft, standard or fine; empty: as in the scene
  std::vector<std::string> set;      // "key=value"
  std::vector<std::string> without;  // names of effects that are left out
  scene::FileMap files = {};         // copies of mesh files, if a run is repeated
};

// The value of --frames: N or A:B.
struct Frames {
  std::optional<int> first;  // A; empty: N was given
  int last = 0;              // N or B
};
// Parses the text of --frames. Throws Error (usage).
Frames parse_frames(const std::string& text);

// Options of `duet sim` and `duet run`.
struct SimulateOptions {
  SceneChoice scene;
  std::string out;                   // folder of the run; empty: out/<scene>
  bool overwrite = false;            // replace a run that is in the folder
  std::optional<Frames> frames;      // empty: all frames of the scene
  int threads = 0;                   // 0: all cores
  bool resume = false;               // continue after the last checkpoint
  std::optional<double> stop_after;  // s of wall time after which no further frame begins; empty: never
  double wait = 0;                   // s, to wait while another program writes to the folder
  bool allow_other_build = false;    // resume a run of another version of the numerics
  bool ledger = false;               // record momentum and energy around every stage
  bool hash_stages = false;          // record a hash of the state after every stage
  bool draw = false;                 // `duet run`: draw pictures and encode a video
  bool stats_only = false;           // write no meshes and level sets
  std::vector<std::string> formats;  // export formats, written at the end of the run
  std::string command;               // command line, quoted for a shell
  std::string resume_command;        // `command` with --resume
};

// Options of `duet new`.
struct NewOptions {
  std::string name;           // path of the new scene, with or without .toml
  std::string template_name;  // empty: drop
  std::string mesh;           // closed surface that falls on a step; empty: none
  bool overwrite = false;     // replace an existing file
};

// Options of `duet preview`.
struct PreviewOptions {
  SceneChoice scene;
  // Frame to draw, or last frame on a sheet; empty: 0, or the last one of the scene.
  std::optional<int> frame;
  std::optional<int> moments;        // number of frames on a sheet; empty: one picture
  std::string out;                   // PNG file; empty: out/<scene>-preview.png
  std::optional<int> width, height;  // pixels of each picture; empty: 320 x 180, or as --set says
};

// Options of `duet render`.
struct RenderOptions {
  std::string run;             // folder of a run, or name of a run in out/
  std::string out;             // folder for pictures and video; empty: that of the run
  bool skip_existing = false;  // keep pictures that are whole
  bool missing = false;  // draw only what is not there or not whole, of frames that are simulated; no video
  double wait = 0;       // s, to wait for frames that a simulation is still to write; with `missing`
  std::optional<Frames> frames;  // empty: all frames that were simulated
  std::vector<std::string> set;  // "key=value" of camera, lights, looks, sky and render
};

// Options of `duet encode`.
struct EncodeOptions {
  std::string run;  // folder of a run, or name of a run in out/
};

// Options of `duet check`.
struct CheckOptions {
  SceneChoice scene;
  bool reference = false;  // print all keys instead of checking a scene
};

// Options of `duet explain`.
struct ExplainOptions {
  SceneChoice scene;
  std::string out;            // folder of the run; empty: out/<scene>
  bool estimate = false;      // simulate the first frames
  double sample_seconds = 5;  // s, processor time of that simulation
  bool json = false;
};

// Options of `duet list`.
struct ListOptions {
  bool names = false;      // print only the names
  bool calibrate = false;  // scale the seconds to this machine
  bool json = false;
};

// Options of `duet tetrahedralize`.
struct TetrahedralizeOptions {
  std::string in;                     // file of a closed triangle mesh
  std::string out;                    // file to write: .mesh or .vtk
  std::optional<double> spacing;      // m, edge of the lattice; at most one of spacing and cells is set
  std::optional<int> cells;           // number of lattice cells along the longest extent
  bool graded = false, json = false;  // graded: larger tetrahedra inside
};

// Options of `duet study`.
struct StudyOptions {
  std::string spec;          // TOML file of the study
  std::string out;           // folder; empty: out/studies/<name of the spec>
  std::string program;       // program duet that simulates; empty: this one
  int jobs = 1;              // number of untimed runs at a time
  bool untimed = false;      // run each setting once and measure no times
  std::optional<int> point;  // carry out only the run of this number, from 1, and write no report
  bool json = false;         // print no table
};

// Options of `duet report`.
struct ReportOptions {
  std::string run;  // folder of a run, or name of a run in out/
};

// Options of `duet verify`.
struct VerifyOptions {
  std::string run;  // folder of a run, or name of a run in out/
};

// Options of `duet farm`.
struct FarmOptions {
  SceneChoice scene;   // name: a scene, the folder of a run, or the specification of a study
  std::string out;     // folder of the run, or of the study; empty: as `duet run` and `duet study` choose
  std::string engine;  // slurm, parallel or local
  std::optional<int> tasks;         // drawing tasks of each run; empty: 8 for one run, 1 for each variation
  std::vector<std::string> vary;    // "key=a,b,c"
  int seeds = 0;                    // number of seeds of scattered instances; 0: those of the scene
  std::optional<Frames> frames;     // last frame; empty: that of the scene
  int threads = 4;                  // of a simulation
  int minutes = 60;                 // time limit of a job
  int chain = 8;                    // jobs in which a simulation has to end
  std::vector<std::string> sbatch;  // further options of every sbatch
  bool submit = false;              // submit the scripts, or carry them out
  bool overwrite = false;           // replace scripts of an earlier call, and runs of other settings
  bool status = false;              // say how far a farm is
  bool collect = false;             // write table, contact sheet and page of variations
  bool json = false;
};

// Options of `duet cache`.
struct CacheOptions {
  bool clear = false;  // remove all files of the cache
};

// Options of `duet manual`.
struct ManualOptions {
  std::string command;    // command to describe; empty: the program
  std::string shell;      // bash, zsh or fish: print completions instead; empty: the page
  std::string into;       // prefix of an installation to write everything into; empty: print
  bool examples = false;  // print the examples of all commands instead
};

// Options of `duet overlaps`.
struct OverlapOptions {
  SceneChoice scene;
  std::string out;        // folder of the run; empty: out/<scene>
  double spacing = 0.02;  // m, distance between the tested points of a surface
  bool json = false;
};

// Options of `duet export`.
struct ExportOptions {
  std::string run;                      // folder of a run, or name of a run in out/
  std::string format;                   // a name that export_formats() lists
  std::string out;                      // file or folder; empty: in export/ of the run
  std::vector<std::string> bodies;      // patterns of names, with * for any characters; empty: all bodies
  std::optional<Frames> frames;         // empty: all frames that are there
  std::string up = "y";                 // or "z"
  double scale = 1;                     // units of the export in a meter
  bool compress = false;                // compress the files if the format can
  std::optional<double> max_megabytes;  // bound of the size for glb and usd; empty: that of the format
  std::optional<double> voxel;          // width of the voxels of deformable bodies in vdb, m; empty: none
  bool overwrite = false;               // replace an existing export
};

// Options of `duet view`.
struct ViewOptions {
  std::string run;                  // folder of a run, or the name of a run in out/
  std::string out;                  // HTML file; empty: view.html in the run's folder
  std::vector<std::string> bodies;  // patterns of names; empty: all bodies
  std::optional<Frames> frames;     // empty: all that are there
  double max_megabytes = 40;        // MB; frames are left out of a larger page
  bool overwrite = false;           // replace an earlier page
};

// Options of `duet hashes`.
struct HashesOptions {
  std::vector<std::string> scenes;  // entries of frames.toml in the folder; empty: all
  std::string folder;               // folder of the expected hashes; empty: tests/hashes
  std::vector<std::string> stages;  // two runs with hashes.jsonl, to be compared instead of scenes
  int threads = 0;                  // 0: all cores
  double seconds = 0;  // processor time after which a scene ends with the frame in hand; 0: no bound
  bool full = false;   // include the later frame of each entry
  bool write = false;  // renew the expected hashes
  bool json = false;
};

// Options of `duet compare`.
struct CompareOptions {
  std::string a, b;                 // two pictures, or two folders of pictures or runs
  std::optional<Frames> frames;     // of folders; empty: all pictures
  render::DifferenceBounds bounds;  // within which pictures count as equal
  std::string picture;              // where the difference is drawn; empty: nowhere
  bool quiet = false, json = false;
};

// Returns `word` as it can be typed into a shell: in quotes if it holds other characters than letters, digits
// and signs that shells leave alone.
std::string shell_word(const std::string& word);

// The functions that return an Outcome are the commands: each carries out its options and returns the outcome
// to print. They throw the errors of sim/base/error.h. Long ones show their progress by `report`.
// Writes a commented scene to begin with.
Outcome new_scene(const NewOptions& options);
// Draws one picture of a scene or a sheet of frames.
Outcome preview(const PreviewOptions& options, Report& report);
// Simulates a scene into a run directory, and draws it for `duet run`.
Outcome simulate(const SimulateOptions& options, Report& report);
// Draws frames of a run.
Outcome render(const RenderOptions& options, Report& report);
// Encodes the video of a run's pictures, unless it is there.
Outcome encode(const EncodeOptions& options);
// Prints every problem of a scene, or the reference of all keys.
Outcome check(const CheckOptions& options);
// Prints the effect plan, sizes and warnings of a scene.
Outcome explain(const ExplainOptions& options);
// Fills a closed surface with tetrahedra.
Outcome tetrahedralize(const TetrahedralizeOptions& options, Report& report);
// Runs a scene under many settings and reports errors against cost.
Outcome study(const StudyOptions& options, Report& report);
// Returns the number of runs that a study consists of, each of which StudyOptions::point can carry out.
int study_points(const StudyOptions& options);
// Returns the number of these runs that have a result of this program in the folder StudyOptions::out.
int study_results(const StudyOptions& options);
// Writes, submits, examines or collects the tasks by which many machines work on a run, variations or a
// study.
Outcome farm(const FarmOptions& options, Report& report);
// Writes one run as an HTML page.
Outcome report_run(const ReportOptions& options);
// Compares the files of a run with its journal.
Outcome verify(const VerifyOptions& options, Report& report);
// Prints how deep the bodies at the end of a run overlap.
Outcome overlaps(const OverlapOptions& options);
// Compares pictures. The status is `differs` if a pair breaks a bound.
Outcome compare(const CompareOptions& options);
// Compares the hashes of scenes with the expected ones, or renews these, or compares two runs stage by stage.
Outcome hashes(const HashesOptions& options);
// Writes a run in the format of another program.
Outcome export_run(const ExportOptions& options, Report& report);
// Throws Error (usage) if there is no export format of this name.
void require_format(const std::string& name);
// Returns the export formats with a description, one a line.
std::string export_formats();
// Writes a run as a page for a browser.
Outcome view(const ViewOptions& options, Report& report);
// Prints the size of the cache of tetrahedra, or clears it.
Outcome cache(const CacheOptions& options);
// Prints the scenes that ship.
Outcome list(const ListOptions& options);

}  // namespace duet::tools
