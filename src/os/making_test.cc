#include "os/making.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>

#include <chrono>

#include "base/error.h"
#include "os/file.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;
using Kind = Making::Kind;

int64_t CountIn(const fs::path& folder) {
  return std::distance(fs::directory_iterator(folder), {});
}

TEST(Making, AFolderAppearsUnderItsNameWhenItIsPublished) {
  const TempFolder temp;
  {
    Making folder(temp / "run", Kind::kFolder);
    WriteFileAtomically(folder.path() / "a", "text");
    EXPECT_FALSE(fs::exists(temp / "run"));
    EXPECT_TRUE(IsMakingName(folder.path().filename().string()));
    folder.Publish();
  }
  EXPECT_EQ(ReadOwnFile(temp / "run/a"), "text");
  EXPECT_EQ(CountIn(temp.path()), 1);
}

TEST(Making, AnUnpublishedFileIsRemoved) {
  const TempFolder temp;
  for (const Kind kind : {Kind::kFile, Kind::kFolder}) {
    const Making making(temp / "a", kind);
    EXPECT_EQ(CountIn(temp.path()), 1);
  }
  EXPECT_EQ(CountIn(temp.path()), 0);
}

/// The digits of this host in a temporary name.
std::string OwnDigits() {
  const TempFolder temp;
  const std::string name = Making(temp / "a", Kind::kFile).path().filename();
  return name.substr(name.size() - 16, 8) + "01234567";
}

TEST(Making, TheNextProcessRemovesOnlyTheFilesOfAKilledOne) {
  const TempFolder temp;
  const fs::path left = temp / (".run.making-" + OwnDigits());
  fs::create_directories(left / "below");
  WriteFileAtomically(temp / (".b.making-" + OwnDigits()), "half");
  const fs::path others[] = {temp / ".run.making-0123456789abcde",
                             temp / "x.making-0123456789abcdef",
                             temp / ".run.making-0123456789ABCDEF"};
  for (const fs::path& other : others) fs::create_directory(other);
  const Making first(temp / "a", Kind::kFile);
  {
    const Making second(temp / "b", Kind::kFolder);  // does not remove the first, which is locked
    EXPECT_TRUE(fs::exists(first.path()));
    EXPECT_TRUE(fs::exists(second.path()));
  }
  EXPECT_FALSE(fs::exists(left));
  for (const fs::path& other : others) EXPECT_TRUE(fs::exists(other)) << other;
  EXPECT_EQ(CountIn(temp.path()), 4);
}

TEST(Making, AFileOfAnotherHostStaysForAnHour) {
  // Another host's locks may be invisible here.
  const TempFolder temp;
  const fs::path folder = temp / ".run.making-0123456789abcdef";
  const fs::path file = temp / ".b.making-0123456789abcdef";
  fs::create_directory(folder);
  WriteFileAtomically(file, "half");
  for (const fs::path& path : {folder, file}) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::minutes(55));
  }
  { const Making another(temp / "a", Kind::kFile); }
  EXPECT_EQ(CountIn(temp.path()), 2);
  for (const fs::path& path : {folder, file}) {
    fs::last_write_time(path, fs::file_time_type::clock::now() - std::chrono::minutes(65));
  }
  { const Making another(temp / "a", Kind::kFile); }
  EXPECT_EQ(CountIn(temp.path()), 0);
}

TEST(Making, ALinkInItsNameIsReplacedAndOneLeftBehindIsNotFollowed) {
  const TempFolder temp;
  fs::create_directory(temp / "precious");
  WriteFileAtomically(temp / "precious/file", "mine");
  fs::create_symlink("precious", temp / (".x.making-" + OwnDigits()));
  fs::create_symlink("precious/file", temp / "a");
  Making file(temp / "a", Kind::kFile);
  file.Publish();
  EXPECT_FALSE(fs::is_symlink(temp / "a"));
  EXPECT_EQ(ReadOwnFile(temp / "precious/file"), "mine");
}

TEST(Making, ModesFollowTheUmask) {
  const TempFolder temp;
  const auto mode = [](const fs::path& path) {
    struct stat info {};
    stat(path.c_str(), &info);
    return info.st_mode & 0777;
  };
  const mode_t before = umask(0027);
  for (const Kind kind : {Kind::kFile, Kind::kFolder}) {
    const fs::path path = temp / (kind == Kind::kFile ? "file" : "folder");
    Making making(path, kind);
    making.Publish();
    EXPECT_EQ(mode(path), kind == Kind::kFile ? 0640 : 0750);
  }
  umask(before);
}

TEST(Making, WhereNothingCanBeMadeIsBadInput) {
  const TempFolder temp;
  WriteFileAtomically(temp / "file", "mine");
  fs::create_symlink("loop", temp / "loop");
  for (const char* path : {"file/a", "none/a", "loop/a"}) {
    try {
      const Making making(temp / path, Kind::kFile);
      FAIL() << path;
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2) << error.what();
    }
  }
}

}  // namespace
}  // namespace upswing
