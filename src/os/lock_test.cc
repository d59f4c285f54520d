#include "os/lock.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/error.h"
#include "os/lock_testing.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

class LockTest : public ::testing::Test {
 protected:
  TempFolder temp_;
  fs::path folder_ = temp_.path();
};

/// Runs `call` in a process without locks. Returns its result; 77 if there can be no such process.
int ResultWithoutLocks(int error_number, const std::function<int()>& call) {
  return ExitCodeOf(StartWithFakeLocks(error_number, call));
}

/// 0 if `call` throws NoLocks with the cause in its message.
int Refuses(int error_number, const std::function<void()>& call) {
  try {
    call();
  } catch (const NoLocks& error) {
    const std::string message = error.what();
    return message.starts_with("cannot lock ") &&
                   message.find(std::strerror(error_number)) != std::string::npos
               ? 0
               : 1;
  }
  return 2;
}

TEST_F(LockTest, AFolderIsLockedForOneAtATime) {
  {
    const FolderLock lock(folder_);
    EXPECT_THROW(FolderLock{folder_}, Error);
  }
  EXPECT_NO_THROW(FolderLock{folder_});
}

TEST_F(LockTest, AFolderIsLockedBeforeItAppears) {
  const fs::path path = folder_ / "run";
  std::optional<FolderLock> lock;
  {
    Making folder(path, Making::Kind::kFolder);
    lock.emplace(folder);
    folder.Publish();
  }
  EXPECT_THROW(FolderLock{path}, FolderBusy);
  lock.reset();
  EXPECT_NO_THROW(FolderLock{path});
}

TEST_F(LockTest, AFileIsOpenedOnceAtATime) {
  const fs::path path = folder_ / "log.csv";
  {
    const auto file = OpenLocked(path);
    ASSERT_TRUE(file);
    EXPECT_TRUE(file->is_new());
    EXPECT_FALSE(OpenLocked(path));
  }
  const auto again = OpenLocked(path);
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->is_new());
}

TEST_F(LockTest, WithoutLocksTheCauseIsSaidAndNothingIsLeft) {
  for (const int number : {ENOLCK, EOPNOTSUPP, ENOSYS}) {
    fs::create_directory(folder_ / "old");
    WriteFileAtomically(folder_ / "old/file", "mine");
    const auto refuses = [&](const std::function<void()>& call) {
      const int result = ResultWithoutLocks(number, [&] { return Refuses(number, call); });
      EXPECT_TRUE(result == 0 || result == 77) << result;
    };
    refuses([&] { (void)OpenLocked(folder_ / "file"); });
    refuses([&] { const FileLock lock(folder_ / "file"); });
    refuses([&] { const FolderLock lock(folder_ / "old"); });
    refuses([&] { ExpectFileLocks(folder_); });
    refuses([&] { const FileLock lock(folder_ / "old/file"); });
    refuses([&] {
      Making folder(folder_ / "new", Making::Kind::kFolder);
      const FolderLock lock(folder);
    });
    EXPECT_EQ(ReadOwnFile(folder_ / "old/file"), "mine");
    fs::remove_all(folder_ / "old");
    EXPECT_TRUE(fs::is_empty(folder_));
  }
}

TEST_F(LockTest, AFileLockHasOneHolderAndLeavesNothing) {
  const fs::path path = folder_ / "seed1.claim";
  EXPECT_FALSE(FileLock::IsHeld(path));
  {
    const FileLock lock(path);
    EXPECT_TRUE(lock.held());
    EXPECT_TRUE(FileLock::IsHeld(path));
    EXPECT_FALSE(FileLock(path).held());
    EXPECT_EQ(ReadOwnFile(path), FileLock::Holder(getpid()));
  }
  EXPECT_TRUE(fs::is_empty(folder_));
  EXPECT_TRUE(FileLock(path).held());
}

TEST_F(LockTest, AFileLockEndsWithItsProcessWhateverItsChildrenDo) {
  const fs::path path = folder_ / "seed1.claim";
  const pid_t child = fork();
  if (child == 0) {
    const FileLock lock(path);
    const bool started = std::system("sleep 10 >/dev/null 2>&1 &") == 0;
    _exit(lock.held() && started ? 0 : 1);  // as if killed: removes no file
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  EXPECT_EQ(ReadOwnFile(path), FileLock::Holder(child));
  EXPECT_FALSE(FileLock::IsHeld(path));
  EXPECT_TRUE(FileLock(path).held());
}

TEST_F(LockTest, AFileLockHasOneHolderWhileOthersRemoveTheFile) {
  constexpr int kEach = 30;
  const fs::path path = folder_ / "seed1.claim";
  std::atomic<int> holders{0};
  std::atomic<bool> several{false};
  std::vector<std::thread> threads;
  for (int thread = 0; thread < 4; ++thread) {
    threads.emplace_back([&] {
      for (int times = 0; times < kEach;) {
        const FileLock lock(path);
        if (!lock.held()) continue;
        if (++holders > 1) several = true;
        std::this_thread::sleep_for(std::chrono::microseconds(200));
        ++times;
        --holders;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_FALSE(several);
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(LockTest, AFileLockDoesNotRemoveTheFileOfAnother) {
  const fs::path path = folder_ / "seed1.claim";
  {
    const FileLock lock(path);
    fs::remove(path);
    WriteFileAtomically(path, "of another\n");
  }
  EXPECT_EQ(ReadOwnFile(path), "of another\n");
}

TEST_F(LockTest, AFileLockIsNotTakenThroughLinksPipesAndFolders) {
  const fs::path path = folder_ / "seed1.claim";
  const auto refuse = [&] {
    EXPECT_THROW(FileLock{path}, Error);
    EXPECT_FALSE(FileLock::IsHeld(path));
    fs::remove(path);
  };
  WriteFileAtomically(folder_ / "target", "mine");
  fs::create_symlink("target", path);
  refuse();
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  refuse();
  fs::create_directory(path);
  refuse();
  EXPECT_EQ(ReadOwnFile(folder_ / "target"), "mine");
  EXPECT_THROW(FileLock{folder_ / "none/seed1.claim"}, Error);
}

}  // namespace
}  // namespace upswing
