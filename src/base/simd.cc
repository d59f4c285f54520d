#include "base/simd.h"

#include <hwy/targets.h>

#include <algorithm>
#include <cstdint>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

struct Path {
  int64_t target;  // Highway's bit for the target
  std::string_view name;
};

/// All paths that a compiler can produce, best first.
constexpr Path kPaths[] = {{HWY_AVX3, "avx512"},     {HWY_AVX2, "avx2"},
                           {HWY_NEON, "neon"},       {HWY_WASM, "wasm128"},
                           {HWY_EMU128, "portable"}, {HWY_SCALAR, "portable"}};
static_assert((HWY_DISABLED_TARGETS & (HWY_AVX3 | HWY_AVX2 | HWY_NEON | HWY_WASM)) == 0);

/// The compiled paths that this processor supports, best first. The last path is the compiler's
/// baseline, which every processor of the architecture supports.
const std::vector<Path>& Paths() {
  static const std::vector<Path> kUsable = [] {
    std::vector<Path> found;
    const int64_t supported = (hwy::SupportedTargets() & HWY_TARGETS) | HWY_STATIC_TARGET;
    for (const Path& path : kPaths) {
      if ((supported & path.target) != 0) found.push_back(path);
    }
    if (std::ranges::find(found, HWY_STATIC_TARGET, &Path::target) == found.end()) {
      found.push_back({HWY_STATIC_TARGET, "portable"});
    }
    return found;
  }();
  return kUsable;
}

}  // namespace

std::vector<std::string> SimdPaths() { return NamesOf(Paths()); }

std::string SimdPath() {
  const int64_t usable = hwy::SupportedTargets();
  const auto used =
      std::ranges::find_if(Paths(), [&](const Path& path) { return (usable & path.target) != 0; });
  return std::string(used == Paths().end() ? Paths().back().name : used->name);
}

void UseSimdPath(std::string_view path) {
  const auto found = std::ranges::find(Paths(), path, &Path::name);
  if (found == Paths().end()) {
    throw BadInput(Concat("vector instructions: expected one of ", Join(SimdPaths(), ", "),
                          " on this processor, got '", path, "'"));
  }
  hwy::SetSupportedTargetsForTest(found->target);
}

bool UseBestSimdPath() {
  hwy::SetSupportedTargetsForTest(Paths().front().target);
  return true;
}

}  // namespace upswing
