#include "os/making.h"

#include <algorithm>
#include <cerrno>
#include <random>
#include <utility>

#include "base/checksum.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "os/making_name.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kMark = ".making-";
constexpr int kDigits = 16, kHostDigits = 8;
constexpr int kMostTries = 100;  // one try is enough unless another process interferes

/// Digits that identify this host in temporary names.
std::string HostDigits() {
  Checksum host;
  host.Update(BytesOf(HostAndBoot()));
  return host.Hex().substr(0, kHostDigits);
}

}  // namespace

Descriptor::Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(fd_, other.fd_);
  return *this;
}

std::string MakingName(std::string_view name) {
  constexpr size_t kLongest = 200;  // bytes of NAME, so that the rest fits into 255
  const auto random = HexDigits(std::random_device()(), kDigits - kHostDigits);
  return Concat('.', name.substr(0, kLongest), kMark, HostDigits(), random);
}

bool IsOfThisHost(std::string_view name) {
  return name.substr(name.size() - kDigits, kHostDigits) == HostDigits();
}

bool IsMakingName(std::string_view name) {
  if (name.size() < 1 + kMark.size() + kDigits || name.front() != '.') return false;
  const std::string_view end = name.substr(name.size() - kMark.size() - kDigits);
  const auto is_digit = [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); };
  return end.starts_with(kMark) && std::ranges::all_of(end.substr(kMark.size()), is_digit);
}

Making::Making(const fs::path& path, Kind kind)
    : target_(path), folder_(OpenParent()), descriptor_(-1) {
  if (folder_.get() < 0) throw PathError("cannot write", target_, errno);
  RemoveAbandoned();
  for (int tries = 1;; ++tries) {
    name_ = MakingName(target_.filename().string());
    path_ = target_.parent_path() / name_;
    if (TryOpen(kind)) return;
    if (tries == kMostTries) throw PathError("cannot write", target_, EEXIST);
  }
}

Making::~Making() {
  if (published_) return;
  descriptor_ = Descriptor(-1);  // Windows keeps the name of an open folder
  std::error_code error;
  fs::remove_all(path_, error);
}

}  // namespace upswing
