#include "extras/view/offscreen.h"

#include <algorithm>
#include <optional>

#include "base/error.h"
#include "base/text.h"
#include "extras/view/egl.h"
#include "extras/view/painter.h"

namespace upswing {
PictureSize CheckedSize(PictureSize size) {
  for (const int pixels : {size.width, size.height}) {
    if (pixels < kLeastPixels || pixels > kMostPixels) {
      throw BadInput(Concat("picture: expected a width and a height of ", kLeastPixels, " to ",
                            kMostPixels, " pixels, got ", size.width, "x", size.height));
    }
  }
  return size;
}

struct Offscreen::Graphics {
  EglContext context;
  std::optional<Painter> painter;

  explicit Graphics(PictureSize size) {
    // The renderer only needs what all scenes share: floor, sky and light.
    PendulumScene room{Plant(), ""};
    const EglContext::Use use(context);
    painter.emplace(room.model(), mjFB_OFFSCREEN, size.width, size.height);
  }
  ~Graphics() {
    try {
      const EglContext::Use use(context);
      painter.reset();
    } catch (const Error&) {  // the driver is gone, and its resources too
    }
  }
};

Offscreen::Offscreen(PictureSize size)
    : size_(CheckedSize(size)), graphics_(std::make_unique<Graphics>(size)) {
  rows_.resize(static_cast<size_t>(size_.width) * static_cast<size_t>(size_.height) * 3);
  pixels_.resize(rows_.size());
}

Offscreen::~Offscreen() = default;

std::span<const uint8_t> Offscreen::Render(std::span<const ScenePanel> panels) {
  {
    const EglContext::Use use(graphics_->context);
    const Painter& painter = *graphics_->painter;
    painter.Draw(panels, size_.width, size_.height);
    const mjrRect whole{0, 0, size_.width, size_.height};
    mjr_readPixels(rows_.data(), nullptr, whole, &painter.context());
  }
  const auto row_bytes = static_cast<ptrdiff_t>(size_.width) * 3;
  for (ptrdiff_t row = 0; row < size_.height; ++row) {
    std::copy_n(rows_.begin() + row * row_bytes, row_bytes,
                pixels_.begin() + (size_.height - 1 - row) * row_bytes);
  }
  return pixels_;
}

}  // namespace upswing
