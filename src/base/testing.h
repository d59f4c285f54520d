#pragma once

#include <gtest/gtest.h>
#include <sched.h>

#include "base/archive.h"
#include "base/safetensors.h"

/// Helpers for tests.
namespace upswing {

/// Limits this thread, and threads that it starts, to one processor until the object is destroyed.
class OnOneProcessor {
 public:
  OnOneProcessor() {
    EXPECT_EQ(sched_getaffinity(0, sizeof(before_), &before_), 0);
    int processor = 0;
    while (processor < CPU_SETSIZE && !CPU_ISSET(processor, &before_)) ++processor;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(processor, &one);
    EXPECT_EQ(sched_setaffinity(0, sizeof(one), &one), 0);
  }
  ~OnOneProcessor() { EXPECT_EQ(sched_setaffinity(0, sizeof(before_), &before_), 0); }
  OnOneProcessor(const OnOneProcessor&) = delete;
  OnOneProcessor& operator=(const OnOneProcessor&) = delete;

 private:
  cpu_set_t before_;
};

/// Saves with `save(archive)` and loads with `load(archive)`, through the bytes of a file.
template <typename Save, typename Load>
void SaveAndLoad(const Save& save, const Load& load) {
  Tensors saved;
  save(Archive::Saver(saved));
  const Tensors loaded = ReadSafetensors(WriteSafetensors(saved).Joined(), "saved");
  load(Archive::Loader(loaded));
}

}  // namespace upswing
