#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace upswing {

/// A claim on a piece of work in a folder that many processes and hosts share. The claim is a file
/// that only one process holds at a time.
///
/// The holder makes the file under a temporary name and gives it the final name by `link`, which is
/// atomic even on NFS. A thread renews the modification time, by the file server's clock, as a sign
/// of life. A lease expires some time after the last renewal. A lease of a process on this host,
/// where locks tell, expires exactly when that process ends.
class Lease {
 public:
  /// Usual lifetime without renewal. Renewal is four times as frequent, because NFS may show a time
  /// that is a minute old.
  static constexpr std::chrono::seconds kUsual{180};

  /// Claims `path`; nothing if another process holds it. The file contains `holder`, one line.
  /// Throws as PathError does.
  static std::optional<Lease> Take(const std::filesystem::path& path, std::string_view holder,
                                   std::chrono::seconds lasts = kUsual);
  /// Gives the lease back.
  ~Lease();
  Lease(Lease&& other) noexcept;
  Lease& operator=(Lease&&) = delete;

  /// Whether this process certainly still holds the lease. After a long halt, or without an answer
  /// from the file server, another process may have taken it. Takes no time.
  bool held() const;

 private:
  struct State;
  explicit Lease(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// State of a lease as other processes see it.
struct LeaseInfo {
  std::string holder;  // text of the file, or a description of its fault
  bool lost = false;   // whether it has expired or its holder has ended
  double seconds = 0;  // since its last renewal
};

/// Reads the state of a lease; nothing if there is none.
std::optional<LeaseInfo> ReadLease(const std::filesystem::path& path,
                                   std::chrono::seconds lasts = Lease::kUsual);

}  // namespace upswing
