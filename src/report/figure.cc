#include "report/figure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/text.h"
#include "os/command.h"
#include "os/file.h"
#include "report/layout.h"

namespace upswing {
namespace {

/// The palette of Okabe and Ito (2008), which colour-blind people can distinguish. Yellow is last,
/// because it is faint on white.
constexpr std::array kColors{"#0072B2", "#D55E00", "#009E73", "#CC79A7",
                             "#E69F00", "#56B4E9", "#000000", "#F0E442"};

/// Viridis (van der Walt and Smith, 2015) at 17 points: equal steps look equal, even in grey.
constexpr std::array kViridis{"#440154", "#48186a", "#472d7b", "#424086", "#3b528b", "#33638d",
                              "#2c728e", "#26828e", "#21918c", "#1fa088", "#28ae80", "#3fbc73",
                              "#5ec962", "#84d44b", "#addc30", "#d8e219", "#fde725"};

/// Quotes a text so that gnuplot takes it literally. Within single quotes, only the quote is
/// special.
std::string Quoted(const std::string& text) {
  return Concat("'", Replaced(Printable(text), "'", "''"), "'");
}

std::string Number(double x) { return std::isfinite(x) ? FormatNumber(x) : "NaN"; }

/// Edges of cells: halfway between the centres, and one more than there are centres.
std::vector<double> Edges(const std::vector<double>& centers) {
  std::vector<double> edges;
  const size_t n = centers.size();
  for (size_t i = 0; i + 1 < n; ++i) edges.push_back((centers[i] + centers[i + 1]) / 2);
  const double first = n > 1 ? centers[0] - edges.front() : -0.5;
  const double last = n > 1 ? centers[n - 1] - edges.back() : 0.5;
  edges.insert(edges.begin(), centers[0] + first);
  edges.push_back(centers[n - 1] + last);
  return edges;
}

/// Differences between the two output formats.
struct Terminal {
  std::string name;
  double font;         // font size of text that is kFontSize pixels high
  double legend_line;  // pixels between two entries at spacing 1
  double marker;       // size of markers that look the same in both formats
  std::string cell;    // borders of cells, which hide seams between them
};
const Terminal kSvg{"svg dynamic", kFontSize, 18, 0.75, "noborder"};
// pngcairo measures fonts in points, of which 72 make 96 pixels, and blends edges.
const Terminal kPng{"pngcairo", kFontSize * 0.75, 14, 1, ""};

/// gnuplot commands that draw one panel.
class PanelScript {
 public:
  PanelScript(const Panel& panel, const Box& box, const Figure& figure, const Terminal& terminal)
      : panel_(panel), box_(box), figure_(figure), terminal_(terminal) {
    Data();
    Axes();
    ColorScale();
    Legend();
    Plot();
  }
  const std::string& text() const { return text_; }

 private:
  template <typename... Parts>
  void Say(const Parts&... parts) {
    text_ += Concat(parts...) + '\n';
  }
  std::string ScreenX(double pixel) const { return "screen " + Number(pixel / figure_.width); }
  std::string ScreenY(double pixel) const { return "screen " + Number(pixel / figure_.height); }

  /// Writes the data blocks $L0, $L1, … for the lines and $H for the heat map.
  void Data() {
    for (size_t i = 0; i < panel_.lines.size(); ++i) {
      const Line& line = panel_.lines[i];
      Say("$L", i, " << END");
      for (size_t k = 0; k < line.x.size(); ++k) {
        std::string row = Number(line.x[k]) + ' ' + Number(line.y[k]);
        if (!line.low.empty()) row += ' ' + Number(line.low[k]) + ' ' + Number(line.high[k]);
        has_numbers_ |= std::isfinite(line.x[k]) && std::isfinite(line.y[k]);
        Say(row);
      }
      Say("END");
    }
    if (!panel_.heat_map) return;
    const HeatMap& map = *panel_.heat_map;
    const std::vector<double> x = Edges(map.x);
    const std::vector<double> y = Edges(map.y);
    Say("$H << END");
    for (size_t i = 0; i < map.z.size(); ++i) {
      const size_t row = i / map.x.size();
      const size_t col = i % map.x.size();
      if (!std::isfinite(map.z[i])) continue;
      Say(Number(map.x[col]), ' ', Number(map.y[row]), ' ', Number(x[col]), ' ', Number(x[col + 1]),
          ' ', Number(y[row]), ' ', Number(y[row + 1]), ' ', Number(map.z[i]));
      has_cells_ = true;
    }
    Say("END");
    x_range_ = {x.front(), x.back()};
    y_range_ = {y.front(), y.back()};
  }

