#include "runs/run_folder.h"

#include <gtest/gtest.h>

#include "os/file.h"
#include "os/testing.h"
#include "runs/tensor_file.h"

namespace upswing {
namespace {

TEST(RunFolder, ATableKeepsItsColumnsUnderAnotherVersion) {
  const TempFolder temp;
  Tensors first;
  RunFolder::Create(temp / "run", {{"config.toml", ""}}, first);
  const auto reopened = [&] {
    return RunFolder(temp / "run", LoadTensors(RunFolder::CheckpointPath(temp / "run")));
  };
  {
    RunFolder run(temp / "run", first);
    run.LogEvaluation({{"step", 10}, {"success", 0.5}, {"old", 3}});
    Tensors checkpoint;
    run.SaveCheckpoint(checkpoint);
  }
  RunFolder run = reopened();
  run.LogEvaluation({{"step", 20}, {"new", 7}, {"success", 1}});
  run.LogMetrics({{"step", 20}, {"loss", 0.25}});
  EXPECT_EQ(ReadOwnFile(temp / "run" / RunFolder::kEvaluations),
            "step,success,old\n10,0.5,3\n20,1,nan\n");
  EXPECT_EQ(ReadOwnFile(temp / "run" / RunFolder::kMetrics), "step,loss\n20,0.25\n");
}

}  // namespace
}  // namespace upswing
