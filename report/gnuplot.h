#pragma once

#include <string>

namespace upswing {

/// Runs gnuplot on a script and returns its standard output. The user's own settings of gnuplot are
/// not read. Throws Failure if it is missing, or with gnuplot's error message.
std::string RunGnuplot(const std::string& script);

}  // namespace upswing
