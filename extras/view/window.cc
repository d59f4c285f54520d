#include "extras/view/window.h"

#include <dlfcn.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <optional>

#include "base/text.h"
#include "extras/view/glfw-inl.h"

namespace upswing {
namespace {

constexpr double kDoubleClickSeconds = 0.3;

static_assert(Key::kEscape == GLFW_KEY_ESCAPE && Key::kEnter == GLFW_KEY_ENTER &&
              Key::kTab == GLFW_KEY_TAB && Key::kBackspace == GLFW_KEY_BACKSPACE &&
              Key::kRight == GLFW_KEY_RIGHT && Key::kLeft == GLFW_KEY_LEFT &&
              Key::kF1 == GLFW_KEY_F1 && Key::kF7 == GLFW_KEY_F7 && Key::kSpace == GLFW_KEY_SPACE);

/// The error that GLFW has just met.
Error GlfwError() {
  const char* text = nullptr;
  Glfw().GetError(&text);
  return NoWindow(text == nullptr ? "no reason given" : Printable(text));
}

/// Whether the current context is rendered in software.
bool IsSoftware() {
  using GetString = const unsigned char* (*)(unsigned int);
  constexpr unsigned int kRenderer = 0x1F01;  // GL_RENDERER
  const auto get = reinterpret_cast<GetString>(Glfw().GetProcAddress("glGetString"));
  const auto* text = get == nullptr ? nullptr : reinterpret_cast<const char*>(get(kRenderer));
  return text != nullptr &&
         (std::strstr(text, "llvmpipe") != nullptr || std::strstr(text, "softpipe") != nullptr);
}

}  // namespace

struct Window::Impl {
  /// Keeps GLFW initialised as long as there is a window.
  struct Library {
    Library() {
      // MuJoCo looks up OpenGL's functions among the global names.
      if (dlopen("libGL.so.1", RTLD_NOW | RTLD_GLOBAL) == nullptr &&
          dlopen("libEGL.so.1", RTLD_NOW | RTLD_GLOBAL) == nullptr) {
        throw NoWindow("expected the library libGL.so.1, found none (Debian's package libgl1)");
      }
      if (Glfw().Init() == GLFW_FALSE) throw GlfwError();
    }
    ~Library() { Glfw().Terminate(); }
  };

  Library library;
  GLFWwindow* window = nullptr;
  std::optional<Painter> painter;
  std::vector<ScenePanel> panels;  // last drawn panels
  std::vector<Key> keys;
  double x = 0, y = 0;  // mouse position from the top left, in window units
  int dragged = -1;     // panel whose link the mouse pulls; -1: none
  int last_button = -1;
  double last_click = -1;      // s
  std::array<int, 4> place{};  // window before full screen: left, top, width, height

  Impl(const std::string& title, PictureSize size) {
    Open(title, size, 4);
    if (IsSoftware()) {
      // Antialiasing would take most of the time.
      Glfw().DestroyWindow(window);
      Open(title, size, 0);
    }
    Glfw().SwapInterval(1);
    Glfw().SetWindowUserPointer(window, this);
    Glfw().SetKeyCallback(window, [](GLFWwindow* w, int key, int, int action, int mods) {
      const bool is_step = key == GLFW_KEY_LEFT || key == GLFW_KEY_RIGHT;
      if (action == GLFW_RELEASE || (action == GLFW_REPEAT && !is_step)) return;
      Of(w).keys.push_back({key, (mods & GLFW_MOD_SHIFT) != 0, (mods & GLFW_MOD_CONTROL) != 0});
    });
    Glfw().SetCursorPosCallback(window,
                                [](GLFWwindow* w, double x, double y) { Of(w).Move(x, y); });
    Glfw().SetMouseButtonCallback(window, [](GLFWwindow* w, int button, int action, int) {
      Of(w).Click(button, action == GLFW_PRESS);
    });
    Glfw().SetScrollCallback(window, [](GLFWwindow* w, double, double turn) {
      Of(w).MoveCameras(mjMOUSE_ZOOM, 0, -0.05 * turn);
    });
    PendulumScene room{Plant(), ""};
    const PictureSize pixels = Pixels();
    painter.emplace(room.model(), mjFB_WINDOW, pixels.width, pixels.height);
  }

