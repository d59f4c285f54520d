#include "base/simd.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <set>

#include "base/error.h"

// foreach_target.h includes this file again to compile the rest once per target.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "base/simd_test.cc"
#include <hwy/foreach_target.h>
// Must come after foreach_target.h.
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace upswing::HWY_NAMESPACE {

/// A kernel that returns the target of its compilation.
int64_t Target() { return HWY_TARGET; }

}  // namespace upswing::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace upswing {
namespace {

HWY_EXPORT(Target);

/// Highway's name of the target that kernels are dispatched to now.
std::string Dispatched() { return hwy::TargetName(HWY_DYNAMIC_DISPATCH(Target)()); }

TEST(Simd, TakesTheBestPathByDefault) {
  const std::vector<std::string> paths = SimdPaths();
  ASSERT_FALSE(paths.empty());
  EXPECT_EQ(SimdPath(), paths.front());
  for (const std::string& path : paths) {
    UseSimdPath(path);
    EXPECT_EQ(SimdPath(), path);
  }
  UseSimdPath(paths.front());
}

TEST(Simd, EachPathRunsTheKernelsOfItsTarget) {
  const std::vector<std::string> paths = SimdPaths();
  std::set<std::string> seen;
  for (const std::string& path : paths) {
    const int64_t target = path == "avx512" ? HWY_AVX3
                           : path == "avx2" ? HWY_AVX2
                                            : HWY_STATIC_TARGET;
    UseSimdPath(path);
    EXPECT_EQ(Dispatched(), hwy::TargetName(target)) << path;
    seen.insert(Dispatched());
  }
  EXPECT_EQ(seen.size(), paths.size());
  UseSimdPath(paths.front());
}

TEST(Simd, RefusesAPathThatTheProcessorDoesNotHave) {
  const std::string before = SimdPath();
  const std::string dispatched = Dispatched();
  EXPECT_THROW(UseSimdPath("avx1024"), Error);
  EXPECT_EQ(SimdPath(), before);
  EXPECT_EQ(Dispatched(), dispatched);
}

}  // namespace
}  // namespace upswing
#endif  // HWY_ONCE
