#include "runs/event_file.h"

#include <gtest/gtest.h>

#include "os/testing.h"

namespace upswing {
namespace {

TEST(EventFile, Crc32cMatchesRfc3720) {
  // RFC 3720, Appendix B.4.
  EXPECT_EQ(Crc32c(std::string(32, '\0')), 0x8a9136aaU);
  EXPECT_EQ(Crc32c(std::string(32, '\xff')), 0x62a8ab43U);
  std::string rising;
  for (char c = 0; c < 32; ++c) rising += c;
  EXPECT_EQ(Crc32c(rising), 0x46dd794eU);
  EXPECT_EQ(Crc32c("123456789"), 0xe3069283U);
}

TEST(EventFile, CutToRestoresEarlierContents) {
  const TempFolder folder;
  const auto path = folder / "events";
  int64_t size = 0;
  {
    EventFile file(path);
    file.CutTo(0);
    file.Append(1, {{"a", 0.5}});
    size = file.size();
    file.Append(2, {{"a", 0.25}, {"b", 1}});
  }
  const std::string whole = ReadOwnFile(path);
  EventFile file(path);
  file.CutTo(size);
  EXPECT_EQ(file.size(), size);
  EXPECT_EQ(ReadOwnFile(path), whole.substr(0, static_cast<size_t>(size)));
}

}  // namespace
}  // namespace upswing
