#include "extras/view/painter.h"

#include <algorithm>
#include <cmath>
#include <mutex>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

/// `text` in printable ASCII and short enough for a picture; MuJoCo's fonts have no other
/// characters.
std::string Ascii(std::string_view text) {
  constexpr size_t kMost = 60;
  std::string out;
  for (const char c : text.substr(0, kMost)) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 && byte < 0xC0) continue;  // not the first byte of its character
    out += byte >= 0x20 && byte < 0x7F ? c : '?';
  }
  return out;
}

/// The font size for pictures `height` pixels high.
mjtFontScale FontFor(int height) {
  if (height < 380) return mjFONTSCALE_50;
  if (height < 900) return mjFONTSCALE_100;
  return height < 1600 ? mjFONTSCALE_150 : mjFONTSCALE_200;
}

}  // namespace

int PanelColumns(int count, int width, int height) {
  // Choose the grid with the largest panels, each counted as a square.
  int best = 1;
  double largest = 0;
  for (int columns = 1; columns <= count; ++columns) {
    const int rows = (count + columns - 1) / columns;
    const double side =
        std::min(static_cast<double>(width) / columns, static_cast<double>(height) / rows);
    if (side <= largest) continue;
    largest = side;
    best = columns;
  }
  return best;
}

mjrRect PanelPlace(int index, int count, int width, int height) {
  const int columns = PanelColumns(count, width, height);
  const int rows = (count + columns - 1) / columns;
  const int column = index % columns, row = index / columns;
  // Panels share their edges, so that no pixel is left out. An incomplete last row is stretched.
  const int in_row = row == rows - 1 ? count - row * columns : columns;
  const int left = width * column / in_row, right = width * (column + 1) / in_row;
  const int top = height * row / rows, bottom = height * (row + 1) / rows;
  return {left, height - bottom, right - left, bottom - top};
}

Painter::Painter(const mjModel& model, mjtFramebuffer buffer, int width, int height)
    : context_(std::make_unique<mjrContext>()) {
  // MuJoCo keeps OpenGL's functions in global variables.
  static std::mutex making;
  const std::lock_guard lock(making);
  mjr_defaultContext(context_.get());
  mjr_makeContext(&model, context_.get(), FontFor(height));
  mjr_setBuffer(buffer, context_.get());
  if (context_->currentBuffer != buffer) {
    mjr_freeContext(context_.get());
    throw Failure("OpenGL has no buffer to draw a picture into");
  }
  if (buffer == mjFB_OFFSCREEN) mjr_resizeOffscreen(width, height, context_.get());
}

Painter::~Painter() { mjr_freeContext(context_.get()); }

void Painter::Draw(std::span<const ScenePanel> panels, int width, int height) const {
  const auto count = static_cast<int>(panels.size());
  for (int i = 0; i < count; ++i) {
    const ScenePanel& panel = panels[static_cast<size_t>(i)];
    const mjrRect place = PanelPlace(i, count, width, height);
    mjr_render(place, &panel.scene->scene(), context_.get());
    if (!panel.title.empty()) {
      const std::array<std::string, 2> line{panel.title, ""};
      Write(mjGRID_TOPLEFT, std::span(&line, 1), place);
    }
    Write(mjGRID_BOTTOMLEFT, panel.status, place);
  }
}

void Painter::Write(mjtGridPos corner, std::span<const std::array<std::string, 2>> lines,
                    mjrRect place) const {
  if (lines.empty()) return;
  std::vector<std::string> names, values;
  bool any_value = false;
  for (const auto& [name, value] : lines) {
    names.push_back(Ascii(name));
    values.push_back(Ascii(value));
    any_value = any_value || !value.empty();
  }
  const std::string right = Join(values, "\n");
  mjr_overlay(mjFONT_NORMAL, corner, place, Join(names, "\n").c_str(),
              any_value ? right.c_str() : nullptr, context_.get());
}

}  // namespace upswing
