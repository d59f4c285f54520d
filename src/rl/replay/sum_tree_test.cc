#include "rl/replay/sum_tree.h"

#include <gtest/gtest.h>

#include <numeric>
#include <span>
#include <vector>

#include "base/rng.h"

namespace upswing {
namespace {

/// The index at which the running sum exceeds `mass`, found by a scan over all numbers.
int64_t FindSlowly(const std::vector<double>& values, double mass) {
  for (size_t i = 0; i < values.size(); ++i) {
    if (mass < values[i]) return static_cast<int64_t>(i);
    mass -= values[i];
  }
  return -1;
}

int64_t FindOne(const SumTree& tree, double mass) {
  int64_t index = -1;
  tree.Find(std::span(&mass, 1), std::span(&index, 1));
  return index;
}

TEST(SumTree, FindsManyAsItFindsEach) {
  Rng rng(2, "test");
  SumTree tree(1000);
  for (int i = 0; i < 1000; ++i) tree.Set(i, rng.Uniform());
  for (const size_t count : {0, 1, 15, 16, 17, 100}) {
    std::vector<double> masses(count);
    for (double& mass : masses) mass = tree.total() * rng.Uniform();
    std::vector<int64_t> indices(count);
    tree.Find(masses, indices);
    for (size_t k = 0; k < count; ++k) EXPECT_EQ(indices[k], FindOne(tree, masses[k]));
  }
}

TEST(SumTree, FindsWhatAScanFinds) {
  for (const int64_t capacity : {1, 2, 7, 64, 1000}) {
    Rng rng(1, "sum tree", static_cast<uint64_t>(capacity));
    SumTree tree(capacity);
    std::vector<double> values(static_cast<size_t>(capacity));
    // Integers below 8, some of them 0: every sum is exact.
    for (int round = 0; round < 2000; ++round) {
      const uint64_t index = rng.Below(values.size());
      values[index] = static_cast<double>(rng.Below(8));
      tree.Set(static_cast<int64_t>(index), values[index]);
      const double total = std::accumulate(values.begin(), values.end(), 0.0);
      ASSERT_EQ(tree.total(), total);
      if (total == 0) continue;
      const double mass = rng.Uniform(0, total);
      ASSERT_EQ(FindOne(tree, mass), FindSlowly(values, mass));
    }
  }
}

TEST(SumTree, FindsEachNumberAsOftenAsItIsLarge) {
  SumTree tree(5);
  const std::vector<double> values{0, 1, 3, 0, 4};
  for (size_t i = 0; i < values.size(); ++i) tree.Set(static_cast<int64_t>(i), values[i]);
  std::vector<int> count(5);
  for (int k = 0; k < 800; ++k) ++count[static_cast<size_t>(FindOne(tree, k / 100.0))];
  EXPECT_EQ(count, (std::vector<int>{0, 100, 300, 0, 400}));
}

TEST(SumTree, RoundingNeverLeadsToAZero) {
  SumTree tree(8);
  for (int i = 0; i < 5; ++i) tree.Set(i, 0.1);
  // A mass equal to the total: the product of a random number and the total can round to it.
  EXPECT_EQ(FindOne(tree, tree.total()), 4);
  EXPECT_EQ(FindOne(tree, 2 * tree.total()), 4);
}

}  // namespace
}  // namespace upswing
