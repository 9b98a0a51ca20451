// Charts as SVG, drawn by gnuplot, which is looked for when it is needed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace duet::study {

struct ChartPoint {
  double x = 0, y = 0;
  std::string label;
};

struct Series {
  std::string name;
  std::vector<ChartPoint> points;
  bool lines = true;  // else points alone, large
};

struct Chart {
  std::string name;  // of its files
  std::string title, x_label, y_label;
  bool log_x = false, log_y = false;
  bool stacked = false;  // areas, one on the other; all series have the same x
  std::vector<Series> series;
  std::vector<std::string> failed;  // named in the legend
};

// Bars of parts, one on the other: `parts` of each of the `names`.
struct BarChart {
  std::string name, title, y_label;
  std::vector<std::string> names, parts;
  std::vector<std::vector<double>> values;  // [name][part]
};

// Throws FileError with a remedy when gnuplot is not installed.
void require_gnuplot();

// Writes NAME.gp and NAME.svg into the folder; returns the SVG element, fit to stand in an HTML page: its
// identifiers are its own, and it refers to nothing outside. Throws FileError.
std::string draw(const Chart& chart, const std::filesystem::path& folder);
std::string draw(const BarChart& chart, const std::filesystem::path& folder);

}  // namespace duet::study
