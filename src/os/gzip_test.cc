#include "os/gzip.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/text.h"

namespace upswing {
namespace {

/// A text larger than the inflater's buffer.
std::string LongText() {
  std::string text;
  for (int i = 0; i < 40000; ++i) text += std::to_string(i * 7919 % 10007) + ",";
  return text;
}

TEST(Gzip, InflatesCompressedText) {
  for (const std::string& text : {std::string(), std::string("time,pos1\n0,1\n"), LongText()}) {
    const std::string bytes = Gzip(text);
    EXPECT_TRUE(IsGzip(bytes));
    EXPECT_FALSE(IsGzip(text));
    EXPECT_EQ(Gunzip(bytes, "file"), text);
    EXPECT_EQ(Gunzip(bytes + Gzip("more"), "file"), text + "more");  // members in a row
  }
}

TEST(Gzip, NamesNoTimeAndOneSystem) {
  // RFC 1952: seconds in bytes 4 to 7, the system in byte 9.
  const std::string bytes = Gzip("time,pos1\n0,1\n");
  EXPECT_EQ(bytes.substr(4, 4), std::string(4, '\0'));
  EXPECT_EQ(bytes[9], 3);
}

TEST(Gzip, RefusesEveryShorterFile) {
  const std::string bytes = Gzip("time,pos1\n0,1\n");
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_THROW(Gunzip(bytes.substr(0, size), "file"), Error) << size;
  }
}

TEST(Gzip, RefusesDamagedData) {
  const std::string bytes = Gzip(LongText());
  for (const size_t place : {size_t{2}, bytes.size() / 2, bytes.size() - 6, bytes.size() - 1}) {
    std::string damaged = bytes;
    damaged[place] = static_cast<char>(damaged[place] ^ 0x10);
    EXPECT_THROW(Gunzip(damaged, "file"), Error) << place;
  }
  EXPECT_THROW(Gunzip(bytes + "rest", "file"), Error);
}

/// The error message of Gunzip.
std::string Complaint(const std::string& bytes, size_t most_bytes) {
  try {
    Gunzip(bytes, "file", most_bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.exit_code(), 2);
    return error.what();
  }
  return "none";
}

TEST(Gzip, StopsAtTheLimit) {
  const std::string text = LongText(), bytes = Gzip(text);
  EXPECT_EQ(Complaint(bytes, text.size()), "none");
  EXPECT_EQ(Complaint(bytes, text.size() - 1),
            Concat("cannot read file: expected at most ", text.size() - 1,
                   " bytes after decompression, got more"));
}

TEST(Gzip, StopsAtAHundredTimesTheFile) {
  const std::string small = Gzip(std::string(1 << 20, 'x'));  // about 1 kB
  EXPECT_EQ(Complaint(small, 1 << 30), "none");
  const std::string bytes = Gzip(std::string(10'000'000, 'x'));  // about 10 kB
  EXPECT_EQ(Complaint(bytes, 1 << 30),
            Concat("cannot read file: expected at most ", (1 << 20) + 100 * bytes.size(),
                   " bytes after decompression, got more"));
}

}  // namespace
}  // namespace upswing
