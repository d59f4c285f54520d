#include "os/lock_check.h"

#include <gtest/gtest.h>

#include <cerrno>
#include <functional>

#include "base/error.h"
#include "os/file.h"
#include "os/lock.h"
#include "os/lock_testing.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

constexpr double kPatience = 60;  // s

bool GoOn() { return false; }

/// The result as an exit code: 0 if locks exclude, 1 if not, 2 without locks, 3 otherwise.
int CodeOfCheck(const fs::path& folder) {
  try {
    const auto check = CheckLocks(folder, kPatience, GoOn);
    return check && check->excludes ? 0 : 1;
  } catch (const NoLocks&) {
    return 2;
  } catch (const Error&) {
    return 3;
  }
}

TEST(LockCheck, TwoProcessesKeepEachOtherOut) {
  const TempFolder folder;
  const pid_t child = fork();
  if (child == 0) _exit(CodeOfCheck(folder.path()));
  const auto check = CheckLocks(folder.path(), kPatience, GoOn);
  EXPECT_EQ(ExitCodeOf(child), 0);
  ASSERT_TRUE(check);
  EXPECT_TRUE(check->excludes);
  EXPECT_TRUE(check->same_host);
  EXPECT_TRUE(check->other.ends_with(Concat(" ", child))) << check->other;
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(LockCheck, FindsAFileSystemThatGrantsEveryLock) {
  const TempFolder folder;
  const auto check = [&] { return CodeOfCheck(folder.path()); };
  const pid_t one = StartWithFakeLocks(0, check), two = StartWithFakeLocks(0, check);
  const int first = ExitCodeOf(one), second = ExitCodeOf(two);
  if (first == 77 || second == 77) GTEST_SKIP() << "this system cannot filter system calls";
  EXPECT_EQ(first, 1);
  EXPECT_EQ(second, 1);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(LockCheck, NamesAFileSystemWithoutLocks) {
  const TempFolder folder;
  const int code =
      ExitCodeOf(StartWithFakeLocks(ENOLCK, [&] { return CodeOfCheck(folder.path()); }));
  EXPECT_TRUE(code == 2 || code == 77) << code;
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(LockCheck, WithoutAnAnswerItEndsAndLeavesNothing) {
  const TempFolder folder;
  EXPECT_THROW(CheckLocks(folder.path(), 0.1, GoOn), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
  EXPECT_FALSE(CheckLocks(folder.path(), kPatience, [] { return true; }));
  EXPECT_TRUE(fs::is_empty(folder.path()));
  // The folder of a first process that was killed.
  fs::create_directory(folder.path() / ".lock-check");
  EXPECT_THROW(CheckLocks(folder.path(), 0.1, GoOn), Error);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(LockCheck, AThirdProcessIsRefused) {
  const TempFolder folder;
  fs::create_directories(folder.path() / ".lock-check/second");
  EXPECT_THROW(CheckLocks(folder.path(), kPatience, GoOn), Error);
  EXPECT_TRUE(fs::exists(folder.path() / ".lock-check/second"));
  EXPECT_THROW(CheckLocks(folder.path() / "missing", kPatience, GoOn), Error);
}

}  // namespace
}  // namespace upswing
