#include "extras/realaigym/swing_policy.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "extras/realaigym/swing_net.h"

namespace upswing::realaigym {
namespace {

constexpr const char* kFormat = "upswing-realaigym";
constexpr int kVersion = 2, kMirroringVersion = 3;
constexpr int kLeastHidden = 4;
constexpr double kMostExponent = 50, kMostWeight = 1e6;  // limits of numbers in files

class SwingController : public BoardController {
 public:
  explicit SwingController(SwingBlock block) : block_(std::move(block)) {}

  void Act(int step, const BoardMeasurement& measured, size_t /*count*/, Lanes& torque) override {
    if (measured.estimated) {
      // Earlier angles on a line give the estimated velocity.
      for (size_t i = 0; i < kBoardBlock; ++i) {
        for (size_t k = 0; k < 2; ++k) {
          const double before = static_cast<double>(k + 1) * kBoardTimestep;
          block_.q1[k][i] = measured.q1[i] - before * measured.w1[i];
          block_.q2[k][i] = measured.q2[i] - before * measured.w2[i];
        }
      }
    } else if (step == 0) {  // the episode begins at rest
      block_.q1.fill(measured.q1);
      block_.q2.fill(measured.q2);
    }
    SwingTorques(block_, measured, torque);
  }

 private:
  SwingBlock block_;
};

}  // namespace

SwingNet::SwingNet(Robot robot, int hidden, bool mirrors)
    : robot_(robot), hidden_(hidden), mirrors_(mirrors) {
  const Lqr regulator = SolveBoardLqr(robot, {1, 1, 0.1, 0.1}, 1);
  for (size_t i = 0; i < 4; ++i) {
    K_[i] = regulator.K[static_cast<Eigen::Index>(i)];
    for (size_t j = 0; j < 4; ++j) {
      P_[4 * i + j] = regulator.P(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
}

size_t SwingNet::size() const { return kLinear + SwingWeights(hidden_); }

std::vector<double> SwingNet::Initial(uint64_t seed) const {
  std::vector<double> numbers(size(), 0.0);
  numbers[4] = std::log(20);
  numbers[5] = std::log(2);
  Rng rng(seed, "realaigym: network");
  for (size_t i = kLinear; i < numbers.size(); ++i) numbers[i] = 0.3 * rng.Normal();
  return numbers;
}

std::unique_ptr<BoardController> SwingNet::Control(std::span<const std::span<const double>> numbers,
                                                   size_t lanes_each) const {
  SwingBlock block;
  block.hidden = hidden_;
  block.lanes_each = lanes_each;
  block.P = P_;
  block.mirrored_beyond = mirrors_ ? std::numbers::pi : std::numeric_limits<double>::infinity();
  const size_t W = SwingWeights(hidden_), policies = kBoardBlock / lanes_each;
  block.weights.resize(W * policies);
  for (size_t k = 0; k < policies; ++k) {
    const auto& own = numbers[std::min(k, numbers.size() - 1)];
    const auto fill = [&](Lanes& lanes, double x) {
      std::fill_n(lanes.begin() + static_cast<std::ptrdiff_t>(k * lanes_each), lanes_each, x);
    };
    for (size_t i = 0; i < 4; ++i) fill(block.K[i], K_[i] * std::exp(0.3 * own[i]));
    fill(block.inverse_rho, std::exp(-own[4]));
    fill(block.sharpness, std::exp(own[5]));
    for (size_t i = 0; i < W; ++i) {
      block.weights[lanes_each == 1 ? i * kBoardBlock + k : k * W + i] =
          static_cast<float>(own[kLinear + i]);
    }
  }
  return std::make_unique<SwingController>(std::move(block));
}

std::unique_ptr<BoardController> SwingNet::Control(std::span<const double> numbers) const {
  return Control({&numbers, 1}, kBoardBlock);
}

Tensors SwingNet::ToTensors(std::span<const double> numbers) const {
  Tensors tensors;
  tensors.metadata["format"] = kFormat;
  tensors.metadata["format_version"] = std::to_string(mirrors_ ? kMirroringVersion : kVersion);
  tensors.metadata["robot"] = NameOf(robot_);
  tensors.metadata["hidden"] = std::to_string(hidden_);
  tensors.AddCopy("numbers", numbers);
  return tensors;
}

bool IsSwingPolicy(const Tensors& tensors) {
  const auto found = tensors.metadata.find("format");
  return found != tensors.metadata.end() && found->second == kFormat;
}

SwingPolicy ReadSwingPolicy(const Tensors& tensors) {
  const auto expect = [&](const char* key, const std::string& expected) {
    return BadInput(Concat(tensors.where(), ": metadata \"", key, "\": expected ", expected,
                           ", got \"", Printable(tensors.Metadata(key)), "\""));
  };
  const auto version = ParseInteger(tensors.Metadata("format_version"));
  if (version != kVersion && version != kMirroringVersion) {
    throw expect("format_version", Concat(kVersion, " or ", kMirroringVersion));
  }
  const auto robot = RobotNamed(tensors.Metadata("robot"));
  if (!robot) throw expect("robot", "pendubot or acrobot");
  const auto hidden = ParseInteger(tensors.Metadata("hidden"));
  if (!hidden || *hidden < kLeastHidden || *hidden > kSwingMostHidden || *hidden % 2 != 0) {
    throw expect("hidden",
                 Concat("an even number in [", kLeastHidden, ", ", kSwingMostHidden, "]"));
  }
  SwingPolicy policy{{*robot, static_cast<int>(*hidden), version == kMirroringVersion}, {}};
  policy.numbers.resize(policy.net.size());
  tensors.Read("numbers", std::span(policy.numbers), {static_cast<int64_t>(policy.net.size())});
  for (size_t i = 0; i < policy.numbers.size(); ++i) {
    const double most = i < SwingNet::kLinear ? kMostExponent : kMostWeight;
    if (std::abs(policy.numbers[i]) <= most) continue;
    throw BadInput(Concat(tensors.where(), ": tensor \"numbers\": expected number ", i, " within ",
                          most, ", got ", policy.numbers[i]));
  }
  return policy;
}

}  // namespace upswing::realaigym
