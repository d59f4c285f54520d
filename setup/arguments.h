#pragma once

#include <cstdint>
#include <string>

#include "core/options.h"

/// What several commands, and the Python package's functions of these names, are told: each in one
/// place, with its range and help.
namespace upswing {

/// "seed", of `what`.
void DescribeSeed(Options& o, int64_t* seed, const std::string& what);

/// "threads", which ResolveThreads reads.
void DescribeThreads(Options& o, int64_t* threads);

/// "physics", which FindEngine reads.
void DescribePhysics(Options& o, std::string* physics);

/// "episodes" of an evaluation.
void DescribeEvalEpisodes(Options& o, int64_t* episodes);

}  // namespace upswing
