#include "os/command.h"

#include <gtest/gtest.h>

#include <csignal>

namespace upswing {
namespace {

TEST(RunCommand, PassesWordsAndInputAndReturnsTheOutput) {
  const auto done = RunCommand(
      {"sh", "-c", "cat; printf '%s|' \"$@\" >&2; exit 3", "sh", "a b", "$(id)"}, "in\nput");
  ASSERT_TRUE(done);
  EXPECT_EQ(done->output, "in\nput");
  EXPECT_EQ(done->errors, "a b|$(id)|");
  EXPECT_EQ(done->exit_code, 3);
}

TEST(RunCommand, MoreThanAPipeHoldsGoesBothWays) {
  const std::string text(1 << 20, 'x');
  const auto done = RunCommand({"cat"}, text);
  ASSERT_TRUE(done && done->exit_code == 0);
  EXPECT_EQ(done->output, text);
}

TEST(RunCommand, NamesTheSignalThatEndedIt) {
  const auto done = RunCommand({"sh", "-c", "kill -TERM $$"});
  ASSERT_TRUE(done);
  EXPECT_EQ(done->signal, SIGTERM);
}

TEST(RunCommand, NothingWhereThereIsNoSuchProgram) {
  EXPECT_FALSE(RunCommand({"no-such-program-of-upswing"}));
}

}  // namespace
}  // namespace upswing