  ~Impl() {
    painter.reset();
    Glfw().DestroyWindow(window);
  }

  static Impl& Of(GLFWwindow* w) { return *static_cast<Impl*>(Glfw().GetWindowUserPointer(w)); }

  void Open(const std::string& title, PictureSize size, int samples) {
    Glfw().WindowHint(GLFW_SAMPLES, samples);
    window =
        Glfw().CreateWindow(size.width, size.height, Printable(title).c_str(), nullptr, nullptr);
    if (window == nullptr) throw GlfwError();
    Glfw().MakeContextCurrent(window);
  }

  PictureSize Pixels() const {
    PictureSize size;
    Glfw().GetFramebufferSize(window, &size.width, &size.height);
    return {std::max(size.width, 1), std::max(size.height, 1)};
  }

  bool Pressed(int button) const { return Glfw().GetMouseButton(window, button) == GLFW_PRESS; }
  bool Held(int left, int right) const {
    return Glfw().GetKey(window, left) == GLFW_PRESS || Glfw().GetKey(window, right) == GLFW_PRESS;
  }

  /// The panel under the mouse and the position in it, right and up in [0, 1]; -1: none.
  int PanelAt(double& right, double& up) const {
    int width = 0, height = 0;  // in window units
    Glfw().GetWindowSize(window, &width, &height);
    const auto count = static_cast<int>(panels.size());
    for (int i = 0; i < count; ++i) {
      const mjrRect place = PanelPlace(i, count, width, height);
      right = (x - place.left) / place.width;
      up = (height - y - place.bottom) / place.height;
      if (right >= 0 && right < 1 && up >= 0 && up < 1) return i;
    }
    return -1;
  }

  void Move(double new_x, double new_y) {
    int width = 0, height = 0;
    Glfw().GetWindowSize(window, &width, &height);
    const double dx = (new_x - x) / height, dy = (new_y - y) / height;
    x = new_x;
    y = new_y;
    const bool left = Pressed(GLFW_MOUSE_BUTTON_LEFT), right = Pressed(GLFW_MOUSE_BUTTON_RIGHT);
    if (!left && !right && !Pressed(GLFW_MOUSE_BUTTON_MIDDLE)) return;
    const bool shift = Held(GLFW_KEY_LEFT_SHIFT, GLFW_KEY_RIGHT_SHIFT);
    mjtMouse action = mjMOUSE_ZOOM;
    if (right) {
      action = shift ? mjMOUSE_MOVE_H : mjMOUSE_MOVE_V;
    } else if (left) {
      action = shift ? mjMOUSE_ROTATE_H : mjMOUSE_ROTATE_V;
    }
    if (dragged >= 0 && dragged < static_cast<int>(panels.size())) {
      PendulumScene& scene = *panels[static_cast<size_t>(dragged)].scene;
      mjv_movePerturb(&scene.model(), &scene.data(), action, dx, dy, &scene.scene(),
                      &scene.perturb());
    } else {
      MoveCameras(action, dx, dy);
    }
  }

  void MoveCameras(mjtMouse action, double dx, double dy) const {
    for (const ScenePanel& panel : panels) {
      PendulumScene& scene = *panel.scene;
      mjv_moveCamera(&scene.model(), action, dx, dy, &scene.camera());
    }
  }

  void Click(int button, bool pressed) {
    const double now = Glfw().GetTime();
    if (!pressed) {
      LetGo();
      return;
    }
    const bool twice = button == last_button && now - last_click < kDoubleClickSeconds;
    last_button = button;
    last_click = twice ? -1 : now;
    if (Held(GLFW_KEY_LEFT_CONTROL, GLFW_KEY_RIGHT_CONTROL)) {
      Take(button);
    } else if (twice && button == GLFW_MOUSE_BUTTON_LEFT) {
      Select();
    }
  }

