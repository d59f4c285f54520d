#pragma once

#include <string>
#include <vector>

#include "report/figure.h"

/// The layout of a figure. All lengths are in pixels.
namespace upswing {

inline constexpr int kFontSize = 12;
inline constexpr double kTitleScale = 1.2;  // ratio of title font to the other fonts
inline constexpr double kLegendLine = 18;   // height of a legend entry

/// The area of a panel's axes, measured from the figure's lower left corner.
struct Box {
  double left, right, bottom, top;
};

/// The axes of each panel: all of the same size, and aligned in rows and columns. Throws BadInput
/// if they do not fit.
std::vector<Box> Layout(const Figure& figure);

inline constexpr double kCaptionLine = 16;  // height of a caption line

/// The caption in lines that fit the figure's width.
std::vector<std::string> CaptionLines(const Figure& figure);
/// The title; if it is too wide, an ellipsis and its end.
std::string FittedTitle(const Figure& figure);

/// Whether the panel needs a legend: one of its lines has a name.
bool HasLegend(const Panel& panel);
/// Height of the legend below a heat map; 0 without a heat map or a legend.
double LegendBelow(const Panel& panel);
/// Space for labels and legend below a panel's axes.
double BottomMargin(const Panel& panel);

}  // namespace upswing
