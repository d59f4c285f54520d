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
  std::string name = {};                    // name in the legend; empty: no entry
  std::vector<double> x = {}, y = {};       // (n)
  std::vector<double> low = {}, high = {};  // (n) band around the line; empty: none
  bool points = false;                      // whether to draw markers in place of a line
  Marker marker = Marker::kDot;
  std::optional<double> dotted_from = {};  // x from which the line is dotted
};

/// A table of numbers as colours. Cell (i, j) lies around (x[j], y[i]); x and y increase.
struct HeatMap {
  std::vector<double> x = {}, y = {};  // (nx), (ny) centres of the cells
  std::vector<double> z = {};          // (ny × nx); NaN: an empty cell
  std::string label = {};              // label of the colour bar
  double low = 0, high = 0;            // colour range; low ≥ high: the range of z
  bool bar = true;  // whether to draw the colour bar; panels in a row can share one
};

/// One pair of axes. Lines lie above the heat map.
struct Panel {
  std::string title = {}, x_label = {}, y_label = {};
  std::vector<Line> lines = {};
  std::optional<HeatMap> heat_map = {};
  std::optional<std::pair<double, double>> x_range = {}, y_range = {};  // nothing: of the data
  double y_tick = 0;  // distance between ticks; 0: chosen by gnuplot
};

/// Panels with aligned axes, row by row, with `columns` panels per row.
struct Figure {
  std::string title = {};  // one line; a title that is too long shows only its end
  std::vector<Panel> panels = {};
  int columns = 1;
  int width = 900, height = 600;  // pixels
  std::string caption = {};       // text below the title, wrapped into lines
};

/// Throws Failure if figures cannot be drawn. Call it before long work that is nothing without its
/// figures.
void CheckCanDraw();

/// Throws BadInput unless the name ends with .svg or .png.
void CheckFigureName(const std::filesystem::path& file);

/// Draws a figure and atomically writes it as .svg or .png, by the ending. Texts appear literally;
/// escapes replace unprintable characters (see Printable). Throws BadInput for another ending.
/// Throws Failure if gnuplot is missing or fails.
void Draw(const Figure& figure, const std::filesystem::path& file);

/// Draws a figure as NAME.svg and NAME.png and returns these files; none if CheckCanDraw throws.
std::vector<std::string> DrawIfPossible(const Figure& figure, const std::filesystem::path& name);

}  // namespace upswing
