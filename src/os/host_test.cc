#include "os/host.h"

#include <gtest/gtest.h>

#include "base/testing.h"

namespace upswing {
namespace {

TEST(ResolveThreads, TakesANumberAsItIs) {
  EXPECT_EQ(ResolveThreads(1), 1);
  EXPECT_EQ(ResolveThreads(3), 3);
  EXPECT_EQ(ResolveThreads(12), 12);  // more than its own limit of 8
}

TEST(ResolveThreads, ChoosesAsManyAsItMayUseUpToEight) {
  EXPECT_GE(ResolveThreads(0), 1);
  EXPECT_LE(ResolveThreads(0), 8);
  EXPECT_GE(UsableProcessors(), ResolveThreads(0));
  const OnOneProcessor one;
  EXPECT_EQ(UsableProcessors(), 1);
  EXPECT_EQ(ResolveThreads(0), 1);
  EXPECT_EQ(ResolveThreads(2), 2);
}

}  // namespace
}  // namespace upswing
