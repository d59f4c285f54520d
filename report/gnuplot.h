#pragma once

#include <string>

namespace upswing {

/// Runs gnuplot on a script and returns what it wrote to its standard output. The user's own
/// settings of gnuplot are not read. Throws Failure if it is missing, or with what it said.
std::string RunGnuplot(const std::string& script);

}  // namespace upswing
