#pragma once

#include <functional>
#include <string_view>

/// The interface of fuzz targets. Each target tests one parser of untrusted files. libFuzzer
/// generates inputs endlessly; the ordinary tests use the inputs of the corpus.
namespace upswing {

/// Parses one input and uses the result as the program would. Returns whether the input was
/// accepted. Each target defines this function.
bool TryInput(std::string_view input);

/// Runs a parser. Returns true if it accepted the input, false if it threw BadInput. Any other
/// exception ends the process.
bool Accepts(const std::function<void()>& read);

/// Checks a property of an accepted input: ends the process, with a message, unless `holds`.
void Expect(bool holds, std::string_view expected);

/// Name of an input in messages, in place of a path.
inline constexpr const char* kInputName = "input";

}  // namespace upswing
