#include "runs/seeds.h"

#include <optional>
#include <set>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

constexpr int64_t kLargestSeed = 9'000'000'000'000'000;  // limit of --seed
constexpr int64_t kMostSeeds = 10'000;

std::optional<int64_t> ParseSeed(std::string_view text) {
  const auto seed = ParseInteger(text);
  if (!seed || *seed < 0 || *seed > kLargestSeed) return std::nullopt;
  return seed;
}

}  // namespace

std::vector<int64_t> ParseSeeds(std::string_view text, const std::string& where) {
  std::string_view list = Trim(text);
  const auto bad = [&](std::string_view why) {
    return BadInput(Concat(where, ": expected ", why, ", got \"", text, "\""));
  };
  const auto wrong = [&] { return bad("a number of seeds or a list such as 3,5,8-12"); };
  const auto count = ParseInteger(list);
  if (count && *count > 0 && *count <= kMostSeeds) return ParseSeeds(Concat("1-", *count), where);
  if (count) throw bad(Concat("1 to ", kMostSeeds, " seeds"));
  if (list.starts_with('[') && list.ends_with(']')) list = list.substr(1, list.size() - 2);

  std::vector<int64_t> seeds;
  std::set<int64_t> seen;
  for (const std::string_view piece : Split(list, ',')) {
    const size_t dash = piece.find('-');
    const auto first = ParseSeed(Trim(piece.substr(0, dash)));
    const auto last =
        dash == std::string_view::npos ? first : ParseSeed(Trim(piece.substr(dash + 1)));
    if (!first || !last || *first > *last) throw wrong();
    if (*last - *first >= kMostSeeds - std::ssize(seeds)) {
      throw bad(Concat("1 to ", kMostSeeds, " seeds"));
    }
    for (int64_t seed = *first; seed <= *last; ++seed) {
      if (!seen.insert(seed).second) throw bad(Concat("each seed once, but ", seed, " is twice"));
      seeds.push_back(seed);
    }
  }
  return seeds;
}

std::string SeedsText(const std::vector<int64_t>& seeds) {
  std::vector<std::string> pieces;
  for (size_t i = 0, end = 0; i < seeds.size(); i = end) {
    end = i + 1;
    while (end < seeds.size() && seeds[end] == seeds[end - 1] + 1) ++end;
    const std::string first = std::to_string(seeds[i]);
    pieces.push_back(end == i + 1 ? first : Concat(first, "-", seeds[end - 1]));
  }
  return Join(pieces, ", ");
}

}  // namespace upswing
