#include "runs/lease.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <thread>
#include <utility>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "os/making.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostText = 1000;  // bytes of the file that count

/// An open file and its status.
struct Opened {
  Descriptor descriptor;
  struct stat info {};
};

/// Opens a regular file for reading without following a link; nothing if there is none.
std::optional<Opened> Open(const fs::path& path) {
  Opened file{Descriptor(open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC)), {}};
  if (file.descriptor.get() < 0 || fstat(file.descriptor.get(), &file.info) != 0) {
    // Stale: another host removed the file after this host looked at it.
    if (errno == ENOENT || errno == ESTALE) return std::nullopt;
    throw PathError("cannot read", path, errno);
  }
  if (!S_ISREG(file.info.st_mode)) {
    throw BadInput(Concat(path.string(), ": expected a regular file"));
  }
  return file;
}

bool SameFile(const struct stat& a, const struct stat& b) {
  return a.st_dev == b.st_dev && a.st_ino == b.st_ino;
}

double SecondsOf(const timespec& time) {
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct stat InfoOf(const Making& file) {
  struct stat info {};
  if (fstat(file.descriptor(), &info) != 0) throw PathError("cannot read", file.path(), errno);
  return info;
}

/// Time of the file server's clock, s.
double ServerClock(const Making& file) {
  if (futimens(file.descriptor(), nullptr) != 0)
    throw PathError("cannot write", file.path(), errno);
  return SecondsOf(InfoOf(file).st_mtim);
}

/// The text of a lease: host, process and holder. If the file could not be locked, "unlocked" comes
/// first, because no lock then tells whether the process lives.
std::string TextOf(std::string_view holder, bool locked) {
  return Concat(locked ? "" : "unlocked ", HostAndBoot(), " ", getpid(), " ", holder, "\n")
      .substr(0, kMostText);
}

std::string ReadText(const Opened& file) {
  std::array<char, kMostText> text{};
  const ssize_t size = pread(file.descriptor.get(), text.data(), text.size(), 0);
  return {text.data(), static_cast<size_t>(std::max<ssize_t>(0, size))};
}

/// Whether a lease is lost: its holder has ended, or it has expired.
bool IsLost(const Opened& file, const std::string& text, double now, std::chrono::seconds lasts) {
  // Try a shared lock, because NFS gives an exclusive lock only to processes that may write.
  if (text.starts_with(HostAndBoot() + " ")) {
    return flock(file.descriptor.get(), LOCK_SH | LOCK_NB) == 0;
  }
  return now - SecondsOf(file.info.st_mtim) > static_cast<double>(lasts.count());
}

/// Seconds since the last boot, including the time that the machine slept.
double SecondsSinceBoot() {
  timespec now{};
  clock_gettime(CLOCK_BOOTTIME, &now);
  return SecondsOf(now);
}

/// Time of the file server's clock, or of this machine's clock if the folder is not writable.
double NowBeside(const fs::path& path) {
  try {
    return ServerClock(Making(path, Making::Kind::kFile));
  } catch (const Error&) {
    timespec now{};
    clock_gettime(CLOCK_REALTIME, &now);
    return SecondsOf(now);
  }
}

}  // namespace

struct Lease::State {
  fs::path path;
  Descriptor descriptor;  // locked while this process lives
  struct stat info;
  double lasts;  // s
  std::atomic<double> renewed_at{SecondsSinceBoot()};
  std::jthread renewing;

  State(fs::path of, Descriptor opened, const struct stat& what, std::chrono::seconds seconds)
      : path(std::move(of)),
        descriptor(std::move(opened)),
        info(what),
        lasts(static_cast<double>(seconds.count())) {}

  /// Whether the path still belongs to our file.
  bool IsOurs() const {
    struct stat now {};
    return lstat(path.c_str(), &now) == 0 && SameFile(now, info);
  }
  void Renew() {
    if (held() && IsOurs() && futimens(descriptor.get(), nullptr) == 0) {
      renewed_at = SecondsSinceBoot();
    } else if (!IsOurs()) {
      renewed_at = -lasts;  // another process holds the lease
    }
  }
  bool held() const { return SecondsSinceBoot() - renewed_at < lasts; }
};

Lease::Lease(std::unique_ptr<State> state) : state_(std::move(state)) {}
Lease::Lease(Lease&& other) noexcept = default;

Lease::~Lease() {
  if (state_ == nullptr) return;
  state_->renewing.request_stop();
  if (state_->renewing.joinable()) state_->renewing.join();
  if (state_->IsOurs()) unlink(state_->path.c_str());
}

bool Lease::held() const { return state_->held(); }

std::optional<Lease> Lease::Take(const fs::path& path, std::string_view holder,
                                 std::chrono::seconds lasts) {
  const Making own(path, Making::Kind::kFile);
  const bool locked = flock(own.descriptor(), LOCK_EX | LOCK_NB) == 0;
  const std::string text = TextOf(holder, locked);
  if (write(own.descriptor(), text.data(), text.size()) != std::ssize(text)) {
    throw PathError("cannot write", own.path(), errno);
  }
  // Count the links, because some servers make the link and lose the answer.
  const auto take = [&] {
    return link(own.path().c_str(), path.c_str()) == 0 || InfoOf(own).st_nlink == 2;
  };
  bool taken = take();
  if (!taken && errno != EEXIST) throw PathError("cannot write", path, errno);
  if (!taken) {
    const std::optional<Opened> other = Open(path);
    if (other && !IsLost(*other, ReadText(*other), ServerClock(own), lasts)) return std::nullopt;
    if (other) {
      // Of several processes that find the lease lost, one moves it away. A process that moves a
      // new lease away by mistake gives it back.
      const fs::path gone = own.path().string() + "-lost";
      if (rename(path.c_str(), gone.c_str()) != 0) return std::nullopt;
      struct stat moved {};
      const bool same = lstat(gone.c_str(), &moved) == 0 && SameFile(moved, other->info);
      if (!same) (void)!link(gone.c_str(), path.c_str());
      unlink(gone.c_str());
      if (!same) return std::nullopt;
    }
    taken = take();
  }
  if (!taken) return std::nullopt;
  // A duplicate descriptor of the open file keeps the lock after `own` removes its temporary name.
  Descriptor kept(fcntl(own.descriptor(), F_DUPFD_CLOEXEC, 0));
  if (kept.get() < 0) throw PathError("cannot write", path, errno);
  auto state = std::make_unique<State>(path, std::move(kept), InfoOf(own), lasts);
  state->renewing = std::jthread([state = state.get(), lasts](std::stop_token stop) {
    std::mutex mutex;
    std::condition_variable_any asked;
    std::unique_lock lock(mutex);
    while (!asked.wait_for(lock, stop, lasts / 4, [&] { return stop.stop_requested(); })) {
      state->Renew();
    }
  });
  return Lease(std::move(state));
}

std::optional<LeaseInfo> ReadLease(const fs::path& path, std::chrono::seconds lasts) {
  try {
    const std::optional<Opened> file = Open(path);
    if (!file) return std::nullopt;
    const std::string text = ReadText(*file);
    const double now = NowBeside(path);
    return LeaseInfo{std::string(Trim(text)), IsLost(*file, text, now, lasts),
                     now - SecondsOf(file->info.st_mtim)};
  } catch (const Error& error) {
    return LeaseInfo{error.what(), false, 0};
  }
}

}  // namespace upswing
