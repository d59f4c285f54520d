#include "os/file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <vector>

#include "base/error.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

class FileTest : public ::testing::Test {
 protected:
  TempFolder temp_;
  fs::path folder_ = temp_.path();
};

TEST_F(FileTest, WrittenTextIsReadBackAndReplaced) {
  const fs::path path = folder_ / "a";
  WriteFileAtomically(path, "one");
  WriteFileAtomically(path, "three");
  EXPECT_EQ(ReadOwnFile(path), "three");
  WriteFileAtomically(path, "");
  EXPECT_EQ(ReadOwnFile(path), "");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(FileTest, ASmallFileIsARegularOneWithinItsBound) {
  const fs::path path = folder_ / "a";
  WriteFileAtomically(path, "twelve bytes");
  EXPECT_EQ(ReadOwnFile(path, 12), "twelve bytes");
  const auto error_of = [](const fs::path& file, size_t most) -> std::string {
    try {
      ReadOwnFile(file, most);
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  };
  const auto ends = [](const std::string& text, std::string_view end) {
    return text.ends_with(end) ? "" : text;
  };
  EXPECT_EQ(ends(error_of(path, 11), "a: expected at most 11 bytes, got 12"), "");
  EXPECT_EQ(ends(error_of(folder_, 11), ": expected a file, got a folder"), "");
  EXPECT_EQ(ends(error_of(folder_ / "none", 11), "none: No such file or directory"), "");
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0666), 0);
  for (const fs::path& file : {folder_ / "pipe", fs::path("/dev/zero")}) {
    EXPECT_EQ(ends(error_of(file, 11), ": expected a file, got a pipe or a device"), "");
  }
  // A system file that reports a size of 0.
  EXPECT_EQ(
      error_of("/proc/self/status", 11).find("cannot read /proc/self/status: expected at most"),
      0U);
}

TEST_F(FileTest, TheEndOfAFileIsOfARegularOne) {
  WriteFileAtomically(folder_ / "a", "twelve bytes");
  EXPECT_EQ(ReadEnd(folder_ / "a", 5), "bytes");
  EXPECT_EQ(ReadEnd(folder_ / "a", 50), "twelve bytes");
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0666), 0);
  for (const char* name : {"pipe", "none", ""}) EXPECT_EQ(ReadEnd(folder_ / name, 5), "") << name;
}

TEST_F(FileTest, AWriteThatDoesNotFitLeavesTheOldFileAndNothingElse) {
  const fs::path path = folder_ / "a";
  WriteFileAtomically(path, "old");
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(WriteFileAtomically(path, std::string(5000, 'x')), Error);
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(ReadOwnFile(path), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1);
}

TEST_F(FileTest, AFileOfAFolderIsWrittenThroughNoLink) {
  WriteFileAtomically(folder_ / "target", "old");
  fs::create_symlink("target", folder_ / "link");
  fs::create_hard_link(folder_ / "target", folder_ / "twin");
  WriteFileAtomically(folder_ / "link", "new");
  WriteFileAtomically(folder_ / "twin", "new");
  EXPECT_FALSE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(ReadOwnFile(folder_ / "link"), "new");
  EXPECT_EQ(ReadOwnFile(folder_ / "target"), "old");
}

