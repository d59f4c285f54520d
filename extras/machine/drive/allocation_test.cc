// Counts the allocations of a thread by replacing operator new.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <memory>
#include <new>
#include <thread>

#include "extras/machine/drive/fake_machine.h"
#include "extras/machine/drive/loop_testing.h"
#include "extras/machine/drive/policy_controller.h"
#include "nn/network_policy.h"
#include "os/file.h"
#include "os/testing.h"

namespace {

thread_local int64_t g_allocations = 0;

}  // namespace

// Not inlined: the compiler would see malloc and delete, and warn of a mismatch.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++g_allocations;
  if (void* memory = std::malloc(std::max<std::size_t>(size, 1))) return memory;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace upswing::machine {
namespace {

/// A policy of the double pendulum with a network of two hidden units.
LoadedPolicy TinyNetwork() {
  NetworkPolicyParts parts{ActionRule::kClippedGaussian};
  parts.shape = {kObservationSize, {2}, 2, false, Activation::kTanh};
  parts.parameters.assign(24, 0.1F);
  parts.action_limit = {5};
  const auto policy = std::make_shared<NetworkPolicy>(std::move(parts), InfoOf(Config()));
  return {"network", "file", policy, kDoublePendulum, {}};
}

/// Serves a machine over UDP from another thread.
class Server {
 public:
  Server() : channel_(Channel::Listen(ParseLink("udp:0", /*listens=*/true))) {
    thread_ = std::thread([this] {
      FakeConfig patient;
      patient.watchdog = 1;
      FakeMachine machine(TestTwin(), {}, patient);
      const auto stop = [this] { return stops_.load(); };
      Serve(channel_, machine, {}, 1, stop, [](double) {});
    });
  }
  ~Server() {
    stops_ = true;
    thread_.join();
  }
  const std::string& place() const { return channel_.name(); }

 private:
  Channel channel_;
  std::atomic<bool> stops_{false};
  std::thread thread_;
};

TEST(ControlLoop, ACycleAllocatesNoMemory) {
  const TempFolder folder;
  const LoadedPolicy lqr = GetPolicy({"lqr", {}, {}}), network = TinyNetwork();
  for (const LoadedPolicy& policy : {lqr, network}) {
    const Server server;
    LoopBench bench;
    bench.machine_controller = ControllerOf(std::make_shared<LoadedPolicy>(policy));
    bench.log_path = FreePath(folder / "log.csv").string();
    // The machine that runs the tests may be busy.
    bench.limits.age = 1;
    bench.limits.velocity = 1000;
    bench.limits.energy = 1000;
    bench.config.seconds = 0.3;
    bench.link = std::make_unique<ChannelLink>(Channel::Connect(ParseLink(server.place(), false)));
    bench.Make();
    const int64_t before = g_allocations;
    while (bench.loop->Cycle() && bench.supervisor->state() != LoopState::kBraking) {
    }
    EXPECT_EQ(g_allocations, before) << policy.name;
    EXPECT_EQ(bench.supervisor->reason(), "") << policy.name;
    EXPECT_GT(bench.loop->summary().driven, 0.2) << policy.name;
  }
}

}  // namespace
}  // namespace upswing::machine
