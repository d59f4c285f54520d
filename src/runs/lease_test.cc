#include "runs/lease.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <thread>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/host.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;

size_t FilesIn(const fs::path& folder) {
  return static_cast<size_t>(std::distance(fs::directory_iterator(folder), {}));
}

/// Makes a lease look as if its last renewal was `by_seconds` earlier.
void Age(const fs::path& path, int64_t by_seconds) {
  fs::last_write_time(path, fs::last_write_time(path) - seconds(by_seconds));
}

/// Writes a lease as another host leaves it.
void WriteForeign(const fs::path& path) { std::ofstream(path) << "elsewhere/0123abcd 17 worker\n"; }

TEST(Lease, OneHolderAtATimeAndNothingIsLeft) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  {
    const auto lease = Lease::Take(path, "a worker");
    ASSERT_TRUE(lease);
    EXPECT_TRUE(lease->held());
    EXPECT_FALSE(Lease::Take(path, "another one"));
    EXPECT_EQ(ReadOwnFile(path), Concat(HostAndBoot(), " ", getpid(), " a worker\n"));
    EXPECT_EQ(FilesIn(folder.path()), 1U);
  }
  EXPECT_EQ(FilesIn(folder.path()), 0U);
  EXPECT_TRUE(Lease::Take(path, "another one"));
}

TEST(Lease, ALeaseOfAnotherHostExpiresWithoutRenewal) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  WriteForeign(path);
  Age(path, 150);
  EXPECT_FALSE(Lease::Take(path, "here"));
  EXPECT_FALSE(ReadLease(path)->lost);
  Age(path, 60);
  EXPECT_TRUE(ReadLease(path)->lost);
  EXPECT_GT(ReadLease(path)->seconds, 180);
  const auto lease = Lease::Take(path, "here");
  ASSERT_TRUE(lease);
  EXPECT_TRUE(lease->held());
  EXPECT_FALSE(ReadLease(path)->lost);
  EXPECT_EQ(FilesIn(folder.path()), 1U);
}

TEST(Lease, ALeaseOfAnEndedProcessIsFreeAtOnce) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  const pid_t child = fork();
  if (child == 0) {
    const auto lease = Lease::Take(path, "soon gone");
    _exit(lease ? 0 : 1);  // as if killed, without giving the lease back
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_EQ(status, 0);
  ASSERT_TRUE(fs::exists(path));
  EXPECT_TRUE(ReadLease(path)->lost);
  EXPECT_TRUE(Lease::Take(path, "here"));
}

TEST(Lease, IsRenewedAsLongAsItIsHeld) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  const auto lease = Lease::Take(path, "here", seconds(1));
  ASSERT_TRUE(lease);
  Age(path, 100);
  const auto deadline = std::chrono::steady_clock::now() + seconds(30);
  while (ReadLease(path)->seconds > 50 && std::chrono::steady_clock::now() < deadline) {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  EXPECT_LT(ReadLease(path)->seconds, 50);
}

TEST(Lease, AHaltedHolderSeesThatItLostItsLease) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  {
    const auto lease = Lease::Take(path, "halted", seconds(1));
    ASSERT_TRUE(lease);
    fs::remove(path);
    WriteForeign(path);
    const auto deadline = std::chrono::steady_clock::now() + seconds(30);
    while (lease->held() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_FALSE(lease->held());
  }
  EXPECT_TRUE(fs::exists(path));
}

TEST(Lease, ALeaseOfALivingProcessOfThisHostDoesNotExpire) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  const auto lease = Lease::Take(path, "here");
  ASSERT_TRUE(lease);
  Age(path, 1000);  // as after a night of sleep
  EXPECT_FALSE(ReadLease(path)->lost);
  EXPECT_FALSE(Lease::Take(path, "another one"));
}

// Two processes can hold a lease until they renew it. One of them gives back a new lease that it
// moved away by mistake, and another takes the free name meanwhile.
TEST(Lease, OneOfManyThatFindItLostGetsIt) {
  const TempFolder folder;
  {
    std::vector<std::vector<std::optional<Lease>>> rounds(50);
    for (size_t round = 0; round < rounds.size(); ++round) {
      const fs::path path = folder.path() / std::to_string(round);
      WriteForeign(path);
      Age(path, 1000);
      rounds[round].resize(4);
      std::vector<std::thread> threads;
      std::atomic<int> ready{0};
      for (auto& lease : rounds[round]) {
        threads.emplace_back([&] {
          ++ready;
          while (ready < 4) {
          }
          if (auto taken = Lease::Take(path, "one of them", seconds(20))) {
            lease.emplace(std::move(*taken));
          }
        });
      }
      for (std::thread& thread : threads) thread.join();
    }
    const auto one_each = [&] {
      return std::all_of(rounds.begin(), rounds.end(), [](const auto& leases) {
        return std::count_if(leases.begin(), leases.end(),
                             [](const auto& lease) { return lease && lease->held(); }) == 1;
      });
    };
    const auto deadline = std::chrono::steady_clock::now() + seconds(60);
    while (!one_each() && std::chrono::steady_clock::now() < deadline) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    EXPECT_TRUE(one_each());
  }
  EXPECT_EQ(FilesIn(folder.path()), 0U);
}

TEST(Lease, LinksAndOtherThingsAreNotFollowed) {
  const TempFolder folder;
  const fs::path path = folder.path() / "seed1.claim";
  WriteForeign(folder.path() / "mine");
  fs::create_symlink("mine", path);
  EXPECT_THROW((void)Lease::Take(path, "here"), Error);
  fs::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  EXPECT_THROW((void)Lease::Take(path, "here"), Error);
  EXPECT_FALSE(ReadLease(path)->lost);
  EXPECT_THROW((void)Lease::Take(folder.path() / "none/seed1.claim", "here"), Error);
}

}  // namespace
}  // namespace upswing
