#pragma once

#include <cstdint>
#include <string>

#include "base/options.h"

/// Arguments shared by several commands and by the Python functions of the same names. Each has its
/// range and help in one place.
namespace upswing {

/// Argument "seed" of `what`.
void DescribeSeed(Options& o, int64_t* seed, const std::string& what);

/// Argument "threads", for ResolveThreads.
void DescribeThreads(Options& o, int64_t* threads);

/// Argument "physics", for FindEngine.
void DescribePhysics(Options& o, std::string* physics);

/// Argument "episodes": number of episodes of an evaluation.
void DescribeEvalEpisodes(Options& o, int64_t* episodes);

}  // namespace upswing
