#pragma once

#include <memory>

namespace upswing {

/// An OpenGL context without a window or a display, by EGL, whose library is loaded at run time: a
/// graphics card where there is one that may be used, else Mesa's software.
class EglContext {
 public:
  /// Throws Failure that says what is missing and what to install.
  EglContext();
  ~EglContext();
  EglContext(const EglContext&) = delete;
  EglContext& operator=(const EglContext&) = delete;

  /// Makes the context this thread's own during its lifetime; the one before it comes back then.
  /// Another thread may be next.
  class Use {
   public:
    explicit Use(const EglContext& context);
    ~Use();
    Use(const Use&) = delete;
    Use& operator=(const Use&) = delete;

   private:
    void *display_, *draw_, *read_, *context_;  // before
  };

 private:
  void* context_;
};

}  // namespace upswing
