#include "extras/machine/twin/drive.h"

#include <algorithm>
#include <cmath>

namespace upswing::machine {
namespace {

constexpr double kShortestLag = 1e-5;  // s; shorter lags count as this one

}  // namespace

Drive::Drive(double delay, double lag) : delay_(delay), lag_(std::max(lag, kShortestLag)) {}

void Drive::Add(double time, const Joints& command) {
  int cursor = static_cast<int>(times_.size()) - 1;
  DriveTangents tangents;
  starts_.push_back(At(time + delay_, cursor, &tangents));
  slopes_.push_back(tangents.by_lag);
  times_.push_back(time);
  commands_.push_back(command);
}

void Drive::Forget(double time) {
  const auto after = std::ranges::upper_bound(times_, time - delay_);
  const auto n = std::max<std::ptrdiff_t>(after - times_.begin() - 1, 0);
  times_.erase(times_.begin(), times_.begin() + n);
  for (auto* list : {&commands_, &starts_, &slopes_}) list->erase(list->begin(), list->begin() + n);
}

Drive Drive::Commanded(const MachineLog& log, const Twin& twin) {
  Drive drive(twin.actuator.delay, twin.actuator.lag);
  if (log.commanded.empty()) return drive;
  const Joints limit = TorqueLimits(twin, ActuatedJoint(log, twin));
  // The command of a row is sent while the angles of the next row are read.
  for (int row = 0; row + 1 < log.rows(); ++row) {
    Joints command = log.commanded[row];
    for (int j = 0; j < 2; ++j) {
      command[j] = std::clamp(command[j], -limit[j], limit[j]);
      if (!log.push.empty()) command[j] += log.push[row][j];
    }
    drive.Add(log.time[row + 1], command);
  }
  return drive;
}

Drive Drive::Measured(const MachineLog& log, const Twin& twin) {
  Drive drive(-twin.actuator.current_delay, 0);
  drive.is_measured_ = true;
  drive.times_ = log.time;
  drive.commands_ = log.measured;
  return drive;
}

int Drive::Find(double time, int& cursor) const {
  const int n = static_cast<int>(times_.size());
  // Mostly the same event as before, or the next one.
  if (cursor < n && times_[cursor] <= time) {
    while (cursor + 1 < n && times_[cursor + 1] <= time) ++cursor;
    return cursor;
  }
  const auto after = std::ranges::upper_bound(times_, time);
  const int found = static_cast<int>(after - times_.begin()) - 1;
  cursor = std::max(found, 0);
  return found;
}

Joints Drive::At(double time, int& cursor, DriveTangents* tangents) const {
  if (times_.empty()) return {};
  time -= delay_;
  const int event = Find(time, cursor);
  return is_measured_ ? Interpolated(event, time) : Lagged(event, time, tangents);
}

Joints Drive::Interpolated(int event, double time) const {
  if (event < 0) return commands_.front();
  if (event + 1 == static_cast<int>(times_.size())) return commands_.back();
  const double share = (time - times_[event]) / (times_[event + 1] - times_[event]);
  const Joints &a = commands_[event], &b = commands_[event + 1];
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])};
}

Joints Drive::Lagged(int event, double time, DriveTangents* tangents) const {
  if (event < 0) return {};
  const double age = time - times_[event], decay = std::exp(-age / lag_);
  const Joints &command = commands_[event], &start = starts_[event];
  if (tangents != nullptr) {
    for (int j = 0; j < 2; ++j) {
      tangents->by_delay[j] = (start[j] - command[j]) * decay / lag_;
      tangents->by_lag[j] = slopes_[event][j] * decay + tangents->by_delay[j] * age / lag_;
    }
  }
  return {command[0] + (start[0] - command[0]) * decay,
          command[1] + (start[1] - command[1]) * decay};
}

}  // namespace upswing::machine
