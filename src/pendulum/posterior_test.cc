#include "pendulum/posterior.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "base/error.h"

namespace upswing {
namespace {

// Standard deviations of the plant's values are a hundredth or less of the values.
constexpr const char* kText =
    "center1 4e-6; coulomb2 -1e-6 9e-4; sensor_latency 2e-8 0 1e-6; damping1 0 0 0 0";

Plant Machine() {
  Plant plant;
  plant.center1 = 0.2;
  plant.coulomb2 = 0.5;
  return plant;
}

TEST(Posterior, DrawsHaveItsMeanAndCovariance) {
  const Posterior posterior = Posterior::Parse(kText, "test");
  const std::array<std::array<double, 3>, 3> covariance{
      {{4e-6, -1e-6, 2e-8}, {-1e-6, 9e-4, 0}, {2e-8, 0, 1e-6}}};
  constexpr int kDraws = 20000;
  std::array<double, 3> sum{};
  std::array<std::array<double, 3>, 3> product{};
  Rng rng(1, "test");
  for (int n = 0; n < kDraws; ++n) {
    Plant plant = Machine();
    Disturbance disturbance;
    disturbance.sensors.latency = 0.01;
    posterior.Deviate(plant, disturbance, rng);
    const std::array deviation{plant.center1 - 0.2, plant.coulomb2 - 0.5,
                               disturbance.sensors.latency - 0.01};
    for (int i = 0; i < 3; ++i) {
      sum[i] += deviation[i];
      for (int j = 0; j < 3; ++j) product[i][j] += deviation[i] * deviation[j];
    }
    ASSERT_EQ(plant.damping1, Plant().damping1);
    ASSERT_EQ(plant.mass1, Plant().mass1);
    ASSERT_LE(disturbance.sensors.latency, posterior.Largest(disturbance).sensors.latency);
  }
  // Tolerance: five standard errors. var(x y) = var x var y + cov(x, y)² of normal numbers.
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(sum[i] / kDraws, 0, 5 * std::sqrt(covariance[i][i] / kDraws));
    for (int j = 0; j < 3; ++j) {
      const double variance =
          covariance[i][i] * covariance[j][j] + covariance[i][j] * covariance[i][j];
      EXPECT_NEAR(product[i][j] / kDraws, covariance[i][j], 5 * std::sqrt(variance / kDraws));
    }
  }
}

TEST(Posterior, ValuesThatDependOnOthersFollowThem) {
  // damping2 is twice damping1.
  const Posterior posterior = Posterior::Parse("damping1 1e-4; damping2 2e-4 4e-4", "test");
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    Plant plant;
    plant.damping1 = plant.damping2 = 1;
    Disturbance disturbance;
    posterior.Deviate(plant, disturbance, rng);
    EXPECT_NEAR(plant.damping2 - 1, 2 * (plant.damping1 - 1), 1e-12);
    EXPECT_FALSE(disturbance.any());
  }
}

TEST(Posterior, ZerosOfTheEncodersDeviateTogether) {
  const Posterior posterior = Posterior::Parse("zero1 4e-4; zero2 -2e-4 1e-4", "test");
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    Plant plant;
    Disturbance disturbance;
    posterior.Deviate(plant, disturbance, rng);
    EXPECT_NE(disturbance.sensors.zero1, 0);
    EXPECT_NEAR(disturbance.sensors.zero2, -disturbance.sensors.zero1 / 2, 1e-12);
    EXPECT_FALSE(posterior.Largest({}).sensors.exact());
  }
}

TEST(Posterior, CutsValuesAtTheirRanges) {
  const Posterior posterior = Posterior::Parse(
      "mass1 1e12; damping1 0 1e4; inertia1 0 0 1e4; sensor_latency 0 0 0 1e4", "");
  Rng rng(1, "test");
  for (int n = 0; n < 100; ++n) {
    Plant plant = Machine();
    Disturbance disturbance;
    posterior.Deviate(plant, disturbance, rng);
    EXPECT_GE(plant.mass1, 0.001);
    EXPECT_LE(plant.mass1, 1e5);
    EXPECT_GE(plant.damping1, 0);
    EXPECT_GT(plant.inertia1, 0);  // 0 is a capsule
    EXPECT_GE(disturbance.sensors.latency, 0);
    EXPECT_LE(disturbance.sensors.latency, kLongestLatency);
  }
}

TEST(Posterior, TextIsWhatParseReads) {
  EXPECT_EQ(Posterior::Text({"mass1", "lag", "center2"}, {1, 2, 4, 2, 3, 0.1, 4, 0.1, 1e-30}),
            "mass1 1; lag 2 3; center2 4 0.1 1e-30");
}

TEST(Posterior, RefusesTextsThatAreNoCovariance) {
  const auto message = [](const char* text) -> std::string {
    try {
      (void)Posterior::Parse(text, "posterior");
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  for (const char* name : {"", ";", "mas1 1", "current_delay 1", "mass1 1; mass1 0 1", "mass1 1;"}) {
    EXPECT_NE(message(name).find("posterior: expected rows"), std::string::npos) << name;
  }
  for (const char* numbers : {"mass1", "mass1 1 2", "mass1 1; mass2 1", "mass1 inf", "mass1 x"}) {
    EXPECT_NE(message(numbers).find("finite numbers"), std::string::npos) << numbers;
  }
  for (const char* matrix : {"mass1 -1", "mass1 1; mass2 2 1", "mass1 0; mass2 1 1"}) {
    EXPECT_NE(message(matrix).find("positive"), std::string::npos) << matrix;
  }
}

}  // namespace
}  // namespace upswing
