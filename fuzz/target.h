#pragma once

#include <functional>
#include <string_view>

/// What a fuzz target is made of. Each tests one reader of files from untrusted sources: libFuzzer
/// generates inputs without end, the ordinary tests use those of its corpus.
namespace upswing {

/// Reads one input, as its target does, and works with what was read as the program would. Returns
/// whether it was accepted. Each target defines it.
bool TryInput(std::string_view input);

/// Runs a reader. Returns whether it took the input, false if it threw BadInput. Ends the process
/// on anything else.
bool Accepts(const std::function<void()>& read);

/// Ends the process, with a message, unless `holds`: what a target expects of what was accepted.
void Expect(bool holds, std::string_view expected);

/// What messages call an input, as others say its path.
inline constexpr const char* kInputName = "input";

}  // namespace upswing
