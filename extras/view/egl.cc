#include "extras/view/egl.h"

#include <dlfcn.h>

#include <array>
#include <cstdint>
#include <string>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

// The used part of EGL 1.5's interface, as in Khronos' EGL/egl.h and EGL/eglext.h.
using Handle = void*;
using Int = int32_t;
constexpr Int kNone = 0x3038, kSurfaceType = 0x3033, kPbufferBit = 1, kRenderableType = 0x3040,
              kOpenGlBit = 8, kDraw = 0x3059, kRead = 0x305A;
constexpr uint32_t kOpenGlApi = 0x30A2, kPlatformDevice = 0x313F, kPlatformSurfaceless = 0x31DD;

const char* const kAdvice =
    "; pictures without a window need EGL (Debian's packages libegl1 and libgl1-mesa-dri)";

/// The EGL library, and the display for contexts. Both last as long as the process, because other
/// code may use the same display.
class Egl {
 public:
  static const Egl& Get() {
    static const Egl egl;
    return egl;
  }

  // NOLINTBEGIN(readability-identifier-naming): EGL's own names
  decltype(static_cast<Handle (*)(const char*)>(nullptr)) eglGetProcAddress;
  uint32_t (*eglInitialize)(Handle display, Int* major, Int* minor);
  uint32_t (*eglBindAPI)(uint32_t api);
  uint32_t (*eglChooseConfig)(Handle display, const Int* wanted, Handle* configs, Int size,
                              Int* count);
  Handle (*eglCreateContext)(Handle display, Handle config, Handle share, const Int* wanted);
  uint32_t (*eglDestroyContext)(Handle display, Handle context);
  uint32_t (*eglMakeCurrent)(Handle display, Handle draw, Handle read, Handle context);
  Handle (*eglGetCurrentContext)();
  Handle (*eglGetCurrentDisplay)();
  Handle (*eglGetCurrentSurface)(Int which);
  Handle (*eglGetDisplay)(Handle native);
  Int (*eglGetError)();
  // NOLINTEND(readability-identifier-naming)

  Handle display = nullptr, config = nullptr;

  std::string ErrorText() const {
    std::array<char, 16> text{};
    (void)snprintf(text.data(), text.size(), "0x%x", static_cast<unsigned>(eglGetError()));
    return text.data();
  }

 private:
  Egl() {
    // MuJoCo looks up eglGetProcAddress, so the library's names must be global.
    library_ = dlopen("libEGL.so.1", RTLD_NOW | RTLD_GLOBAL);
    if (library_ == nullptr) {
      throw Failure(Concat("expected the library libEGL.so.1, found none", kAdvice));
    }
    Load(eglGetProcAddress, "eglGetProcAddress");
    Load(eglInitialize, "eglInitialize");
    Load(eglBindAPI, "eglBindAPI");
    Load(eglChooseConfig, "eglChooseConfig");
    Load(eglCreateContext, "eglCreateContext");
    Load(eglDestroyContext, "eglDestroyContext");
    Load(eglMakeCurrent, "eglMakeCurrent");
    Load(eglGetCurrentContext, "eglGetCurrentContext");
    Load(eglGetCurrentDisplay, "eglGetCurrentDisplay");
    Load(eglGetCurrentSurface, "eglGetCurrentSurface");
    Load(eglGetDisplay, "eglGetDisplay");
    Load(eglGetError, "eglGetError");
    OpenDisplay();
  }

  template <typename Function>
  void Load(Function& function, const char* name) const {
    function = reinterpret_cast<Function>(dlsym(library_, name));
    if (function == nullptr) {
      throw Failure(Concat("expected ", name, " in libEGL.so.1, found none", kAdvice));
    }
  }

  /// A function of an extension; null if there is none.
  template <typename Function>
  Function Extension(const char* name) const {
    return reinterpret_cast<Function>(eglGetProcAddress(name));
  }

  /// Opens the first device that works, in the system's order: cards before software. If devices
  /// cannot be listed, tries Mesa without a display, then EGL's default.
  void OpenDisplay() {
    const auto platform =
        Extension<Handle (*)(uint32_t, Handle, const Int*)>("eglGetPlatformDisplayEXT");
    const auto devices = Extension<uint32_t (*)(Int, Handle*, Int*)>("eglQueryDevicesEXT");
    if (platform != nullptr && devices != nullptr) {
      std::array<Handle, 64> found{};
      Int count = 0;
      if (devices(static_cast<Int>(found.size()), found.data(), &count) == 0) count = 0;
      for (Int i = 0; i < count; ++i) {
        if (Works(platform(kPlatformDevice, found[static_cast<size_t>(i)], nullptr))) return;
      }
    }
    if (platform != nullptr && Works(platform(kPlatformSurfaceless, nullptr, nullptr))) return;
    if (Works(eglGetDisplay(nullptr))) return;
    throw Failure(Concat("EGL: expected a device that can draw with OpenGL, found none", kAdvice));
  }

  /// Whether OpenGL can draw on this display; if so, uses it.
  bool Works(Handle candidate) {
    if (candidate == nullptr || eglInitialize(candidate, nullptr, nullptr) == 0) return false;
    constexpr std::array<Int, 5> kWanted{kSurfaceType, kPbufferBit, kRenderableType, kOpenGlBit,
                                         kNone};
    Int count = 0;
    if (eglChooseConfig(candidate, kWanted.data(), &config, 1, &count) == 0 || count < 1) {
      return false;
    }
    if (eglBindAPI(kOpenGlApi) == 0) return false;
    const Handle context = eglCreateContext(candidate, config, nullptr, nullptr);
    if (context == nullptr) return false;
    eglDestroyContext(candidate, context);
    display = candidate;
    return true;
  }

  Handle library_ = nullptr;
};

}  // namespace

EglContext::EglContext() : context_(nullptr) {
  const Egl& egl = Egl::Get();
  if (egl.eglBindAPI(kOpenGlApi) != 0) {
    context_ = egl.eglCreateContext(egl.display, egl.config, nullptr, nullptr);
  }
  if (context_ == nullptr) {
    throw Failure(Concat("EGL cannot make an OpenGL context (error ", egl.ErrorText(), ")"));
  }
}

EglContext::~EglContext() {
  const Egl& egl = Egl::Get();
  egl.eglDestroyContext(egl.display, context_);
}

EglContext::Use::Use(const EglContext& context) {
  const Egl& egl = Egl::Get();
  egl.eglBindAPI(kOpenGlApi);  // current in this thread
  display_ = egl.eglGetCurrentDisplay();
  draw_ = egl.eglGetCurrentSurface(kDraw);
  read_ = egl.eglGetCurrentSurface(kRead);
  context_ = egl.eglGetCurrentContext();
  if (egl.eglMakeCurrent(egl.display, nullptr, nullptr, context.context_) == 0) {
    throw Failure(
        Concat("EGL cannot use its context in this thread (error ", egl.ErrorText(), ")"));
  }
}

EglContext::Use::~Use() {
  const Egl& egl = Egl::Get();
  if (context_ != nullptr) {
    egl.eglMakeCurrent(display_, draw_, read_, context_);
  } else {
    egl.eglMakeCurrent(egl.display, nullptr, nullptr, nullptr);
  }
}

}  // namespace upswing
