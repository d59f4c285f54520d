#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "base/sample.h"
#include "extras/machine/drive/policy_controller.h"
#include "extras/realaigym/simulation.h"
#include "extras/realaigym/uptime.h"

/// Scoring of policies by the rules of RealAIGym's boards (docs/howto/realaigym.md).
namespace upswing::realaigym {

/// The text of a policy's design plant; empty for the board's.
std::string OtherPlant(const MachinePolicy& policy);

/// Makes controllers of a policy's motor. A controller's first call is its first step.
ControllerMaker ControllersOf(const MachinePolicy& policy);

/// A policy's scores, version 2.
struct BoardReport {
  MachinePolicy policy;
  BoardOutcome nominal;
  Robustness robustness;
};
/// The nominal simulation.
MachineLog NominalLog(const MachinePolicy& policy);
/// Runs all simulations of the scores. `progress` counts those of robustness.
BoardReport ScoreOnBoard(const MachinePolicy& policy, uint64_t seed, ThreadPool& pool,
                         const Progress& progress);
std::string BoardJson(const BoardReport& report);

/// A policy's scores, version 3.
struct UptimeReport {
  MachinePolicy policy;
  std::vector<UptimeRun> runs;

  Moments scores() const;
  Interval interval() const;  // 95%, of the mean score (normal approximation)
};
/// Simulates `count` runs, whose resets have seeds from `seed` on. `progress` counts them.
std::vector<UptimeRun> ScoreUptime(const MachinePolicy& policy, uint64_t seed, int count,
                                   ThreadPool& pool, const Progress& progress);
/// The first of these runs.
MachineLog UptimeLog(const MachinePolicy& policy, uint64_t seed);
std::string UptimeJson(const UptimeReport& report);

/// The first line of BoardCsv.
inline constexpr std::string_view kBoardHeader =
    "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,tau_con1,tau_con2\n";
/// A motion as CSV in the boards' own format.
std::string BoardCsv(const MachineLog& log);

}  // namespace upswing::realaigym
