#include "core/simd.h"

#include <hwy/targets.h>

#include <algorithm>
#include <cstdint>

#include "core/error.h"
#include "core/text.h"

namespace upswing {
namespace {

struct Path {
  int64_t target;  // Highway's bit
  std::string name;
};

/// What this processor has and the program was compiled for, best first. The last is the
/// compiler's own baseline, which every processor of the architecture has.
const std::vector<Path>& Paths() {
  static const std::vector<Path> paths = [] {
    std::vector<Path> found;
    const int64_t supported = hwy::SupportedTargets() & HWY_TARGETS & ~HWY_STATIC_TARGET;
    for (const Path& path : {Path{HWY_AVX3, "avx512"}, Path{HWY_AVX2, "avx2"}}) {
      if ((supported & path.target) != 0) found.push_back(path);
    }
    const bool neon = HWY_STATIC_TARGET == HWY_NEON;
    const bool wasm = HWY_STATIC_TARGET == HWY_WASM;
    found.push_back({HWY_STATIC_TARGET, neon ? "neon" : wasm ? "wasm128" : "portable"});
    return found;
  }();
  return paths;
}

}  // namespace

std::vector<std::string> SimdPaths() {
  std::vector<std::string> names;
  for (const Path& path : Paths()) names.push_back(path.name);
  return names;
}

std::string SimdPath() {
  const int64_t usable = hwy::SupportedTargets();
  const auto used =
      std::ranges::find_if(Paths(), [&](const Path& path) { return (usable & path.target) != 0; });
  return used == Paths().end() ? Paths().back().name : used->name;
}

void UseSimdPath(std::string_view path) {
  const auto found = std::ranges::find(Paths(), path, &Path::name);
  if (found == Paths().end()) {
    throw BadInput(Concat("vector instructions: expected one of ", Join(SimdPaths(), ", "),
                          " on this processor, got '", path, "'"));
  }
  hwy::SetSupportedTargetsForTest(found->target);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace upswing
