#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace upswing {

/// Parses seeds: `10` for 1 to 10, or a list of seeds and ranges such as `3,5,8-12` (in brackets,
/// also a list of one: `[7]`). Keeps the order and drops duplicates. Throws BadInput that begins
/// with `where`.
std::vector<int64_t> ParseSeeds(std::string_view text, const std::string& where);

/// Seeds as text that ParseSeeds accepts: `1-10`, `3, 5, 8-12`.
std::string SeedsText(const std::vector<int64_t>& seeds);

}  // namespace upswing
