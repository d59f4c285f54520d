#pragma once

#include <memory>

namespace upswing {

/// An OpenGL context without a window or display, by EGL. The EGL library is loaded at run time.
/// Uses a graphics card if one is available, else Mesa's software renderer.
class EglContext {
 public:
  /// Throws Failure with the missing part and what to install.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes the context current in this thread during its lifetime, then restores the previous one.
  /// Afterwards, another thread may use it.
  class Use {
   public:
    explicit Use(const EglContext& context);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    void *display_, *draw_, *read_, *context_;  // the previous context
  };

 private:
  void* context_;
};

}  // namespace upswing
