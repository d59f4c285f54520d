#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>

/// A test whether the locks of a folder exclude processes, also on different hosts. Some file
/// systems, such as NFS mounted with local_lock, grant every host the same lock.
namespace upswing {

/// Result of CheckLocks.
struct LockCheck {
  std::string mine, other;  // host and process
  bool excludes = false;    // neither process got a lock while the other held it
  bool same_host = false;
};

/// Meets another process that calls this for the same folder. Each of them holds a FileLock while
/// the other tries to get it. Leaves nothing in the folder.
///
/// Throws NoLocks; BadInput if two processes are already there; and Failure if the other process
/// does not answer within `patience` seconds, or does not get a lock that was released. Returns
/// nothing if `stopped` returns true while this process waits.
std::optional<LockCheck> CheckLocks(const std::filesystem::path& folder, double patience,
                                    const std::function<bool()>& stopped);

}  // namespace upswing
