// Draws charts as SVG by gnuplot, which is looked up when it is needed.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace duet::study {

// A point of a series. `label` is written beside it if there is room.
struct ChartPoint {
  // Coordinates in the units of the axes. Values that a logarithmic axis cannot show are left out.
  double x = 0, y = 0;
  std::string label;
};

// Points that share a color and an entry of the legend.
struct Series {
  std::string name;
  std::vector<ChartPoint> points;  // in the order in which lines connect them
  bool lines = true;               // connect the points; else large single points
};

// A chart of series over x and y.
struct Chart {
  std::string name;                     // name of its files, without extension
  std::string title, x_label, y_label;  // texts above the chart and at its axes
  bool log_x = false, log_y = false;    // logarithmic axes
  bool stacked = false;                 // areas on top of each other; all series have the same x
  std::vector<Series> series;           // lines in the order of the legend
  std::vector<std::string> failed;      // settings that failed, named in the legend
};

// A chart of stacked bars: one bar for each of `names`, divided into `parts`.
struct BarChart {
  std::string name, title, y_label;         // as in Chart
  std::vector<std::string> names, parts;    // texts below the bars; entries of the legend
  std::vector<std::vector<double>> values;  // by name, then by part
};

// Throws FileError with a remedy if gnuplot is not installed.
void require_gnuplot();

// Writes NAME.gp and NAME.svg into `folder` and returns the SVG element for use in an HTML page: its
// identifiers are unique to it, and it refers to nothing outside. Throws FileError.
std::string draw(const Chart& chart, const std::filesystem::path& folder);
// Draws a chart of bars; files, result and errors are those of the overload for Chart.
std::string draw(const BarChart& chart, const std::filesystem::path& folder);

}  // namespace duet::study
