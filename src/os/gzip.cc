#include "os/gzip.h"

#include <zlib.h>

#include <algorithm>
#include <memory>

#include "base/error.h"

namespace upswing {

bool IsGzip(std::string_view bytes) { return bytes.starts_with("\x1f\x8b"); }

std::string Gunzip(std::string_view bytes, const std::string& where, size_t most_bytes) {
  // Logs of machines shrink to a third, and dull simulated ones to a tenth. A file can expand 1000
  // times. Small texts may do so.
  constexpr size_t kMostRatio = 100, kSmall = 1 << 20;
  most_bytes = std::min(most_bytes, kSmall + kMostRatio * bytes.size());
  z_stream stream{};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  constexpr int kGzipOnly = 16;  // expects a header of gzip, not of zlib
  if (inflateInit2(&stream, MAX_WBITS + kGzipOnly) != Z_OK) throw Failure("zlib does not work");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> inflating(&stream, &inflateEnd);
  std::string text, piece(65536, '\0');
  while (true) {
    stream.next_out = reinterpret_cast<Bytef*>(piece.data());
    stream.avail_out = static_cast<uInt>(piece.size());
    const int status = inflate(&stream, Z_NO_FLUSH);
    text.append(piece, 0, piece.size() - stream.avail_out);
    if (text.size() > most_bytes) {
      throw BadInput(Concat("cannot read ", where, ": expected at most ", most_bytes,
                            " bytes after decompression, got more"));
    }
    if (status == Z_STREAM_END) {
      if (stream.avail_in == 0) return text;
      inflateReset(&stream);
    } else if (status != Z_OK) {
      throw BadInput(Concat("cannot read ", where, ": expected a gzip file, got ",
                            stream.avail_in == 0 ? "only its beginning" : "a damaged one"));
    }
  }
}

std::string Gzip(std::string_view text) {
  constexpr int kGzipHeader = 16, kMemory = 9;  // the most memory, 256 KB
  z_stream stream{};
  if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, MAX_WBITS + kGzipHeader, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw Failure("zlib does not work");
  }
  gz_header header{};
  header.os = 3;  // Unix, on Windows too: the same text gives the same bytes
  deflateSetHeader(&stream, &header);
  std::string bytes(deflateBound(&stream, text.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(text.data()));
  stream.avail_in = static_cast<uInt>(text.size());
  stream.next_out = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_out = static_cast<uInt>(bytes.size());
  const int status = deflate(&stream, Z_FINISH);
  bytes.resize(stream.total_out);
  deflateEnd(&stream);
  if (status != Z_STREAM_END) throw Failure("zlib cannot compress");
  return bytes;
}

uint32_t Crc32(std::span<const std::byte> bytes) {
  const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
  return static_cast<uint32_t>(crc32_z(0, data, bytes.size()));
}

}  // namespace upswing
