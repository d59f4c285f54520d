#pragma once

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <dlfcn.h>

#include "base/error.h"
#include "base/text.h"

namespace upswing {

inline Error NoWindow(std::string_view reason) {
  return Failure(Concat("view: no window can be opened: ", reason,
                        "; --record FILE and --headless need no window"));
}

/// The used functions of GLFW 3.3, without their prefix. The library is loaded at run time, so that
/// a program with the window also runs where GLFW is missing.
class GlfwFunctions {
 public:
  /// Loads the library. Throws Failure with what to install.
  static const GlfwFunctions& Get() {
    static const GlfwFunctions kFunctions;
    return kFunctions;
  }

 private:
  /// The address of any function.
  struct Symbol {
    template <typename Function>  // NOLINTNEXTLINE(google-explicit-constructor): no casts below
    operator Function*() const {
      return reinterpret_cast<Function*>(address);
    }
    void* address;
  };

  GlfwFunctions() = default;

  static void* Open() {
    void* library = dlopen("libglfw.so.3", RTLD_NOW | RTLD_LOCAL);
    if (library != nullptr) return library;
    throw NoWindow("expected the library libglfw.so.3, found none (Debian's package libglfw3)");
  }

  Symbol Find(const char* name) const {
    void* address = dlsym(library_, name);
    if (address != nullptr) return {address};
    throw NoWindow(Concat("expected ", name, " of GLFW 3.3 in libglfw.so.3, found none"));
  }

  void* library_ = Open();

 public:
  // NOLINTBEGIN(readability-identifier-naming): GLFW's own names
  decltype(&glfwCreateWindow) CreateWindow = Find("glfwCreateWindow");
  decltype(&glfwDestroyWindow) DestroyWindow = Find("glfwDestroyWindow");
  decltype(&glfwGetError) GetError = Find("glfwGetError");
  decltype(&glfwGetFramebufferSize) GetFramebufferSize = Find("glfwGetFramebufferSize");
  decltype(&glfwGetKey) GetKey = Find("glfwGetKey");
  decltype(&glfwGetMouseButton) GetMouseButton = Find("glfwGetMouseButton");
  decltype(&glfwGetPrimaryMonitor) GetPrimaryMonitor = Find("glfwGetPrimaryMonitor");
  decltype(&glfwGetProcAddress) GetProcAddress = Find("glfwGetProcAddress");
  decltype(&glfwGetTime) GetTime = Find("glfwGetTime");
  decltype(&glfwGetVideoMode) GetVideoMode = Find("glfwGetVideoMode");
  decltype(&glfwGetWindowMonitor) GetWindowMonitor = Find("glfwGetWindowMonitor");
  decltype(&glfwGetWindowPos) GetWindowPos = Find("glfwGetWindowPos");
  decltype(&glfwGetWindowSize) GetWindowSize = Find("glfwGetWindowSize");
  decltype(&glfwGetWindowUserPointer) GetWindowUserPointer = Find("glfwGetWindowUserPointer");
  decltype(&glfwInit) Init = Find("glfwInit");
  decltype(&glfwMakeContextCurrent) MakeContextCurrent = Find("glfwMakeContextCurrent");
  decltype(&glfwPollEvents) PollEvents = Find("glfwPollEvents");
  decltype(&glfwSetCursorPosCallback) SetCursorPosCallback = Find("glfwSetCursorPosCallback");
  decltype(&glfwSetKeyCallback) SetKeyCallback = Find("glfwSetKeyCallback");
  decltype(&glfwSetMouseButtonCallback) SetMouseButtonCallback = Find("glfwSetMouseButtonCallback");
  decltype(&glfwSetScrollCallback) SetScrollCallback = Find("glfwSetScrollCallback");
  decltype(&glfwSetWindowMonitor) SetWindowMonitor = Find("glfwSetWindowMonitor");
  decltype(&glfwSetWindowTitle) SetWindowTitle = Find("glfwSetWindowTitle");
  decltype(&glfwSetWindowUserPointer) SetWindowUserPointer = Find("glfwSetWindowUserPointer");
  decltype(&glfwSwapBuffers) SwapBuffers = Find("glfwSwapBuffers");
  decltype(&glfwSwapInterval) SwapInterval = Find("glfwSwapInterval");
  decltype(&glfwTerminate) Terminate = Find("glfwTerminate");
  decltype(&glfwWindowHint) WindowHint = Find("glfwWindowHint");
  decltype(&glfwWindowShouldClose) WindowShouldClose = Find("glfwWindowShouldClose");
  // NOLINTEND(readability-identifier-naming)
};

inline const GlfwFunctions& Glfw() { return GlfwFunctions::Get(); }

}  // namespace upswing
