#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "rl/agent.h"

/// Helpers for tests of agents.
namespace upswing {

/// The metric called `name`. Fails the test if there is none.
inline double Metric(const Metrics& metrics, const std::string& name) {
  const auto found = std::ranges::find(metrics, name, &Metrics::value_type::first);
  EXPECT_NE(found, metrics.end()) << name;
  return found == metrics.end() ? std::numeric_limits<double>::quiet_NaN() : found->second;
}

}  // namespace upswing
