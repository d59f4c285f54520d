#include "extras/realaigym/boards.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "agents/loaded_policy.h"
#include "pendulum/identification.h"
#include "pendulum/observation.h"

namespace upswing::realaigym {
namespace {

/// Records the first environment's observations, and moves it.
class Recorder : public Policy {
 public:
  explicit Recorder(int memory) {
    info_.observation = ObservationInfoOf({}, memory, true);
    obs_size_ = kObservationSize + kIdentifiedSize + memory * kMemorySize;
  }
  std::string kind() const override { return "recorder"; }
  std::string description() const override { return kind(); }
  int obs_size() const override { return obs_size_; }
  int action_size() const override { return 1; }
  const PolicyInfo& info() const override { return info_; }
  Tensors ToTensors() const override { return {}; }
  std::unique_ptr<Memory> Start(int) const override { return std::make_unique<Memory>(); }
  void Act(Matrix<const float> obs, Matrix<double> action, Memory&) const override {
    const auto row = obs.row(0);
    seen.emplace_back(row.begin(), row.end());
    for (int i = 0; i < obs.rows(); ++i) action.row(i)[0] = Torque(seen.size() - 1);
  }

  static double Torque(size_t k) { return 4 * std::sin(0.3 * static_cast<double>(k)); }

  mutable std::vector<std::vector<float>> seen;

 private:
  PolicyInfo info_;
  int obs_size_;
};

TEST(RealAIGym, PoliciesObserveAsInTraining) {
  constexpr int kMemory = 3;
  const auto recorder = std::make_shared<Recorder>(kMemory);
  LoadedPolicy loaded;
  loaded.policy = recorder;
  loaded.task = kDoublePendulum;
  const MachineLog log = NominalLog(std::make_shared<LoadedPolicy>(loaded));
  ASSERT_EQ(recorder->seen.size(), 500);

  Identifier identifier(loaded.plant, kControlPeriod, 1);
  for (size_t k = 0; k < 100; ++k) {
    const auto &q = log.angle, &velocity = log.velocity;
    const PendulumState measured{q[10 * k][0], q[10 * k][1], velocity[10 * k][0],
                                 velocity[10 * k][1]};
    std::vector<float> expected;
    for (const float x : Observe(loaded.plant, measured)) expected.push_back(x);
    if (k == 0) identifier.Begin(0, measured);
    if (k > 0) identifier.Update(0, Recorder::Torque(k - 1), measured);
    expected.resize(kObservationSize + kIdentifiedSize);
    identifier.Observe(0, measured, std::span(expected).subspan(kObservationSize));
    for (size_t past = 1; past <= kMemory; ++past) {
      for (const size_t j : {0, 1}) {
        const bool known = past <= k;
        const double change =
            known ? velocity[10 * (k - past + 1)][j] - velocity[10 * (k - past)][j] : 0;
        expected.push_back(static_cast<float>(change / kMemoryVelocity));
      }
      expected.push_back(past <= k ? static_cast<float>(Recorder::Torque(k - past) / kMemoryTorque)
                                   : 0);
    }
    const std::vector<float>& seen = recorder->seen[k];
    ASSERT_EQ(seen.size(), expected.size());
    for (size_t i = 0; i < seen.size(); ++i)
      EXPECT_NEAR(seen[i], expected[i], 2e-5) << k << ' ' << i;
  }
}

}  // namespace
}  // namespace upswing::realaigym
