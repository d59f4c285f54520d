// Counts the allocations of the whole program, including MuJoCo's, by replacing malloc.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>

#include "mujoco/engines.h"
#include "pendulum/pendulum_env.h"

// Sanitizers replace malloc themselves, and other C libraries do not export the original malloc.
#if defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define UPSWING_COUNTS_ALLOCATIONS 1
#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#undef UPSWING_COUNTS_ALLOCATIONS
#endif
#endif
#endif

#if defined(UPSWING_COUNTS_ALLOCATIONS)

namespace {
std::atomic<int64_t> g_allocations{0};
}  // namespace

// Libraries find them, also where the compiler hides what it does not know.
#pragma GCC visibility push(default)
extern "C" {
void* __libc_malloc(size_t size);                      // NOLINT
void* __libc_calloc(size_t count, size_t size);        // NOLINT
void* __libc_realloc(void* block, size_t size);        // NOLINT
void* __libc_memalign(size_t alignment, size_t size);  // NOLINT

void* malloc(size_t size) noexcept {
  ++g_allocations;
  return __libc_malloc(size);
}
void* calloc(size_t count, size_t size) noexcept {
  ++g_allocations;
  return __libc_calloc(count, size);
}
void* realloc(void* block, size_t size) noexcept {
  ++g_allocations;
  return __libc_realloc(block, size);
}
void* aligned_alloc(size_t alignment, size_t size) noexcept {
  ++g_allocations;
  return __libc_memalign(alignment, size);
}
}
#pragma GCC visibility pop

namespace upswing {
namespace {

/// Number of allocations of 40 double pendulums in `steps` control steps, resets included.
int64_t Allocations(const Engine* engine, int steps) {
  PendulumEnvConfig config;
  config.engine = engine;
  config.num_envs = 40;
  config.episode_seconds = 0.5;
  config.start.random_share = 0.5;
  PendulumEnv env(config);
  StepResult result = env.MakeResult();
  const std::vector<double> torque(40, 1.0);
  env.Step(torque, result);
  const int64_t before = g_allocations;
  for (int step = 0; step < steps; ++step) env.Step(torque, result);
  return g_allocations - before;
}

TEST(Allocation, IsCounted) {
  const int64_t before = g_allocations;
  const std::vector<double> numbers(1000);
  EXPECT_EQ(g_allocations - before, 1);
  EXPECT_EQ(numbers.back(), 0);
}

TEST(Allocation, AStepInMuJoCoAllocatesNothing) { EXPECT_EQ(Allocations(&kMuJoCo, 100), 0); }

TEST(Allocation, AStepInClosedFormAllocatesNothing) {
  EXPECT_EQ(Allocations(&kClosedForm, 100), 0);
}

}  // namespace
}  // namespace upswing

#endif  // UPSWING_COUNTS_ALLOCATIONS
