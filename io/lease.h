#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace upswing {

/// A claim on a piece of work in a folder that any number of processes and hosts share: a file that
/// one of them has at a time. It is made under a name of its own and given its final one by `link`,
/// which is atomic on NFS too. Its modification time, by the file server's clock, says that the
/// holder lives: a thread renews it. A lease runs out a while after the last renewal; that of a
/// process of this host, where locks tell, when that process ends and not before.
class Lease {
 public:
  /// How long one lasts without renewal. Renewed four times as often, as NFS may show a time that
  /// is a minute old.
  static constexpr std::chrono::seconds kUsual{180};

  /// Claims `path`, or nothing if another process holds it. The file says `holder`, one line.
  /// Throws as PathError does.
  static std::optional<Lease> Take(const std::filesystem::path& path, std::string_view holder,
                                   std::chrono::seconds lasts = kUsual);
  /// Gives it back.
  ~Lease();
  Lease(Lease&& other) noexcept;
  Lease& operator=(Lease&&) = delete;

  /// Whether it is certainly still this process's. If this one was halted for long, or the file
  /// server did not answer, another one may have taken it. Takes no time.
  bool held() const;

 private:
  struct State;
  explicit Lease(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// What is known of a lease without taking it.
struct LeaseInfo {
  std::string holder;  // or what is wrong with the file
  bool lost = false;   // it has run out, or its holder has ended
  double seconds = 0;  // since its last renewal
};

/// Looks at a lease; nothing if there is none.
std::optional<LeaseInfo> ReadLease(const std::filesystem::path& path,
                                   std::chrono::seconds lasts = Lease::kUsual);

}  // namespace upswing
