#pragma once

#include <string>
#include <vector>

#include "report/figure.h"

/// The layout of a figure. All lengths are in pixels.
namespace upswing {

inline constexpr int kFontSize = 12;
inline constexpr double kTitleScale = 1.2;  // font of the title over that of the rest
inline constexpr double kLegendLine = 18;   // height of an entry

/// The area of a panel's axes, from the figure's lower left corner.
struct Box {
  double left, right, bottom, top;
};

/// The axes of each panel: of one size, and aligned in rows and columns. Throws BadInput if they do
/// not fit.
std::vector<Box> Layout(const Figure& figure);

inline constexpr double kCaptionLine = 16;  // height of a line of the caption

/// The caption, broken into lines that fit the figure's width.
std::vector<std::string> CaptionLines(const Figure& figure);
/// The title; of one that is too wide, its end after an ellipsis.
std::string FittedTitle(const Figure& figure);

/// Whether a line of the panel has a name.
bool HasLegend(const Panel& panel);
/// Height of a heat map's legend, which lies below it; 0 without one.
double LegendBelow(const Panel& panel);
/// Space that labels and legend need below a panel's axes.
double BottomMargin(const Panel& panel);

}  // namespace upswing
