// The extension module upswing._upswing.
#include "python/src/bindings.h"

NB_MODULE(_upswing, m) {
  m.doc() = "Upswing's C++ code; the package's Python wraps it.";
  m.attr("version") = UPSWING_VERSION;
  upswing::BindErrors(m);
  upswing::BindSettings(m);
  upswing::BindEnvironments(m);
  upswing::BindPolicies(m);
  upswing::BindTraining(m);
  upswing::BindEvaluation(m);
  upswing::BindMachine(m);
}
