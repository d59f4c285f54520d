#include "report/layout.h"

#include <algorithm>
#include <string_view>

#include "base/error.h"
#include "base/format.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr double kCharacter = 7.2;    // mean width of a character at kFontSize
constexpr double kLegendSample = 44;  // width of the line sample in a legend
constexpr double kTitleHeight = 28;

/// Number of characters at font scale `scale` that fit the figure's width.
size_t CharactersIn(const Figure& figure, double scale) {
  return static_cast<size_t>((figure.width - 32) / (scale * kCharacter));
}

double LegendWidth(const Panel& panel) {
  size_t longest = 0;
  for (const Line& line : panel.lines) longest = std::max(longest, Columns(line.name));
  return kLegendSample + kCharacter * static_cast<double>(longest);
}

/// Space around the axes of a panel, pixels.
struct Margins {
  double left = 0, right = 0, top = 0, bottom = 0;

  void Include(const Margins& other) {
    left = std::max(left, other.left);
    right = std::max(right, other.right);
    top = std::max(top, other.top);
    bottom = std::max(bottom, other.bottom);
  }
};

Margins MarginsOf(const Panel& panel) {
  Margins m{54, 18, 12, 29};
  if (!panel.y_label.empty()) m.left += 20;
  if (!panel.x_label.empty()) m.bottom += 18;
  if (!panel.title.empty()) m.top += 18;
  if (panel.heat_map) {
    const double bar = panel.heat_map->label.empty() ? 76 : 98;
    if (panel.heat_map->bar) m.right = bar;
    m.bottom += LegendBelow(panel);
  } else if (HasLegend(panel)) {
    m.right = 12 + LegendWidth(panel);
  }
  return m;
}

}  // namespace

std::vector<std::string> CaptionLines(const Figure& figure) {
  if (figure.caption.empty()) return {};
  const std::string text = WrapText(figure.caption, CharactersIn(figure, 1));
  const std::vector<std::string_view> lines = Split(text, '\n');
  return {lines.begin(), lines.end()};
}

std::string FittedTitle(const Figure& figure) {
  return Shortened(figure.title, CharactersIn(figure, kTitleScale));
}

bool HasLegend(const Panel& panel) {
  return std::ranges::any_of(panel.lines, [](const Line& line) { return !line.name.empty(); });
}

double LegendBelow(const Panel& panel) {
  return panel.heat_map && HasLegend(panel) ? kLegendLine + 4 : 0;
}

double BottomMargin(const Panel& panel) { return MarginsOf(panel).bottom; }

std::vector<Box> Layout(const Figure& figure) {
  const auto columns = static_cast<size_t>(std::max(1, figure.columns));
  const size_t rows = (figure.panels.size() + columns - 1) / columns;
  std::vector<Margins> column(columns), row(rows);
  for (size_t i = 0; i < figure.panels.size(); ++i) {
    column[i % columns].Include(MarginsOf(figure.panels[i]));
    row[i / columns].Include(MarginsOf(figure.panels[i]));
  }
  double width = figure.width;
  double height = figure.height - (figure.title.empty() ? 0 : kTitleHeight);
  if (const auto lines = CaptionLines(figure).size(); lines > 0) {
    height -= static_cast<double>(lines) * kCaptionLine + (figure.title.empty() ? 12 : 6);
  }
  double top = height;
  for (const Margins& m : column) width -= m.left + m.right;
  for (const Margins& m : row) height -= m.top + m.bottom;
  width /= static_cast<double>(columns);
  height /= static_cast<double>(rows);
  if (width < 20 || height < 20) {
    throw BadInput(Concat("figure: expected more space for ", rows, " × ", columns, " panels than ",
                          figure.width, " × ", figure.height, " pixels"));
  }

  std::vector<Box> boxes;
  for (size_t i = 0; i < figure.panels.size(); ++i) {
    const Margins& m = row[i / columns];
    double left = column[i % columns].left;
    for (size_t j = 0; j < i % columns; ++j) left += column[j].left + column[j].right + width;
    if (i % columns == 0 && i > 0) {
      const Margins& above = row[i / columns - 1];
      top -= above.top + height + above.bottom;
    }
    boxes.push_back({left, left + width, top - m.top - height, top - m.top});
  }
  return boxes;
}

}  // namespace upswing
