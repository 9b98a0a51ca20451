#include "tools/study/charts.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/error.h"
#include "sim/base/files.h"
#include "sim/base/printable.h"
#include "sim/io/run_directory.h"

namespace duet::study {
namespace {

namespace fs = std::filesystem;

// Each line has its own marks and dashes, so that lines can be told apart in print as well. The first
// seven colors are those of Okabe and Ito, which people with color blindness can tell apart.
constexpr const char* styles =
    "set linetype 1 lc rgb '#0072B2' lw 2 pt 7 dt 1\n"
    "set linetype 2 lc rgb '#D55E00' lw 2 pt 5 dt 2\n"
    "set linetype 3 lc rgb '#009E73' lw 2 pt 9 dt 4\n"
    "set linetype 4 lc rgb '#CC79A7' lw 2 pt 11 dt 3\n"
    "set linetype 5 lc rgb '#E69F00' lw 2 pt 13 dt 5\n"
    "set linetype 6 lc rgb '#56B4E9' lw 2 pt 15 dt 1\n"
    "set linetype 7 lc rgb '#000000' lw 2 pt 4 dt 2\n"
    "set linetype 8 lc rgb '#8C6D31' lw 2 pt 6 dt 4\n"
    "set linetype 9 lc rgb '#7B1FA2' lw 2 pt 8 dt 1\n"
    "set linetype 10 lc rgb '#5D6D7E' lw 2 pt 10 dt 2\n"
    "set linetype cycle 10\n";

// Returns the path of a program in PATH; empty if there is none.
std::string found_in_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (const fs::path candidate = fs::path(folder) / program; ::access(candidate.c_str(), X_OK) == 0)
      return candidate.string();
  return {};
}

// Returns a gnuplot string in single quotes, in which backquotes, `$`, `@` and backslashes have no special
// meaning. `_`, `^` and others have none because texts are not "enhanced".
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : printable_line(text)) result += c == '\'' ? std::string("''") : std::string(1, c);
  return result + "'";
}

// Returns a column of a data block. Double quotes enclose it, and gnuplot knows no way to write one inside: a
// typographic quote replaces it.
std::string column(const std::string& text) {
  std::string result = "\"";
  for (const char c : printable_line(text)) result += c == '"' ? "\u201d" : std::string(1, c);
  return result + '"';
}

// Runs gnuplot in the folder of the script. The path of the folder is no part of what gnuplot reads, because
// file names have special meanings there, such as a pipe to a command. Throws FileError with its messages if
// it fails.
void run_gnuplot(const fs::path& script) {
  require_gnuplot();
  const std::string program = fs::absolute(found_in_path("gnuplot")).string();
  const std::string folder = script.parent_path().string();
  const std::string log_name = script.filename().string() + ".log";
  posix_spawn_file_actions_t files;
  ::posix_spawn_file_actions_init(&files);
  ::posix_spawn_file_actions_addchdir_np(&files, folder.c_str());
  ::posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  ::posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log_name.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                     0666);
  ::posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  std::string name = "gnuplot", argument = script.filename().string();
  char* argv[] = {name.data(), argument.data(), nullptr};
  pid_t process = -1;
  const int failure = ::posix_spawn(&process, program.c_str(), &files, nullptr, argv, ::environ);
  ::posix_spawn_file_actions_destroy(&files);
  if (failure != 0) throw io::system_error(program, "cannot run", failure);
  int status = 0;
  while (::waitpid(process, &status, 0) < 0 && errno == EINTR) continue;
  const fs::path log = script.parent_path() / log_name;
  if (status != 0) throw FileError(script.string(), "gnuplot failed: " + io::read_file(log));
  io::remove_file(log);
}

// Returns the SVG element of a file without the prolog and the namespaces, which HTML implies.
std::string element_of(const fs::path& file) {
  std::string svg = io::read_file(file);
  const std::size_t begin = svg.find("<svg"), end = svg.find('>', begin);
  if (begin == std::string::npos || end == std::string::npos)
    throw FileError(file.string(), "gnuplot wrote no SVG picture");
  std::string opening = svg.substr(begin, end - begin);
  for (const char* name : {"xmlns=", "xmlns:xlink="})
    if (const std::size_t at = opening.find(name); at != std::string::npos)
      opening.erase(at, opening.find('"', opening.find('"', at) + 1) + 1 - at);
  return opening + svg.substr(end);
}

