#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace upswing {

enum class Marker { kDot, kSquare, kCross };

/// One curve of a panel. Numbers that are not finite leave a gap.
struct Line {
  std::string name;               // in the legend; empty: none
  std::vector<double> x, y;       // (n)
  std::vector<double> low, high;  // (n) a band around the line, error bars of points; empty: none
  bool points = false;            // markers instead of a line
  Marker marker = Marker::kDot;
  std::optional<double> dotted_from = {};  // the x from which the line is dotted
};

/// A table of numbers as colours, cell (i, j) around (x[j], y[i]); x and y rise.
struct HeatMap {
  std::vector<double> x, y;  // (nx), (ny) centres of the cells
  std::vector<double> z;     // (ny × nx); NaN: an empty cell
  std::string label;         // of the colour bar
  double low = 0, high = 0;  // colour range; where low ≥ high, that of the numbers
  bool bar = true;           // the colour bar; a row of panels with the same colours needs but one
};

/// One pair of axes. Lines lie above the heat map.
struct Panel {
  std::string title, x_label, y_label;
  std::vector<Line> lines;
  std::optional<HeatMap> heat_map;
  std::optional<std::pair<double, double>> x_range, y_range;  // none: by the data
  double x_tick = 0, y_tick = 0;  // distance of the ticks; 0: chosen by gnuplot
};

/// Panels row by row, `columns` in each, with aligned axes.
struct Figure {
  std::string title;  // one line; of a title that is too long, its end is shown
  std::vector<Panel> panels;
  int columns = 1;
  int width = 900, height = 600;  // pixels
  std::string caption = {};       // below the title, on as many lines as it needs
};

/// Throws Failure if figures cannot be drawn: gnuplot is missing or broken. To be called before
/// long work whose result will be drawn.
void CheckCanDraw();

/// Throws BadInput unless the name ends with .svg or .png.
void CheckFigureName(const std::filesystem::path& file);

/// Writes .svg or .png, by the ending, atomically. Texts are drawn literally, unprintable
/// characters as escapes (see Printable). Throws BadInput on another ending, Failure if gnuplot is
/// missing or fails.
void Draw(const Figure& figure, const std::filesystem::path& file);

}  // namespace upswing
