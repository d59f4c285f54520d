#pragma once

#include <string>
#include <vector>

#include "report/figure.h"

/// Where the panels of a figure are. All lengths in pixels.
namespace upswing {

inline constexpr int kFontSize = 12;
inline constexpr double kTitleScale = 1.2;  // font of the title over that of the rest
inline constexpr double kLegendLine = 18;   // height of an entry

/// Where a panel's axes are, counted from the figure's lower left corner.
struct Box {
  double left, right, bottom, top;
};

/// Axes of one size, in line with those beside, above and below. Throws BadInput if there is no
/// room for them.
std::vector<Box> Layout(const Figure& figure);

inline constexpr double kCaptionLine = 16;  // height of a line of the caption

/// The caption in lines that fit into the figure's width.
std::vector<std::string> CaptionLines(const Figure& figure);
/// The title, or, where it is too wide, the end of it behind an ellipsis.
std::string FittedTitle(const Figure& figure);

bool HasLegend(const Panel& panel);
/// Height of a heat map's legend, which lies below it; 0 without one.
double LegendBelow(const Panel& panel);
/// Room below a panel's axes that its labels and legend need.
double BottomMargin(const Panel& panel);

}  // namespace upswing
