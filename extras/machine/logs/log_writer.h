#pragma once

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "extras/machine/logs/log.h"
#include "os/file.h"

namespace upswing::machine {

/// A row of the log of a control loop.
struct LoopRow {
  double time = 0;              // s
  Joints angle{}, velocity{};   // read, rad; estimated, rad/s
  Joints torque{}, measured{};  // computed in this cycle; reported by the drives; N·m
  int state = 0;                // LoopState
  double late = 0;              // begin of the cycle after its deadline, s
};

/// A ring of rows between the thread of the loop and the thread that writes them. Neither locks nor
/// allocates memory.
class LogRing {
 public:
  explicit LogRing(size_t capacity) : rows_(capacity) {}
  /// Adds a row, on the loop's thread; false if the ring is full.
  bool Push(const LoopRow& row);
  /// Takes the oldest row, on the writer's thread; false if there is none.
  bool Pop(LoopRow& row);

 private:
  std::vector<LoopRow> rows_;
  alignas(64) std::atomic<size_t> begin_{0};  // number of rows taken
  alignas(64) std::atomic<size_t> end_{0};    // number of rows added
};

/// Writes the rows to a CSV file with the columns of RealAIGym, on its own thread. The file grows
/// during the run, so that a crash loses only the last rows.
class LogWriter {
 public:
  /// Expects that the path is new, or an empty file that no other process locks. An empty path:
  /// rows are dropped. Throws BadInput and changes nothing otherwise, and as OpenLocked does.
  explicit LogWriter(const std::string& path);
  /// Ends the thread.
  ~LogWriter();
  LogWriter(const LogWriter&) = delete;
  LogWriter& operator=(const LogWriter&) = delete;

  /// Adds a row. If the writer is behind: waits for it if `waits`, else drops the row.
  void Add(const LoopRow& row, bool waits);
  /// Writes all rows. Throws Failure if a row could not be written.
  void Finish();
  /// Number of rows that the writer was too slow for.
  int64_t dropped() const { return dropped_; }

 private:
  void Work();
  void Flush();

  std::optional<AppendFile> file_;
  LogRing ring_;
  std::atomic<bool> ending_{false};
  std::string text_, error_;
  int64_t dropped_ = 0;
  std::thread thread_;
};

}  // namespace upswing::machine
