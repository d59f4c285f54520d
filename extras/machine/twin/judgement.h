#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/thread_pool.h"
#include "extras/machine/logs/log.h"
#include "extras/machine/twin/twin.h"

/// How well twins explain logs, against the noise of the encoders and against the motion itself.
namespace upswing::machine {

enum class Explanation {
  kToNoise,     // errors are those of the encoders
  kToMultiple,  // errors are a multiple of them, but small against the motion
  kNone,        // errors are not small against the motion, and more than 5 times the noise
  kUnknown,     // the logs have no motion in which a model can predict
};

const char* NameOf(Explanation explanation);

/// The errors of a prediction in a window with the best start state.
struct WindowError {
  double error = 0;  // rms over the rows of both angles' errors, rad
  // How much there is to explain, rad: the same error of the best constant velocities, and the
  // sines of the links' angles, which are the velocity that gravity adds in a natural time, in
  // natural units. A motor that moves links slowly leaves only the latter.
  double motion = 0;
  // Share of the changes of velocity, over a twentieth of the window, that the model does not
  // explain.
  double step = 0;

  /// Share of the motion that the model does not explain.
  double share() const { return error / motion; }
};

struct Judgement {
  Explanation explanation = Explanation::kUnknown;
  std::string logs;    // which ones, such as "the left-out logs"
  double seconds = 0;  // length of a window, s
  int windows = 0;
  Joints noise{};          // standard deviation of the angles' noise, rad
  double error = 0;        // median over the windows, rad
  double times_noise = 0;  // error over that of the noise, in the median window
  // Unexplained shares of the motion: median and upper quartile over the windows.
  double share = 0, upper_share = 0;
  double step_share = 0;            // unexplained share of the changes of velocity
  std::vector<WindowError> errors;  // (windows)

  bool explains() const { return explanation != Explanation::kNone; }
};

/// Judges twins by logs: `twins` has the twin for each log, in its session.
/// `name` says which logs they are.
Judgement Judge(std::span<const MachineLog> logs, std::span<const Twin> twins,
                const std::string& name, ThreadPool* pool);

/// One sentence that says the judgement.
std::string SentenceOf(const Judgement& judgement);

}  // namespace upswing::machine
