#include "os/lock_check.h"

#include <chrono>
#include <thread>

#include "base/error.h"
#include "base/stopwatch.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "os/lock.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

/// Thrown while a process waits, if it is to stop.
struct Stopped {};

/// Makes a folder; false if it exists. Only one of several processes makes it, also on NFS.
bool MakesFolder(const fs::path& path) {
  std::error_code error;
  const bool made = fs::create_directory(path, error);
  if (error) throw PathError("cannot make", path, error.value());
  return made;
}

/// A folder in which two processes leave messages for each other. A message is an empty folder
/// TOPIC=TEXT, which appears at once on every file system, also on one whose locks do nothing.
class Meeting {
 public:
  Meeting(const fs::path& folder, double patience, const std::function<bool()>& stopped)
      : path_(folder / ".lock-check"),
        is_first_(MakesFolder(path_)),
        patience_(patience),
        stopped_(stopped) {
    if (is_first_ || MakesFolder(path_ / "second")) return;
    throw BadInput(Concat(path_.string(), ": expected no check of locks here, got one of two ",
                          "processes; if none runs, remove this folder"));
  }
  Meeting(const Meeting&) = delete;
  Meeting& operator=(const Meeting&) = delete;
  /// Removes the folder, which the other process no longer needs.
  ~Meeting() {
    std::error_code ignored;
    if (is_first_ || gave_up_) fs::remove_all(path_, ignored);
  }

  bool is_first() const { return is_first_; }
  fs::path lock() const { return path_ / "lock"; }
  double patience() const { return patience_; }

  void Tell(const std::string& topic, const std::string& text = "") const {
    (void)MakesFolder(path_ / Concat(topic, "=", text));
  }
  /// Waits for a message of the other process and returns its text.
  std::string Await(const std::string& topic) {
    for (const Stopwatch watch; !gave_up_;) {
      if (const auto text = TextOf(topic)) return *text;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      const bool is_stopped = stopped_();
      gave_up_ = is_stopped || watch.seconds() > patience_;
      if (is_stopped) throw Stopped();
    }
    throw Failure(Concat(path_.parent_path().string(), ": no other process answered within ",
                         patience_, " s; start the command on both hosts again"));
  }

 private:
  /// The text of a message; nothing before it arrives.
  std::optional<std::string> TextOf(const std::string& topic) const {
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(path_, ignored)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with(topic + "=")) return name.substr(topic.size() + 1);
    }
    return std::nullopt;
  }

  fs::path path_;
  bool is_first_, gave_up_ = false;
  double patience_;
  const std::function<bool()>& stopped_;
};

/// Holds the lock while the other process tries to get it. Returns whether it was kept out.
bool Hold(Meeting& meeting, const char* held, const char* answer) {
  // After a release, a file system may need a moment until another host can lock the file.
  std::optional<FileLock> lock(meeting.lock());
  for (const Stopwatch watch; !lock->held() && watch.seconds() < meeting.patience();) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    lock.emplace(meeting.lock());
  }
  if (!lock->held()) {
    throw Failure(Concat(meeting.lock().string(), ": expected a free lock, got a held one"));
  }
  meeting.Tell(held);
  return meeting.Await(answer) == "kept out";
}

/// Tries to get the lock while the other process holds it. Returns whether this one was kept out.
bool TryWhileHeld(Meeting& meeting, const char* held, const char* answer) {
  (void)meeting.Await(held);
  const bool kept_out = !FileLock(meeting.lock()).held();
  meeting.Tell(answer, kept_out ? "kept out" : "got it");
  return kept_out;
}

}  // namespace

std::optional<LockCheck> CheckLocks(const fs::path& folder, double patience,
                                    const std::function<bool()>& stopped) {
  LockCheck check;
  check.mine = Concat(HostName(), " ", ProcessId());
  try {
    Meeting meeting(folder, patience, stopped);
    bool second_kept_out = false, first_kept_out = false;
    if (meeting.is_first()) {
      meeting.Tell("name-of-first", check.mine);
      second_kept_out = Hold(meeting, "first-holds", "second-tried");
      meeting.Tell("first-released");
      first_kept_out = TryWhileHeld(meeting, "second-holds", "first-tried");
      check.other = meeting.Await("name-of-second");
      (void)meeting.Await("bye");
    } else {
      meeting.Tell("name-of-second", check.mine);
      check.other = meeting.Await("name-of-first");
      second_kept_out = TryWhileHeld(meeting, "first-holds", "second-tried");
      (void)meeting.Await("first-released");
      first_kept_out = Hold(meeting, "second-holds", "first-tried");
      meeting.Tell("bye");  // the folder may be gone at once
    }
    check.excludes = first_kept_out && second_kept_out;
  } catch (const Stopped&) {
    return std::nullopt;
  }
  const auto host = [](const std::string& name) { return name.substr(0, name.find(' ')); };
  check.same_host = host(check.mine) == host(check.other);
  return check;
}

}  // namespace upswing