  void Axes() {
    Say("set lmargin at ", ScreenX(box_.left), "; set rmargin at ", ScreenX(box_.right));
    Say("set bmargin at ", ScreenY(box_.bottom), "; set tmargin at ", ScreenY(box_.top));
    // Place labels in the margins, so that their distance does not depend on the width of the tick
    // labels.
    Label(2, panel_.title, (box_.left + box_.right) / 2, box_.top + 14, false);
    const double bottom = box_.bottom - BottomMargin(panel_) + LegendBelow(panel_);
    Label(3, panel_.x_label, (box_.left + box_.right) / 2, bottom + 8, false);
    Label(4, panel_.y_label, box_.left - 60, (box_.bottom + box_.top) / 2, true);
    Say("unset label 5");
    Ticks("x", 0);
    Ticks("y", panel_.y_tick);
    // Show large numbers in thousands or millions, so that tick labels do not overlap.
    const double largest = LargestX();
    if (largest < 1e4) Say("set format x");
    if (largest >= 1e4) Say("set format x '", largest < 1e6 ? "%.0s%c" : "%.1s%c", "'");
    Say(panel_.heat_map ? "unset grid" : "set grid back lt 1 lw 0.5 lc rgb '#d8d8d8'");
    Range("x", panel_.x_range, x_range_);
    Range("y", panel_.y_range, y_range_);
    // Draw empty cells in grey.
    Say("unset object 1");
    if (panel_.heat_map) {
      Say("set object 1 rectangle from graph 0,0 to graph 1,1 behind fc rgb '#e4e4e4' fs noborder");
    }
  }

  void Ticks(std::string_view axis, double distance) {
    Say("set ", axis, "tics out nomirror ", distance > 0 ? Number(distance) : "autofreq");
  }

  double LargestX() const {
    double largest = 0;
    for (const Line& line : panel_.lines) {
      for (const double x : line.x) largest = std::max(largest, x);
    }
    return largest;
  }

  void Label(int tag, const std::string& text, double x, double y, bool upright) {
    if (text.empty()) return Say("unset label ", tag);
    Say("set label ", tag, " ", Quoted(text), " at ", ScreenX(x), ',', ScreenY(y), " center",
        upright ? " rotate by 90" : " norotate");
  }

  void Range(std::string_view axis, std::optional<std::pair<double, double>> wanted,
             std::optional<std::pair<double, double>> found) {
    if (!wanted) wanted = found;
    if (!wanted && !has_numbers_) wanted = {0, 1};  // there are no data to take a range from
    if (wanted)
      return Say("set ", axis, "range [", Number(wanted->first), ":", Number(wanted->second), "]");
    Say("set ", axis, "range [*:*]; set autoscale ", axis == "x" ? "xfix" : "y");
  }

  void ColorScale() {
    if (!panel_.heat_map) return;
    const HeatMap& map = *panel_.heat_map;
    const bool fixed = map.low < map.high;
    Say("set cbrange [", fixed ? Number(map.low) : "*", ":", fixed ? Number(map.high) : "*", "]");
    if (!map.bar) return Say("unset colorbox");
    Say("set colorbox user origin ", ScreenX(box_.right + 12), ',', ScreenY(box_.bottom), " size ",
        ScreenX(14), ',', ScreenY(box_.top - box_.bottom), " noborder");
    Say("set cbtics out nomirror scale 0.5");
    Label(5, map.label, box_.right + 84, (box_.bottom + box_.top) / 2, true);
  }

