#include "tools/manual/examples.h"

#include <algorithm>
#include <array>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

namespace duet::tools {
namespace {

// An example with the command that it belongs to.
struct Entry {
  const char* command;
  const char* line;
  const char* text;
};

// In the order in which they are printed.
constexpr std::array entries = {
    Entry{"new", "duet new ball", "a first scene, ball.toml"},
    Entry{"new", "duet new hero --mesh hero.obj", "a scene in which your own closed mesh falls on a step"},
    Entry{"new", "duet new flag --template cloth --overwrite", "another template, in place of flag.toml"},
    Entry{"preview", "duet preview ball.toml", "the start, 320 x 180 pixels"},
    Entry{"preview", "duet preview stack --moments 6 --accuracy draft", "six frames on one sheet"},
    Entry{"run", "duet run stack", "all frames, into out/stack"},
    Entry{"run", "duet run stack --frames 48 --set render.width=640 --set render.height=360",
          "two seconds in small pictures"},
    Entry{"run", "duet run stack --resume --stop-after 3000",
          "under a time limit: again until the status is 0"},
    Entry{"sim", "duet sim chain --threads 4 --out runs/chain",
          "no pictures; the results are those of any threads"},
    Entry{"sim", "duet sim maggot --formats glb,usd", "and two exports at the end"},
    Entry{"render", "duet render stack --frames 90:100", "draw eleven frames of out/stack again"},
    Entry{"render", "duet render stack --out final --set render.supersampling=4 --skip-existing",
          "final pictures in another folder, as many as are missing"},
    Entry{"render", "duet render stack --missing --wait 60",
          "what is not there or not whole, while `duet sim` goes on"},
    Entry{"encode", "duet encode stack", "the video of the pictures in out/stack"},
    Entry{"farm", "duet farm stack --engine slurm --submit",
          "simulation, drawing, video and check as jobs of a cluster"},
    Entry{"farm", "duet farm study/slide --engine local --submit --vary rigid.box.friction=0.05,0.1,0.2",
          "three runs, their table and contact sheet, on this machine"},
    Entry{"farm", "duet farm --status stack", "how far it is, and what failed"},
    Entry{"check", "duet check ball.toml", "all problems at once; status 2 if there is one"},
    Entry{"check", "duet check --reference", "every key of the language"},
    Entry{"explain", "duet explain stack", "effects, sizes, time step, warnings; simulates nothing"},
    Entry{"explain", "duet explain pile --estimate --samples 20",
          "hours, bytes and memory of the run, from its first frames"},
    Entry{"tetrahedralize", "duet tetrahedralize hero.obj hero.mesh --cells 24",
          "24 cells along the longest extent"},
    Entry{"tetrahedralize", "duet tetrahedralize hero.obj hero.vtk --spacing 0.05 --graded",
          "larger tetrahedra inside, for ParaView"},
    Entry{"study", "duet study tests/studies/stack.toml", "errors against seconds, as a page"},
    Entry{"study", "duet study tests/studies/stack.toml --untimed --jobs 2",
          "errors against work, two runs at a time"},
    Entry{"report", "duet report stack", "writes out/stack/report/report.html"},
    Entry{"verify", "duet verify out/stack", "names damaged, missing and unknown files"},
    Entry{"export", "duet export stack --to usd", "for Houdini, Omniverse, usdview"},
    Entry{"export", "duet export stack --to pc2 --bodies \"box*\"", "Blender's Mesh Cache of some bodies"},
    Entry{"export", "duet export stack --to vdb --voxel 0.05", "level sets, of soft bodies too"},
    Entry{"view", "duet view stack", "writes out/stack/view.html: open it in a browser"},
    Entry{"view", "duet view stack --frames 60:120 --max-size 5 --out clip.html",
          "a small page of some frames"},
    Entry{"overlaps", "duet overlaps stack --spacing 0.01", "the last frame of out/stack, every centimeter"},
    Entry{"compare", "duet compare out/a out/b", "all pictures of two runs"},
    Entry{"compare", "duet compare a.png b.png --max-rmse 0.01 --difference where.png",
          "two pictures within a bound, and a picture of where they differ"},
    Entry{"hashes", "duet hashes stack row", "whether two scenes still move as they did"},
    Entry{"hashes", "duet hashes --stages out/a out/b", "where two runs begin to differ"},
    Entry{"cache", "duet cache --clear", "remove all of it"},
    Entry{"list", "duet list", "names, costs and what they show, in groups"},
    Entry{"list", "duet list --calibrate --json", "seconds of this machine, for programs"},
    Entry{"manual", "duet manual run", "the manual page of `duet run`, which `man -l -` shows"},
    Entry{"manual", "duet manual --shell bash", "completions: source them, or install the program"},
};

constexpr const char* heading = "Examples:\n";

}  // namespace

std::vector<Example> examples_of(const std::string& command) {
  std::vector<Example> examples;
  for (const Entry& entry : entries)
    if (command == entry.command) examples.push_back({entry.line, entry.text});
  return examples;
}

void add_examples(CLI::App& command) {
  const std::vector<Example> examples = examples_of(command.get_name());
  if (examples.empty()) return;
  std::string text = command.get_footer();
  if (!text.empty()) text += "\n\n";
  text += heading;
  for (const Example& example : examples) text += fmt::format("  {}\n      {}\n", example.line, example.text);
  command.footer(text);
}

std::string notes_without_examples(const std::string& footer) {
  std::string notes = footer.substr(0, footer.find(heading));
  while (!notes.empty() && notes.back() == '\n') notes.pop_back();
  return notes;
}

std::vector<std::string> words_of(const Example& example) {
  std::vector<std::string> words;
  bool is_quoted = false, is_new = true;
  for (const char c : example.line) {
    if (c == '"') {
      is_quoted = !is_quoted;
    } else if (c == ' ' && !is_quoted) {
      is_new = true;
    } else {
      if (is_new) words.emplace_back();
      words.back() += c;
      is_new = false;
    }
  }
  words.erase(words.begin());
  return words;
}

}  // namespace duet::tools
