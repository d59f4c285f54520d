#include "extras/machine/logs/log_writer.h"

#include <fmt/format.h>

#include <chrono>
#include <iterator>

#include "base/error.h"
#include "base/text.h"
#include "os/lock.h"

namespace upswing::machine {
namespace {

constexpr size_t kRows = 1 << 14;  // 16 s at 1 kHz
constexpr auto kPause = std::chrono::milliseconds(20);
constexpr size_t kFlushBytes = 1 << 16;
constexpr const char* kHeader =
    "time,pos_meas1,pos_meas2,vel_meas1,vel_meas2,tau_con1,tau_con2,tau_meas1,tau_meas2,state,"
    "late\n";

}  // namespace

bool LogRing::Push(const LoopRow& row) {
  const size_t end = end_.load(std::memory_order_relaxed);
  if (end - begin_.load(std::memory_order_acquire) == rows_.size()) return false;
  rows_[end % rows_.size()] = row;
  end_.store(end + 1, std::memory_order_release);
  return true;
}

bool LogRing::Pop(LoopRow& row) {
  const size_t begin = begin_.load(std::memory_order_relaxed);
  if (begin == end_.load(std::memory_order_acquire)) return false;
  row = rows_[begin % rows_.size()];
  begin_.store(begin + 1, std::memory_order_release);
  return true;
}

LogWriter::LogWriter(const std::string& path) : ring_(kRows) {
  if (path.empty()) return;
  // A log is never replaced, because a machine's motion cannot be repeated.
  file_ = OpenLocked(path);
  if (!file_ || file_->size() > 0) {
    throw BadInput(Concat("--log: expected a new file, got ", path, ", which exists"));
  }
  text_ = kHeader;
  thread_ = std::thread([this] { Work(); });
}

LogWriter::~LogWriter() {
  ending_ = true;
  if (thread_.joinable()) thread_.join();
}

void LogWriter::Add(const LoopRow& row, bool waits) {
  if (!file_) return;
  while (!ring_.Push(row)) {
    if (!waits) {
      ++dropped_;
      return;
    }
    std::this_thread::yield();
  }
}

void LogWriter::Flush() {
  try {
    if (error_.empty()) file_->Append(text_);
  } catch (const Error& error) {
    error_ = error.what();  // the machine goes on; Finish reports it
  }
  text_.clear();
}

void LogWriter::Work() {
  while (true) {
    const bool last = ending_;
    for (LoopRow r; ring_.Pop(r);) {
      fmt::format_to(std::back_inserter(text_), "{},{},{},{},{},{},{},{},{},{},{}\n", r.time,
                     r.angle[0], r.angle[1], r.velocity[0], r.velocity[1], r.torque[0], r.torque[1],
                     r.measured[0], r.measured[1], r.state, r.late);
      if (text_.size() > kFlushBytes) Flush();
    }
    if (text_ != kHeader) Flush();  // without a reading the file stays empty
    if (last) return;
    std::this_thread::sleep_for(kPause);
  }
}

void LogWriter::Finish() {
  ending_ = true;
  if (thread_.joinable()) thread_.join();
  if (!error_.empty()) throw Failure(error_);
}

}  // namespace upswing::machine