  /// Places the legend next to the axes, or below a heat map, where it hides nothing.
  void Legend() {
    if (!HasLegend(panel_)) return Say("unset key");
    const auto entries =
        std::ranges::count_if(panel_.lines, [](const Line& line) { return !line.name.empty(); });
    const double line =
        std::min(kLegendLine, (box_.top - box_.bottom) / static_cast<double>(entries));
    const std::string style = Concat(" noenhanced Left reverse samplen 1.8 maxrows 99 spacing ",
                                     Number(0.95 * line / terminal_.legend_line));
    if (panel_.heat_map) {
      return Say("set key at ", ScreenX(box_.left), ',',
                 ScreenY(box_.bottom - BottomMargin(panel_) + 4), " left bottom horizontal", style);
    }
    Say("set key at ", ScreenX(box_.right + 8), ',', ScreenY(box_.top), " left top vertical",
        style);
  }

  /// Plots the heat map, then bands, then lines, each above the layers before it.
  void Plot() {
    std::vector<std::string> layers;
    if (has_cells_) {
      layers.push_back(Concat("$H using 1:2:3:4:5:6:7 with boxxyerror fs solid 1 ", terminal_.cell,
                              " lc palette notitle"));
    }
    for (size_t i = 0; i < panel_.lines.size(); ++i) {
      const Line& line = panel_.lines[i];
      if (line.low.empty()) continue;
      layers.push_back(Concat("$L", i, " using 1:3:4 with filledcurves fs transparent solid 0.2 ",
                              "noborder lc rgb '", Color(i), "' notitle"));
    }
    for (size_t i = 0; i < panel_.lines.size(); ++i) AddLine(i, layers);
    if (layers.empty()) layers.emplace_back("NaN notitle");
    Say("plot ", Join(layers, ", \\\n  "));
  }

  void AddLine(size_t i, std::vector<std::string>& layers) const {
    const Line& line = panel_.lines[i];
    if (line.x.empty()) return;
    const std::string title = line.name.empty() ? " notitle" : " title " + Quoted(line.name);
    const std::string color = Concat(" lc rgb '", Color(i), "'");
    if (!line.points) {
      // Dash lines beyond the palette's colours.
      const std::string style = Concat(" with lines lw ", panel_.heat_map ? 1 : 2, color, " dt ");
      const size_t dash = 1 + i / kColors.size() % 4;
      if (!line.dotted_from) {
        layers.push_back(Concat("$L", i, " using 1:2", style, dash, title));
        return;
      }
      const std::string end = Number(*line.dotted_from);
      layers.push_back(Concat("$L", i, " using ($1<=", end, "?$1:NaN):2", style, dash, title));
      layers.push_back(Concat("$L", i, " using ($1>=", end, "?$1:NaN):2", style, 3, " notitle"));
      return;
    }
    int type = 7;
    double size = 0.8;
    if (line.marker == Marker::kSquare) type = 5;
    if (line.marker == Marker::kCross) {
      type = 2;
      size = 1.6;
    }
    if (panel_.heat_map) size = 1;
    const auto add = [&](double points, const std::string& look) {
      layers.push_back(Concat("$L", i, " using 1:2 with points pt ", type, " ps ",
                              points * terminal_.marker, look));
    };
    // Give markers on a heat map a white rim, which separates them from every colour.
    if (panel_.heat_map) add(1.5, " lc rgb 'white' notitle");
    add(size, Concat(" lw 2", color, title));
  }

  /// Colour of line i. On a heat map, red-orange comes first, because viridis does not contain it.
  std::string Color(size_t i) const {
    return kColors[(i + (panel_.heat_map ? 1 : 0)) % kColors.size()];
  }