// Returns the beginning of a script, which all charts share. `height` is in pixels.
std::string begin_script(const std::string& name, const std::string& title, const std::string& y_label,
                         int height) {
  return fmt::format(
      "set terminal svg noenhanced size 900,{} font 'sans-serif,13' background rgb 'white' name {}\n"
      "set output {}\n{}set encoding utf8\nset title {}\nset ylabel {}\nset grid lc rgb '#dddddd' lw 1\n",
      height, quoted(name), quoted(name + ".svg"), styles, quoted(title), quoted(y_label));
}

// Writes the script, runs gnuplot and returns the SVG element.
std::string finish(const std::string& name, const std::string& script, const fs::path& folder) {
  io::create_folder(folder);
  const fs::path file = folder / (name + ".gp");
  io::write_atomically(file, script);
  run_gnuplot(file);
  return element_of(folder / (name + ".svg"));
}

// Returns whether a point has finite coordinates, positive ones on logarithmic axes.
bool drawable(const Chart& chart, const ChartPoint& point) {
  return std::isfinite(point.x) && std::isfinite(point.y) && (!chart.log_x || point.x > 0) &&
         (!chart.log_y || point.y > 0);
}

// The range of a coordinate over all points of a chart; empty at first.
struct Range {
  double low = INFINITY, high = -INFINITY;
  void extend(double value) { low = std::min(low, value), high = std::max(high, value); }
  // Returns the place of a value between the ends, from 0 to 1.
  double place(double value, bool logarithmic) const {
    if (high <= low) return 0.5;
    return logarithmic ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  }
};

struct Ranges {
  Range x, y;
};

Ranges ranges_of(const Chart& chart) {
  Ranges ranges;
  for (const Series& series : chart.series)
    for (const ChartPoint& point : series.points)
      if (drawable(chart, point)) {
        ranges.x.extend(point.x);
        ranges.y.extend(point.y);
      }
  return ranges;
}

// Returns tics at 1, 2 and 5 times the powers of ten for a logarithmic axis that spans less than a factor of
// 50: powers of ten alone would be too few to read values at. Empty for a longer axis.
std::string ticks(const char* axis, double low, double high) {
  if (high / low > 50) return {};
  std::string places;
  for (double power = std::pow(10, std::floor(std::log10(low))); power < high; power *= 10)
    for (const double digit : {1.0, 2.0, 5.0})
      if (digit * power >= low && digit * power <= high)
        places +=
            fmt::format("{}\"{:.6g}\" {:.6g}", places.empty() ? "" : ", ", digit * power, digit * power);
  return fmt::format("set {}tics ({})\n", axis, places);
}

// Returns a logarithmic axis that extends beyond the outermost points by the factors `below` and `above`, to
// leave room for their labels.
std::string logarithmic_axis(const char* axis, const Range& range, double below, double above,
                             const char* format) {
  const double low = range.low / below, high = range.high * above;
  return fmt::format("set logscale {0}\nset format {0} '{1}'\nset {0}range [{2}:{3}]\n", axis, format, low,
                     high) +
         ticks(axis, low, high);
}

std::string axes(const Chart& chart, const Ranges& ranges) {
  if (!(ranges.x.low <= ranges.x.high)) return "set xrange [1:10]\nset yrange [1:10]\n";
  std::string text;
  if (chart.log_x) text += logarithmic_axis("x", ranges.x, 1.6, 2.2, "%g");
  if (chart.log_y) text += logarithmic_axis("y", ranges.y, 2, 3, "%.0e");
  return text;
}

// Chooses the labels that do not write over an earlier one.
class Labels {
 public:
  Labels(const Chart& chart, const Ranges& ranges) : chart_(chart), ranges_(ranges) {}

  bool has_room(const ChartPoint& point) {
    constexpr double width = 0.09, height = 0.04;  // of a label, over those of the chart
    const double x = ranges_.x.place(point.x, chart_.log_x), y = ranges_.y.place(point.y, chart_.log_y);
    for (const auto& [other_x, other_y] : taken_)
      if (std::abs(x - other_x) < width && std::abs(y - other_y) < height) return false;
    taken_.emplace_back(x, y);
    return true;
  }

 private:
  const Chart& chart_;
  const Ranges& ranges_;
  std::vector<std::pair<double, double>> taken_;
};