TEST_F(FileTest, AnOutputFollowsTheUsersOwnLinkAndADeviceIsWrittenInPlace) {
  WriteFileAtomically(folder_ / "target", "old");
  fs::create_symlink("target", folder_ / "link");
  WriteNamedFile(folder_ / "link", "new");
  EXPECT_TRUE(fs::is_symlink(folder_ / "link"));
  EXPECT_EQ(ReadOwnFile(folder_ / "target"), "new");
  WriteNamedFile("/dev/null", "gone");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(FileTest, AnImpossibleOutputIsBadInputAndAFullDiskIsNot) {
  fs::create_symlink("loop", folder_ / "loop");
  fs::create_symlink("nowhere", folder_ / "lost");
  fs::create_directory(folder_ / "folder");
  WriteFileAtomically(folder_ / "file", "mine");
  const auto exit_code = [](const fs::path& path) {
    try {
      WriteNamedFile(path, "text");
      return 0;
    } catch (const Error& error) {
      return error.exit_code();
    }
  };
  for (const char* name : {"loop", "lost", "folder", "file/below", "none/below", "folder/"}) {
    EXPECT_EQ(exit_code(folder_ / name), 2) << name;
  }
  EXPECT_EQ(exit_code("/dev/full"), 1);
  EXPECT_EQ(ReadOwnFile(folder_ / "file"), "mine");
}

TEST_F(FileTest, APipeInAFolderIsNotWaitedFor) {
  ASSERT_EQ(mkfifo((folder_ / "pipe").c_str(), 0666), 0);
  EXPECT_THROW(ReadOwnFile(folder_ / "pipe"), Error);
  EXPECT_THROW(AppendFile(folder_ / "pipe"), Error);
}

TEST_F(FileTest, ANewOrEmptyFolderIsTakenAndNothingElse) {
  MakeNewFolder(folder_ / "a/b");
  EXPECT_TRUE(fs::is_directory(folder_ / "a/b"));
  EXPECT_NO_THROW(MakeNewFolder(folder_ / "a/b"));
  WriteFileAtomically(folder_ / "file", "kept");
  fs::create_symlink("nowhere", folder_ / "link");
  for (const char* taken : {"a", "file", "link"}) {
    EXPECT_THROW(CheckFree(folder_ / taken), Error) << taken;
    EXPECT_THROW(MakeNewFolder(folder_ / taken), Error) << taken;
  }
  try {
    CheckFree(folder_ / "a", "go on with it");
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    EXPECT_EQ(error.what(), (folder_ / "a").string() +
                                ": expected a new or empty folder, got one "
                                "that is not empty (go on with it)");
  }
  EXPECT_EQ(ReadOwnFile(folder_ / "file"), "kept");
  EXPECT_NO_THROW(CheckFree(folder_ / "file/below"));
  EXPECT_THROW(MakeNewFolder(folder_ / "file/below"), Error);
}

TEST_F(FileTest, MissingFilesAndFoldersAreBadInput) {
  for (const fs::path& path : {folder_ / "missing", folder_}) {
    try {
      ReadOwnBytes(path);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      EXPECT_NE(std::string(error.what()).find(path.string()), std::string::npos);
    }
  }
  EXPECT_THROW(WriteFileAtomically(folder_ / "no" / "such", "x"), Error);
}

TEST_F(FileTest, ANewFolderIsRemovedUnlessItIsKept) {
  fs::create_directory(folder_ / "old");
  { const NewFolder folder(folder_ / "old/a/b"); }
  { const NewFolder folder(folder_ / "old"); }
  EXPECT_TRUE(fs::is_empty(folder_ / "old"));
  {
    const NewFolder folder(folder_ / "old/a/b");
    WriteFileAtomically(folder_ / "old/a/of another", "");
  }
  EXPECT_TRUE(fs::exists(folder_ / "old/a/of another"));
  EXPECT_FALSE(fs::exists(folder_ / "old/a/b"));
  NewFolder(folder_ / "old/a/c/").Keep();
  EXPECT_TRUE(fs::is_directory(folder_ / "old/a/c"));
  EXPECT_THROW(NewFolder(folder_ / "old/a/of another/d"), Error);
}

TEST_F(FileTest, AppendFileIsCutBackToAGivenSize) {
  const fs::path path = folder_ / "log";
  {
    AppendFile file(path);
    file.Append("first\n");
    EXPECT_EQ(file.size(), 6);
    file.Append("after the checkpoint\n");
  }
  {
    AppendFile file(path);
    EXPECT_EQ(file.size(), 27);
    file.CutTo(6);
    file.Append("again\n");
  }
  EXPECT_EQ(ReadOwnFile(path), "first\nagain\n");
}

TEST_F(FileTest, AppendFileIsOpenedThroughNoLink) {
  WriteFileAtomically(folder_ / "target", "mine");
  fs::create_symlink("target", folder_ / "link");
  fs::create_symlink("nowhere", folder_ / "lost");
  fs::create_hard_link(folder_ / "target", folder_ / "twin");
  for (const char* name : {"link", "lost", "twin"}) {
    try {
      AppendFile file(folder_ / name);
      FAIL() << name;
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      const std::string expected =
          (folder_ / name).string() + ": expected a regular file that only this folder has";
      EXPECT_NE(std::string(error.what()).find(expected), std::string::npos) << error.what();
    }
  }
  EXPECT_EQ(ReadOwnFile(folder_ / "target"), "mine");
  EXPECT_FALSE(fs::exists(folder_ / "nowhere"));
}

}  // namespace
}  // namespace upswing