  /// Selects the link under the mouse, or none.
  void Select() {
    double right = 0, up = 0;
    const int at = PanelAt(right, up);
    for (int i = 0; i < static_cast<int>(panels.size()); ++i) {
      PendulumScene& scene = *panels[static_cast<size_t>(i)].scene;
      mjvPerturb& perturb = scene.perturb();
      perturb.select = 0;
      if (i != at) continue;
      const mjrRect place =
          PanelPlace(i, static_cast<int>(panels.size()), Pixels().width, Pixels().height);
      std::array<mjtNum, 3> point{};
      std::array<int, 3> ids{-1, -1, -1};  // of geom, flex, skin
      const int body = mjv_select(&scene.model(), &scene.data(), &scene.option(),
                                  static_cast<double>(place.width) / place.height, right, up,
                                  &scene.scene(), point.data(), ids.data(), &ids[1], &ids[2]);
      if (body <= 0) continue;
      perturb.select = body;
      std::array<mjtNum, 3> arm{};
      mju_sub3(arm.data(), point.data(), scene.data().xpos + ptrdiff_t{3} * body);
      mju_mulMatTVec(perturb.localpos, scene.data().xmat + ptrdiff_t{9} * body, arm.data(), 3, 3);
    }
  }

  /// Begins to pull at the selected link.
  void Take(int button) {
    for (int i = 0; i < static_cast<int>(panels.size()); ++i) {
      PendulumScene& scene = *panels[static_cast<size_t>(i)].scene;
      if (scene.perturb().select <= 0) continue;
      mjv_initPerturb(&scene.model(), &scene.data(), &scene.scene(), &scene.perturb());
      scene.perturb().active = button == GLFW_MOUSE_BUTTON_LEFT ? mjPERT_ROTATE : mjPERT_TRANSLATE;
      dragged = i;
    }
  }

  void LetGo() {
    dragged = -1;
    for (const ScenePanel& panel : panels) panel.scene->perturb().active = 0;
  }
};

Window::Window(const std::string& title, PictureSize size)
    : impl_(std::make_unique<Impl>(title, size)) {}
Window::~Window() = default;

bool Window::closed() const { return Glfw().WindowShouldClose(impl_->window) != 0; }
void Window::SetTitle(const std::string& title) {
  Glfw().SetWindowTitle(impl_->window, Printable(title).c_str());
}
PictureSize Window::size() const { return impl_->Pixels(); }

void Window::ToggleFullScreen() {
  GLFWwindow* window = impl_->window;
  auto& [left, top, width, height] = impl_->place;
  if (Glfw().GetWindowMonitor(window) != nullptr) {
    Glfw().SetWindowMonitor(window, nullptr, left, top, width, height, 0);
  } else if (GLFWmonitor* monitor = Glfw().GetPrimaryMonitor(); monitor != nullptr) {
    Glfw().GetWindowPos(window, &left, &top);
    Glfw().GetWindowSize(window, &width, &height);
    const GLFWvidmode* mode = Glfw().GetVideoMode(monitor);
    Glfw().SetWindowMonitor(window, monitor, 0, 0, mode->width, mode->height, mode->refreshRate);
  }
  Glfw().SwapInterval(1);
}

void Window::Draw(std::span<const ScenePanel> panels, std::span<const Overlay> overlays,
                  mjvFigure* chart) {
  impl_->panels.assign(panels.begin(), panels.end());
  const auto [width, height] = impl_->Pixels();
  const Painter& painter = *impl_->painter;
  painter.Draw(panels, width, height);
  for (const Overlay& overlay : overlays) {
    painter.Write(overlay.place, overlay.lines, {0, 0, width, height});
  }
  if (chart != nullptr) {
    const mjrRect place{width * 11 / 20, 0, width * 9 / 20, height * 3 / 10};
    mjr_figure(place, chart, &painter.context());
  }
  Glfw().SwapBuffers(impl_->window);
}

std::vector<Key> Window::TakeEvents() {
  Glfw().PollEvents();
  return std::exchange(impl_->keys, {});
}

}  // namespace upswing