// Adds the data of all series to the script, and returns the plot commands.
std::string line_plots(const Chart& chart, const Ranges& ranges, std::string& script) {
  Labels labels(chart, ranges);
  std::string plots;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& series = chart.series[i];
    std::string data;
    bool labelled = false;
    for (const ChartPoint& point : series.points) {
      if (!drawable(chart, point)) continue;
      labelled |= !point.label.empty();
      data += fmt::format("{:.9g} {:.9g} {}\n", point.x, point.y,
                          column(!point.label.empty() && labels.has_room(point) ? point.label : ""));
    }
    if (data.empty()) continue;
    script += fmt::format("$data{} << END_OF_DATA\n{}END_OF_DATA\n", i, data);
    plots += fmt::format(", $data{} using 1:2 {} title {}", i,
                         !series.lines
                             ? "with points pt 12 ps 2.2 lw 3 lc rgb 'black'"
                             : fmt::format("with {} lt {}", labelled ? "linespoints ps 0.8" : "lines", i + 1),
                         quoted(series.name));
    if (labelled)
      plots += fmt::format(
          ", $data{} using 1:2:3 with labels left offset 0.8,0.4 font ',10' textcolor rgb '#444444' notitle",
          i);
  }
  return plots;
}

// Plots each series on top of the sum of those before it. The highest comes first, so that lower ones cover
// it.
std::string stacked_plots(const Chart& chart, std::string& script) {
  std::string plots;
  std::vector<double> sum;
  for (std::size_t i = 0; i < chart.series.size(); ++i) {
    const Series& series = chart.series[i];
    sum.resize(series.points.size(), 0);
    script += fmt::format("$data{} << END_OF_DATA\n", i);
    for (std::size_t k = 0; k < series.points.size(); ++k)
      script += fmt::format("{:.9g} {:.9g}\n", series.points[k].x, sum[k] += series.points[k].y);
    script += "END_OF_DATA\n";
    plots.insert(0, fmt::format(", $data{} using 1:2 with filledcurves x1 lt {} lw 0 title {}", i, i + 1,
                                quoted(series.name)));
  }
  return plots;
}

}  // namespace

void require_gnuplot() {
  if (found_in_path("gnuplot").empty())
    throw FileError("gnuplot", "is not installed, and draws the charts",
                    "install Debian's package gnuplot-nox");
}

std::string draw(const Chart& chart, const fs::path& folder) {
  std::string script = begin_script(chart.name, chart.title, chart.y_label, 480);
  const Ranges ranges = ranges_of(chart);
  script += fmt::format(
      "set xlabel {}\nset rmargin at screen 0.66\nset key at screen 0.67, screen 0.93 left top vertical Left "
      "reverse\n{}",
      quoted(chart.x_label), axes(chart, ranges));
  script += chart.stacked ? "set yrange [0:*]\nset style fill solid 0.85 noborder\n" : "";
  std::string plots = "plot NaN notitle";  // gnuplot does not accept a legend without a plot
  plots += chart.stacked ? stacked_plots(chart, script) : line_plots(chart, ranges, script);
  for (const std::string& failed : chart.failed)
    plots += fmt::format(", keyentry with points pt 2 ps 1.4 lw 2 lc rgb '#CC0000' title {}",
                         quoted("failed: " + failed));
  return finish(chart.name, script + plots + "\n", folder);
}

std::string draw(const BarChart& chart, const fs::path& folder) {
  std::string script = begin_script(chart.name, chart.title, chart.y_label, 560);
  script +=
      "set style data histograms\nset style histogram rowstacked\nset style fill solid 0.85 border rgb "
      "'white'\n"
      "set boxwidth 0.75\nset bmargin 10\nset xtics rotate by -35 font ',11'\nset key outside right top "
      "reverse Left font "
      "',11' invert\n"
      "set yrange [0:*]\nset grid noxtics\n$data << END_OF_DATA\n";
  for (std::size_t i = 0; i < chart.names.size(); ++i) {
    script += column(chart.names[i]);
    for (const double value : chart.values[i]) script += fmt::format(" {:.9g}", value);
    script += '\n';
  }
  script += "END_OF_DATA\nplot ";
  for (std::size_t k = 0; k < chart.parts.size(); ++k)
    script += fmt::format("{}$data using {}{} title {} lt {} lw 1 dt 1", k > 0 ? ", " : "", k + 2,
                          k == 0 ? ":xtic(1)" : "", quoted(chart.parts[k]), k + 1);
  return finish(chart.name, script + "\n", folder);
}

}  // namespace duet::study
