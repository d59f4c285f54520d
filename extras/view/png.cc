// Portable Network Graphics, second edition (W3C, 2003): the chunks IHDR, IDAT, IEND; 8 bits for
// each of red, green and blue; compressed by zlib.
#include "extras/view/png.h"

#include <zlib.h>

#include <array>
#include <cstdlib>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "os/gzip.h"

namespace upswing {
namespace {

constexpr int kChannels = 3;
enum Filter : uint8_t { kSub = 1, kUp = 2, kPaeth = 4 };

void AppendNumber(std::string& out, uint32_t number) {
  for (const int shift : {24, 16, 8, 0}) out += static_cast<char>(number >> shift & 0xFF);
}

void AppendChunk(std::string& out, const char* type, const std::string& data) {
  AppendNumber(out, static_cast<uint32_t>(data.size()));
  const std::string body = type + data;
  out += body;
  AppendNumber(out, Crc32(BytesOf(body)));
}

/// Picks the neighbour (left, above or above left) nearest to left + above - above left.
int Paeth(int left, int above, int corner) {
  const int p = left + above - corner;
  const int a = std::abs(p - left), b = std::abs(p - above), c = std::abs(p - corner);
  if (a <= b && a <= c) return left;
  return b <= c ? above : corner;
}

/// Differences of a row from its neighbours. `above` is zero for the first row.
void FilterRow(Filter filter, std::span<const uint8_t> row, std::span<const uint8_t> above,
               std::span<uint8_t> out) {
  for (size_t i = 0; i < row.size(); ++i) {
    const bool first = i < kChannels;
    const int left = first ? 0 : row[i - kChannels], corner = first ? 0 : above[i - kChannels];
    int guess = left;
    if (filter == kUp) guess = above[i];
    if (filter == kPaeth) guess = Paeth(left, above[i], corner);
    out[i] = static_cast<uint8_t>(row[i] - guess);
  }
}

/// Estimated cost of a filtered row: the sum of its bytes' absolute values as signed numbers.
int64_t CostOf(std::span<const uint8_t> row) {
  int64_t sum = 0;
  for (const uint8_t byte : row) sum += byte < 128 ? byte : 256 - byte;
  return sum;
}

}  // namespace

std::string EncodePng(std::span<const uint8_t> rgb, int width, int height) {
  const size_t row_bytes = static_cast<size_t>(width) * kChannels;
  std::vector<uint8_t> filtered, above(row_bytes), trial(row_bytes), best(row_bytes);
  filtered.reserve((row_bytes + 1) * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y) {
    const auto row = rgb.subspan(static_cast<size_t>(y) * row_bytes, row_bytes);
    int64_t least = -1;
    Filter chosen = kSub;
    for (const Filter filter : {kSub, kUp, kPaeth}) {
      FilterRow(filter, row, above, trial);
      const int64_t cost = CostOf(trial);
      if (least >= 0 && cost >= least) continue;
      least = cost;
      chosen = filter;
      best.swap(trial);
    }
    filtered.push_back(chosen);
    filtered.insert(filtered.end(), best.begin(), best.end());
    above.assign(row.begin(), row.end());
  }
  uLongf size = compressBound(filtered.size());
  std::string packed(size, '\0');
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, filtered.data(), filtered.size(),
                6) != Z_OK) {
    throw Failure("PNG: zlib could not compress the picture");
  }
  packed.resize(size);

  std::string header;
  AppendNumber(header, static_cast<uint32_t>(width));
  AppendNumber(header, static_cast<uint32_t>(height));
  header += std::string("\x08\x02\x00\x00\x00", 5);  // 8 bits, red-green-blue, no interlacing
  std::string png = "\x89PNG\r\n\x1a\n";
  AppendChunk(png, "IHDR", header);
  AppendChunk(png, "IDAT", packed);
  AppendChunk(png, "IEND", "");
  return png;
}

}  // namespace upswing