  const Panel& panel_;
  Box box_;
  const Figure& figure_;
  Terminal terminal_;
  bool has_numbers_ = false, has_cells_ = false;
  std::optional<std::pair<double, double>> x_range_, y_range_;  // ranges of the heat map
  std::string text_;
};

/// The error line of gnuplot's message, without its position in the script.
std::string ErrorIn(const std::string& message) {
  std::string last;
  for (const std::string_view line : Split(message, '\n')) {
    if (!line.empty()) last = line;
    if (const size_t colon = line.find(": "); line.starts_with('"') && colon != line.npos) {
      return std::string(line.substr(colon + 2));
    }
  }
  return last.empty() ? "it said nothing" : last;
}

/// Runs gnuplot on a script and returns its standard output. Does not read the user's gnuplot
/// settings. Throws Failure if gnuplot is missing, or with gnuplot's error message.
std::string RunGnuplot(const std::string& script) {
  // Use /dev/stdin, because gnuplot reads "-" byte by byte.
  const std::optional<CommandResult> done = RunCommand({"gnuplot", "-d", "/dev/stdin"}, script);
  if (!done) {
    throw Failure(
        "figure: expected the program gnuplot (Debian's package gnuplot-nox), found none in PATH");
  }
  if (done->signal != 0) {
    throw Failure(Concat("figure: gnuplot was ended by signal ", done->signal));
  }
  if (done->exit_code != 0) {
    throw Failure(Concat("figure: gnuplot failed: ", ErrorIn(done->errors)));
  }
  return done->output;
}

constexpr size_t kFirstCaptionLabel = 10;  // panels use lower label numbers

std::string Script(const Figure& figure, const Terminal& terminal) {
  std::vector<std::string> palette;
  palette.reserve(kViridis.size());
  for (const char* color : kViridis) palette.push_back(Concat(palette.size(), " '", color, "'"));
  std::string script =
      Concat("set encoding utf8\n", "set terminal ", terminal.name, " noenhanced size ",
             figure.width, ',', figure.height, " font 'sans-serif,", terminal.font,
             "' background rgb 'white'\n", "set border 3 lw 0.8 lc rgb '#404040'\n",
             "set palette maxcolors 256 defined (", Join(palette, ", "), ")\n", "set multiplot\n");
  if (!figure.title.empty()) {
    script += Concat("set label 1 ", Quoted(FittedTitle(figure)), " at screen 0.5, screen ",
                     Number(1 - 16.0 / figure.height), " center font ',",
                     terminal.font * kTitleScale, "'\n");
  }
  const std::vector<std::string> caption = CaptionLines(figure);
  for (size_t i = 0; i < caption.size(); ++i) {
    const double y = (figure.title.empty() ? 14 : 38) + static_cast<double>(i) * kCaptionLine;
    script += Concat("set label ", kFirstCaptionLabel + i, ' ', Quoted(caption[i]),
                     " at screen 0.5, screen ", Number(1 - y / figure.height),
                     " center textcolor rgb '#404040'\n");
  }
  const std::vector<Box> boxes = Layout(figure);
  for (size_t i = 0; i < boxes.size(); ++i) {
    script += PanelScript(figure.panels[i], boxes[i], figure, terminal).text();
    // Draw the figure's title and caption only once.
    script += "unset label 1\n";
    for (size_t k = 0; k < caption.size(); ++k) {
      script += Concat("unset label ", kFirstCaptionLabel + k, '\n');
    }
  }
  return script + "unset multiplot\n";
}

}  // namespace

void CheckCanDraw() { RunGnuplot(""); }

void CheckFigureName(const std::filesystem::path& file) {
  if (file.extension() == ".svg" || file.extension() == ".png") return;
  throw BadInput(Concat(file.string(), ": expected a name that ends with .svg or .png"));
}

void Draw(const Figure& figure, const std::filesystem::path& file) {
  CheckFigureName(file);
  WriteFileAtomically(file, RunGnuplot(Script(figure, file.extension() == ".svg" ? kSvg : kPng)));
}

std::vector<std::string> DrawIfPossible(const Figure& figure, const std::filesystem::path& name) {
  try {
    CheckCanDraw();
  } catch (const Error&) {
    return {};
  }
  std::vector<std::string> files{name.string() + ".svg", name.string() + ".png"};
  for (const std::string& file : files) Draw(figure, file);
  return files;
}

}  // namespace upswing
