// The promises of docs/howto/protection.md under random faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <string>

#include "base/rng.h"
#include "extras/machine/drive/adverse_testing.h"

namespace upswing::machine {
namespace {

TEST(AdverseMachine, GetsOnlyTorquesThatAreSafe) {
  const char* wanted = std::getenv("UPSWING_LOOP_CYCLES");  // 1000000 tries longer
  const int64_t cycles = wanted == nullptr ? 100'000 : std::atoll(wanted);
  std::map<std::string, int> ends;  // by the first words of their reasons
  int64_t done = 0;
  double energy = 0;  // largest one
  for (uint64_t seed = 1; done < cycles; ++seed) {
    Rng rng(seed, "adverse machine");
    const Chooser choose = [&](uint32_t n) { return static_cast<uint32_t>(rng.Uniform() * n); };
    const uint32_t rarity = std::array{100U, 1000U, 20000U}[seed % 3];
    const AdverseRun run = RunAdversely(seed % 4 != 0, rarity, 4000, choose);
    ASSERT_EQ(run.violation, "") << "seed " << seed << ", cycle " << run.cycles;
    done += run.cycles;
    energy = std::max(energy, run.energy);
    ++ends[run.reason.substr(run.reason.starts_with("joint") ? 9 : 0, 9)];
  }
  RecordProperty("energy", std::to_string(energy));
  for (const char* reason : {"", "the angle", "expected ", "the encod", "velocity:", "the last ",
                             "the contr", "the machi"}) {
    EXPECT_GT(ends[reason], 0) << reason;
  }
}

}  // namespace
}  // namespace upswing::machine
