#pragma once

#include <cstdint>
#include <string>
#include <string_view>

/// Names of files and folders under construction, for the parts of os/making.h.
namespace upswing {

// A file or folder of another host without a change for this long is abandoned. Its lock tells
// nothing: on NFS and others, only the own host knows a folder's lock.
inline constexpr int64_t kAbandonedAfter = 3600;  // s

/// A temporary name for `name`.
std::string MakingName(std::string_view name);
/// Whether a temporary name belongs to this host.
bool IsOfThisHost(std::string_view name);

}  // namespace upswing
