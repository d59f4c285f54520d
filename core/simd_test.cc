#include "core/simd.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace upswing {
namespace {

TEST(Simd, TakesTheBestPathUnlessTold) {
  const std::vector<std::string> paths = SimdPaths();
  ASSERT_FALSE(paths.empty());
  EXPECT_EQ(SimdPath(), paths.front());
  for (const std::string& path : paths) {
    UseSimdPath(path);
    EXPECT_EQ(SimdPath(), path);
  }
  UseSimdPath(paths.front());
}

TEST(Simd, RefusesAPathThatTheProcessorDoesNotHave) {
  const std::string before = SimdPath();
  EXPECT_THROW(UseSimdPath("avx1024"), Error);
  EXPECT_EQ(SimdPath(), before);
}

}  // namespace
}  // namespace upswing
