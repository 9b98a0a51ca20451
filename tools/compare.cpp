// `duet compare`: measures how much two pictures or two folders of pictures differ.
#include "render/compare.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "tools/commands.h"
#include "tools/interrupt.h"
#include "tools/replaceable.h"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "render/sequence.h"
#include "sim/base/files.h"
#include "sim/base/wording.h"
#include "sim/io/run_directory.h"
#include "sim/io/run_journal.h"

namespace duet::tools {
namespace {
namespace fs = std::filesystem;

// Maker that the pictures of differences name, by which earlier ones are known.
constexpr const char* difference_maker = "duet compare";

// One side of the comparison: a picture, or a folder of pictures.
struct Side {
  fs::path path;
  io::RunDirectory run;  // that the pictures belong to; without a journal nothing is checked
};

// Two pictures to compare.
struct Pair {
  std::string name;  // file name of both
  fs::path a, b;
  fs::path difference;  // where the difference is drawn; empty: nowhere
};

// Returns a picture, a folder of pictures, or the folder image/ of a run, given by its path or by the name of
// a run in out/. A picture in image/ of a run, or that folder itself, belongs to the run as well. Throws
// FileError if there is none, or if the journal of the run cannot be read.
Side find_pictures(const std::string& name) {
  for (const fs::path& path : {fs::path(name), fs::path("out") / name}) {
    if (fs::exists(io::RunDirectory{path}.manifest()))
      return {io::RunDirectory{path}.image(0).parent_path(), io::open_run(path)};
    if (!fs::exists(path)) continue;
    const fs::path folder = fs::canonical(fs::is_directory(path) ? path : fs::absolute(path).parent_path());
    const bool is_of_run =
        folder.filename() == "image" && fs::exists(io::RunDirectory{folder.parent_path()}.manifest());
    return {path, is_of_run ? io::open_run(folder.parent_path()) : io::RunDirectory()};
  }
  throw FileError(name, "no such picture, folder or run");
}

bool is_picture(const fs::path& path) {
  static constexpr std::array<std::string_view, 3> extensions = {".png", ".jpg", ".jpeg"};
  return std::find(extensions.begin(), extensions.end(), path.extension().string()) != extensions.end();
}

// Returns the names of the pictures in a folder, sorted: all of them, or those of the given frames.
std::vector<std::string> pictures_in(const fs::path& folder, const std::optional<Frames>& frames) {
  std::vector<std::string> names;
  const auto wanted = [&](const fs::path& path) {
    if (!frames) return is_picture(path);
    const int frame = io::frame_of_file(path, ".png");
    return frame >= frames->first.value_or(frames->last) && frame <= frames->last;
  };
  for (const fs::directory_entry& entry : fs::directory_iterator(folder))
    if (wanted(entry.path())) names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

// Throws FileError if a picture among the given frames that the journal lists is missing, or not as it was
// written: two runs that lost the same picture would seem equal.
void require_listed_pictures(const io::RunDirectory& run, const std::optional<Frames>& frames) {
  if (!run.journal) return;
  for (const auto& [name, entry] : run.journal->entries()) {
    if (fs::path(name).parent_path() != "image" || entry.state != io::RunJournal::Entry::State::whole)
      continue;
    const int frame = io::frame_of_file(name, ".png");
    if (frame < 0) continue;
    if (!frames || (frame >= frames->first.value_or(frames->last) && frame <= frames->last))
      run.require_whole(run.image(frame));
  }
}

// Throws FileError if a picture of `folder` has no partner in `other`: a folder that lost some does not equal
// a whole one.
void require_partners(const std::vector<std::string>& names, const std::vector<std::string>& others,
                      const fs::path& folder, const fs::path& other) {
  std::vector<std::string> lonely;
  std::set_difference(names.begin(), names.end(), others.begin(), others.end(), std::back_inserter(lonely));
  if (lonely.empty()) return;
  throw FileError((other / lonely[0]).string(),
                  fmt::format("is missing{}, but in {} it is there",
                              lonely.size() > 1 ? fmt::format(" (as {} more are)", lonely.size() - 1) : "",
                              folder.string()),
                  "--frames A:B compares frames that both have");
}

// Returns the pairs to compare, and makes the folder for the differences. Throws Error (usage) or FileError
// if the two sides do not fit each other, and FileError if a picture of a run is damaged.
std::vector<Pair> pairs_of(const CompareOptions& options) {
  const Side sides[] = {find_pictures(options.a), find_pictures(options.b)};
  const fs::path &a = sides[0].path, &b = sides[1].path;
  if (fs::is_directory(a) != fs::is_directory(b))
    throw Error(ExitStatus::usage,
                fmt::format("{} and {}: a folder cannot be compared with a picture", a.string(), b.string()));
  if (!fs::is_directory(a)) {
    if (options.frames)
      throw Error(ExitStatus::usage,
                  "--frames: chooses among the pictures of folders, and these are pictures");
    for (const Side& side : sides) side.run.require_whole(side.run.root / "image" / side.path.filename());
    return {{a.filename().string(), a, b, options.picture}};
  }
  for (const Side& side : sides) require_listed_pictures(side.run, options.frames);
  const std::vector<std::string> names = pictures_in(a, options.frames),
                                 others = pictures_in(b, options.frames);
  require_partners(names, others, a, b);
  require_partners(others, names, b, a);
  if (names.empty())
    throw FileError(a.string(), "has no pictures of this kind", "`duet render RUN` draws a run");
  const fs::path drawn = options.picture;
  std::vector<Pair> pairs;
  pairs.reserve(names.size());
  for (const std::string& name : names)
    pairs.push_back(
        {name, a / name, b / name, drawn.empty() ? drawn : (drawn / name).replace_extension(".png")});
  if (!drawn.empty()) io::create_folder(drawn);
  return pairs;
}

// Throws Error (usage) if a picture of a difference would replace one that is compared, or a file that this
// command did not write.
void require_replaceable_differences(const std::vector<Pair>& pairs) {
  for (const Pair& pair : pairs) {
    if (pair.difference.empty()) continue;
    std::error_code missing;
    for (const fs::path& compared : {pair.a, pair.b})
      if (fs::equivalent(pair.difference, compared, missing))
        throw Error(ExitStatus::usage,
                    fmt::format("--difference {}: is a picture that is compared, and stays untouched (give "
                                "another path)",
                                pair.difference.string()));
    require_own_picture(pair.difference, difference_maker, "picture of a difference");
  }
}

void require_same_size(const Pair& pair, const render::Picture& a, const render::Picture& b) {
  if (a.width != b.width || a.height != b.height)
    throw Error(ExitStatus::usage,
                fmt::format("{} has {} x {} pixels, {} has {} x {}: draw both in one size (duet render RUN "
                            "--set render.width=W --set render.height=H)",
                            pair.a.string(), a.width, a.height, pair.b.string(), b.width, b.height));
}

void print_pair(const CompareOptions& options, const Pair& pair, const render::Difference& d,
                const std::string& broken) {
  if (options.quiet) return;
  if (options.json) {
    const nlohmann::ordered_json object = {
        {"event", "pair"},        {"a", pair.a.string()}, {"b", pair.b.string()},
        {"same", broken.empty()}, {"maximum", d.maximum}, {"mean", d.mean},
        {"rmse", d.rmse},         {"share", d.share},     {"largest_patch", d.max_patch},
        {"ssim", d.ssim}};
    return print(json_text(object) + "\n");
  }
  print(
      fmt::format("{}  {}: maximum {:.3g}, mean {:.3g}, RMSE {:.3g}, {:.3g} % off by more than {}/255, "
                  "largest patch {} px, SSIM {:.5f}\n",
                  broken.empty() ? "same   " : "differs", pair.name, d.maximum, d.mean, d.rmse, 100 * d.share,
                  options.bounds.tolerance, d.max_patch, d.ssim));
}

}  // namespace

Outcome compare(const CompareOptions& options) {
  const OrderlyStop orderly;
  const std::vector<Pair> pairs = pairs_of(options);
  require_replaceable_differences(pairs);
  int differing = 0;
  double worst = -1;
  std::string worst_text;
  for (const Pair& pair : pairs) {
    if (interrupted()) return {ExitStatus::interrupted, fmt::format("before {} was compared", pair.name)};
    const render::Picture a = render::read_picture(pair.a), b = render::read_picture(pair.b);
    require_same_size(pair, a, b);
    const render::Difference difference = render::compare(a, b, options.bounds.tolerance);
    const std::string broken = render::broken_bounds(difference, options.bounds);
    print_pair(options, pair, difference, broken);
    if (!pair.difference.empty())
      render::write_png(pair.difference.string(), a.width, a.height, render::difference_picture(a, b).rgb,
                        difference_maker);
    if (broken.empty()) continue;
    ++differing;
    if (difference.rmse > worst) {
      worst = difference.rmse;
      worst_text = fmt::format("{}: {}", pair.name, broken);
    }
  }
  const std::string total = counted(pairs.size(), "picture");
  if (differing == 0) return {ExitStatus::done, fmt::format("{} the same within the bounds", total)};
  return {ExitStatus::differs,
          pairs.size() == 1 ? worst_text : fmt::format("{} of {}; most {}", differing, total, worst_text)};
}

}  // namespace duet::tools
