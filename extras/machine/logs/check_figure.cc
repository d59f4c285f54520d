// The figure of a log and its findings.
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "extras/machine/logs/check.h"
#include "report/figure.h"

namespace upswing::machine {
namespace {

constexpr int kMostPoints = 4000;  // of a line
constexpr double kGap = std::numeric_limits<double>::quiet_NaN();

/// A quantity as a line; pieces are apart.
template <typename Value>
Line LineOf(const std::string& name, Pieces pieces, const Value& value) {
  int rows = 0;
  for (const MachineLog& piece : pieces) rows += piece.rows();
  const int step = std::max(1, rows / kMostPoints);
  Line line{.name = name};
  for (const MachineLog& piece : pieces) {
    for (int k = 1; k < piece.rows(); k += step) {
      line.x.push_back(piece.time[k]);
      line.y.push_back(value(piece, k));
    }
    line.x.push_back(kGap);
    line.y.push_back(kGap);
  }
  return line;
}

/// The rows of findings with a severity, as marks on a line's height.
template <typename Value>
void Mark(Panel& panel, const LogCheck& check, Pieces pieces, std::initializer_list<Aspect> aspects,
          const Value& value) {
  for (const Severity severity : {Severity::kWarning, Severity::kFault}) {
    Line marks{.name = NameOf(severity),
               .points = true,
               .marker = severity == Severity::kFault ? Marker::kCross : Marker::kSquare};
    for (const Finding& finding : check.findings) {
      if (finding.severity != severity || !finding.rows) continue;
      if (std::ranges::count(aspects, finding.aspect) == 0) continue;
      for (const MachineLog& piece : pieces) {
        const int first = std::max(finding.rows->first - piece.first_row, 1);
        const int last = std::min(finding.rows->last - piece.first_row, piece.rows() - 1);
        for (int k = first; k <= last; k += std::max(1, (last - first) / 50)) {
          marks.x.push_back(piece.time[k]);
          marks.y.push_back(value(piece, k, std::max(finding.joint - 1, 0)));
        }
      }
    }
    if (!marks.x.empty()) panel.lines.push_back(std::move(marks));
  }
}

/// A quantity of both joints, and the beginning of the names of its lines.
struct Quantity {
  const char* prefix;
  std::vector<Joints> MachineLog::*values;
};

/// A panel with those of the quantities that the log has.
Panel PanelOf(const char* title, const char* label, Pieces pieces,
              std::initializer_list<Quantity> quantities) {
  Panel panel{.title = title, .x_label = "time (s)", .y_label = label};
  for (const Quantity& q : quantities) {
    if ((pieces.front().*q.values).empty()) continue;
    for (const int joint : {0, 1}) {
      panel.lines.push_back(
          LineOf(Concat(q.prefix, joint + 1), pieces,
                 [&](const MachineLog& log, int k) { return (log.*q.values)[k][joint]; }));
    }
  }
  return panel;
}

/// The warnings and faults in words.
std::string CaptionOf(const LogCheck& check) {
  std::vector<std::string> texts;
  for (const Finding& finding : check.findings) {
    if (finding.severity == Severity::kNote) continue;
    texts.push_back(
        Concat(AboutText(finding), ": ", finding.text, " (", NameOf(finding.severity), ")"));
  }
  return texts.empty() ? "no warning and no fault" : Join(texts, "; ");
}

}  // namespace

void DrawCheck(const LogCheck& check, Pieces pieces, const std::filesystem::path& file) {
  Figure figure{.title = check.name, .width = 1100, .caption = CaptionOf(check)};
  const auto add = [&](Panel panel, std::initializer_list<Aspect> marked,
                       std::vector<Joints> MachineLog::*values) {
    if (panel.lines.empty()) return;
    Mark(panel, check, pieces, marked,
         [values](const MachineLog& log, int k, int joint) { return (log.*values)[k][joint]; });
    figure.panels.push_back(std::move(panel));
  };
  add(PanelOf("angles", "rad", pieces, {{"joint ", &MachineLog::angle}}),
      {Aspect::kAngle, Aspect::kMotion}, &MachineLog::angle);
  add(PanelOf("velocities", "rad/s", pieces, {{"joint ", &MachineLog::velocity}}),
      {Aspect::kVelocity}, &MachineLog::velocity);
  add(PanelOf("torques", "N·m", pieces,
              {{"commanded ", &MachineLog::commanded}, {"measured ", &MachineLog::measured}}),
      {}, &MachineLog::commanded);
  const auto cycle = [](const MachineLog& log, int k) {
    return 1e3 * (log.time[k] - log.time[k - 1]);
  };
  Panel cycles = PanelOf("cycles", "ms", pieces, {});
  cycles.lines.push_back(LineOf("", pieces, cycle));
  double longest = 0;
  for (const double ms : cycles.lines.back().y) longest = std::fmax(longest, ms);
  if (longest > 0) cycles.y_range = {0, 1.1 * longest};
  Mark(cycles, check, pieces, {Aspect::kClock},
       [&](const MachineLog& log, int k, int /*joint*/) { return cycle(log, k); });
  figure.panels.push_back(std::move(cycles));
  figure.height = 100 + 230 * static_cast<int>(figure.panels.size());
  Draw(figure, file);
}

}  // namespace upswing::machine
