#include "runs/tensor_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>

#include "base/archive.h"
#include "base/error.h"
#include "base/rng.h"
#include "base/text.h"
#include "os/file.h"
#include "os/testing.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

class TensorFileTest : public ::testing::Test {
 protected:
  /// Saves a file with every type, an empty tensor and sizes that are not whole words.
  void SaveSample() const {
    const std::vector<uint8_t> bytes{1, 2, 3};
    const std::vector<float> floats{1.5F, -2, 3, 4, 5, 6};
    const std::vector<double> doubles{0.1};
    const std::vector<uint64_t> words{~uint64_t{0}, 7};
    Tensors file;
    file.metadata = {{"who", "a \"test\" ☺"}, {"what", ""}};
    file.Add<uint8_t>("bytes", bytes);
    file.Add<float>("floats", floats, {2, 3});
    file.Add<float>("empty", std::span<const float>(), {0, 5});
    file.Add<double>("doubles", doubles);
    file.Add<uint64_t>("words", words);
    file.AddScalar("scalar", int64_t{-9});
    SaveTensors(file, path_);
  }

  /// The message of the error from loading these bytes.
  std::string LoadError(std::span<const std::byte> bytes) const {
    // Do not write as the program does, which waits for the disk. Some file systems also wait when
    // a file is overwritten.
    fs::remove(path_);
    std::ofstream(path_, std::ios::binary)
        .write(reinterpret_cast<const char*>(bytes.data()),
               static_cast<std::streamsize>(bytes.size()));
    try {
      LoadTensors(path_);
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  }

  /// The message of the error from a file with this header and `data` zero bytes, without a
  /// checksum.
  std::string HeaderError(const std::string& header, size_t data) const {
    const uint64_t length = header.size();
    std::string file(8, '\0');
    std::memcpy(file.data(), &length, 8);
    file += header + std::string(data, '\0');
    return LoadError(BytesOf(file));
  }

  TempFolder folder_;
  fs::path path_ = folder_ / "a.safetensors";
};

TEST_F(TensorFileTest, RoundTrip) {
  SaveSample();
  const Tensors file = LoadTensors(path_);
  EXPECT_EQ(file.Metadata("who"), "a \"test\" ☺");
  EXPECT_EQ(file.metadata.size(), 2U);
  EXPECT_EQ(file.all().size(), 6U);
  std::vector<float> floats(6);
  file.Read("floats", std::span(floats), {2, 3});
  EXPECT_EQ(floats, (std::vector<float>{1.5F, -2, 3, 4, 5, 6}));
  int64_t scalar = 0;
  file.Read("scalar", std::span(&scalar, 1));
  EXPECT_EQ(scalar, -9);
  EXPECT_EQ(file.Count<float>("empty"), 0U);
  EXPECT_EQ(file.Count<uint8_t>("bytes"), 3U);
}

TEST_F(TensorFileTest, NumbersOfBfloat16TakeHalfTheBytesAndAreReadAsFloat) {
  const std::vector<float> exact{1, -2.5F, 0, 0x1.fep127F, -0.0F, 0x1p-133F, 7};
  const std::vector<float> others{1, 0.1F};
  Tensors file;
  file.Add<float>("exact", exact, {7, 1});
  file.Add<float>("others", others);
  file.Add<float>("empty", std::span<const float>(), {0, 5});
  file.metadata["upswing_version"] = "0";
  SaveTensors(file, path_);
  const auto before = fs::file_size(path_);
  file.Narrow();
  EXPECT_EQ(file.all().at("exact").Describe(), "BF16 [7, 1]");
  EXPECT_EQ(file.all().at("others").dtype, Dtype::kF32);
  SaveTensors(file, path_);
  EXPECT_LT(fs::file_size(path_), before);

  const Tensors loaded = LoadTensors(path_);
  EXPECT_EQ(loaded.all().at("exact").Describe(), "F32 [7, 1]");
  EXPECT_EQ(loaded.Count<float>("empty"), 0U);
  std::vector<float> read(7);
  loaded.Read("exact", std::span(read), {7, 1});
  EXPECT_EQ(std::memcmp(read.data(), exact.data(), sizeof(float) * 7), 0);
}

TEST_F(TensorFileTest, WrongNameTypeShapeAndSizeAreNamed) {
  SaveSample();
  const Tensors file = LoadTensors(path_);
  std::vector<float> six(6), five(5);
  std::vector<double> doubles(6);
  EXPECT_THROW(file.Read("none", std::span(six)), Error);
  EXPECT_THROW(file.Read("floats", std::span(five)), Error);
  EXPECT_THROW(file.Read("floats", std::span(doubles)), Error);
  try {
    file.Read("floats", std::span(six), {3, 2});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()),
              path_.string() + ": tensor \"floats\": expected F32 [3, 2], got F32 [2, 3]");
  }
}

TEST_F(TensorFileTest, EveryTruncationIsFound) {
  SaveSample();
  const std::vector<std::byte> whole = ReadOwnBytes(path_);
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(LoadError(std::span(whole).first(size)), "") << size;
  }
}

TEST_F(TensorFileTest, EveryFlippedBitIsFound) {
  SaveSample();
  const std::vector<std::byte> whole = ReadOwnBytes(path_);
  // A flipped bit in the key "checksum" stays unnoticed. The file then has no checksum, and without
  // upswing_version it needs none.
  const size_t key = ReadOwnFile(path_).find("checksum");
  for (size_t at = 0; at < whole.size(); ++at) {
    for (int bit = 0; bit < 8; bit += 3) {
      std::vector<std::byte> broken = whole;
      broken[at] ^= std::byte{1} << bit;
      const bool in_key = at >= key && at < key + 8;
      EXPECT_TRUE(in_key || !LoadError(broken).empty()) << "byte " << at << " bit " << bit;
    }
  }
}

TEST_F(TensorFileTest, APartHasTheTensorsOfThePrefixWithTheirBytes) {
  SaveSample();
  const Tensors part = LoadPartOfTensors(path_, "s");
  EXPECT_EQ(part.metadata, LoadTensors(path_).metadata);
  EXPECT_EQ(part.all().size(), 1U);
  int64_t scalar = 0;
  part.Read("scalar", std::span(&scalar, 1));
  EXPECT_EQ(scalar, -9);

  const Tensors all = LoadPartOfTensors(path_, "");
  EXPECT_EQ(all.all().size(), 6U);
  std::vector<float> floats(6);
  all.Read("floats", std::span(floats), {2, 3});
  EXPECT_EQ(floats, (std::vector<float>{1.5F, -2, 3, 4, 5, 6}));
  std::vector<uint8_t> bytes(3);
  all.Read("bytes", std::span(bytes));
  EXPECT_EQ(bytes, (std::vector<uint8_t>{1, 2, 3}));
}

TEST_F(TensorFileTest, APartOfABrokenFileIsRefusedAsTheWholeIs) {
  SaveSample();
  const std::vector<std::byte> whole = ReadOwnBytes(path_);
  const auto part_error = [](const fs::path& path) -> std::string {
    try {
      LoadPartOfTensors(path, "");
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      return error.what();
    }
    return "";
  };
  for (size_t size = 0; size < whole.size(); size += 3) {
    const std::string error = LoadError(std::span(whole).first(size));
    EXPECT_NE(error, "") << size;
    EXPECT_EQ(part_error(path_), error) << size;
  }
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,4]}})", 4), "");
  EXPECT_EQ(part_error(path_),
            HeaderError(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,4]}})", 4));
  EXPECT_NE(part_error(folder_ / "none"), "");
  // Do not open a pipe, which would wait for a writer.
  const fs::path pipe = folder_ / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_THROW(LoadTensors(path_, fs::file_size(path_) - 1), Error);
  const fs::path sparse = folder_ / "sparse";
  WriteFileAtomically(sparse, "");
  fs::resize_file(sparse, uintmax_t{1} << 43);  // 8 TiB
  EXPECT_THROW(LoadTensors(sparse), Error);
  for (const fs::path& path : {pipe, folder_.path()}) {
    const std::string error = "cannot read " + path.string() + ": expected a regular file";
    EXPECT_EQ(part_error(path), error);
    EXPECT_THROW(LoadTensors(path), Error);
  }
}

TEST_F(TensorFileTest, APartIsSmall) {
  constexpr uintmax_t kTooLarge = kMostTextBytes + 1;
  HeaderError(Concat(R"({"a":{"dtype":"U8","shape":[)", kTooLarge, R"(],"data_offsets":[0,)",
                     kTooLarge, "]}}"),
              0);
  fs::resize_file(path_, fs::file_size(path_) + kTooLarge);  // sparse
  EXPECT_THROW(LoadPartOfTensors(path_, "a"), Error);
  EXPECT_NO_THROW(LoadPartOfTensors(path_, "b"));
}

TEST_F(TensorFileTest, HostileHeadersAreRefused) {
  EXPECT_NE(HeaderError("{", 0), "");
  EXPECT_NE(HeaderError("[]", 0), "");
  EXPECT_EQ(HeaderError("{}\xff\n", 0).find_first_of("\xff\n"), std::string::npos);
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[2],"data_offsets":[0,4]}})", 4), "");
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[-1],"data_offsets":[0,4]}})", 4), "");
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F99","shape":[1],"data_offsets":[0,4]}})", 4), "");
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[4,8]}})", 4), "");
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", 5), "");
  EXPECT_NE(HeaderError(
                R"({"a":{"dtype":"U8","shape":[4611686018427387904,8],"data_offsets":[0,0]}})", 0),
            "");
  EXPECT_NE(HeaderError(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]},)"
                        R"("b":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})",
                        4),
            "");
  EXPECT_EQ(HeaderError(R"({"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}})", 4), "");
}

TEST_F(TensorFileTest, OtherFormatsAreNamed) {
  const auto error = [&](const std::string& file) { return LoadError(BytesOf(file)); };
  const std::string zeros(100, '\0');
  EXPECT_NE(error("# My policy\n").find("got a text that begins with \"# My pol\""),
            std::string::npos);
  EXPECT_NE(error("PK\x03\x04\x14\x08\x08\x08" + zeros).find("got a zip archive"),
            std::string::npos);
  EXPECT_NE(error("\x80\x04\x95\x1f\x01\x01\x01\x01" + zeros).find("got a pickle"),
            std::string::npos);
  EXPECT_NE(error("\x1f\x8b\x08\x08\x01\x01\x01\x01" + zeros).find("got a gzip file"),
            std::string::npos);
  EXPECT_NE(error("\x01\x02\x03\x04\x05\x06\x07\x08" + zeros).find("got 578437695752307201"),
            std::string::npos);
}

TEST_F(TensorFileTest, NumbersInAHeaderAreNeitherRoundedNorWrapped) {
  const auto error = [&](const std::string& shape, const std::string& offsets) {
    return HeaderError(
        R"({"a":{"dtype":"F32","shape":)" + shape + R"(,"data_offsets":)" + offsets + "}}", 4);
  };
  EXPECT_EQ(error("[1]", "[0,4]"), "");
  for (const char* shape :
       {"[1.5]", "[true]", "[\"1\"]", "[-18446744073709551615]", "[18446744073709551617]",
        "[1e300]", "1", "null", "[[1]]", "[1,1,1,1,1,1,1,1,1]"}) {
    EXPECT_NE(error(shape, "[0,4]"), "") << shape;
  }
  for (const char* offsets : {"[0,4.5]", "[0]", "[0,4,4]", "[-0.5,4]", "[18446744073709551612,4]",
                              "[0,18446744073709551620]", "{}", "[false,4]", "[4,0]"}) {
    EXPECT_NE(error("[1]", offsets), "") << offsets;
  }
  EXPECT_NE(HeaderError(R"({"a":{"dtype":["F32"],"shape":[1],"data_offsets":[0,4]}})", 4), "");
  EXPECT_NE(HeaderError(R"({"a":3})", 0), "");
  EXPECT_NE(HeaderError(R"({"__metadata__":{"a":3}})", 0), "");
  EXPECT_NE(HeaderError(R"({"__metadata__":["a"]})", 0), "");
}

TEST_F(TensorFileTest, SizeAndDepthOfHeadersAreLimited) {
  const std::string deep(500000, '[');
  EXPECT_NE(HeaderError("{\"a\":" + deep, 0).find("levels deep"), std::string::npos);
  EXPECT_NE(HeaderError(std::string((1 << 20) + 1, ' '), 0).find("at most 1048576"),
            std::string::npos);
  Tensors file;
  file.metadata["long"] = std::string(1 << 20, 'x');
  const fs::path path = folder_ / "long";
  EXPECT_THROW(SaveTensors(file, path), Error);
  file.metadata["long"] = "\xff";  // not UTF-8
  EXPECT_THROW(SaveTensors(file, path), Error);
  EXPECT_FALSE(fs::exists(path));
}

TEST_F(TensorFileTest, APartIsNeverMoreThanTheFile) {
  // A header with many tensors that all claim the same bytes.
  std::string header;
  for (int i = 0; i < 100; ++i) {
    header += Concat(i == 0 ? "{" : ",", "\"a", i,
                     R"(":{"dtype":"U8","shape":[8],"data_offsets":[0,8]})");
  }
  EXPECT_NE(HeaderError(header + "}", 8).find("overlap"), std::string::npos);
  EXPECT_THROW(LoadPartOfTensors(path_, "a"), Error);
  EXPECT_THROW(LoadPartOfTensors(path_, "other"), Error);
}

TEST_F(TensorFileTest, AFileWithAnUpswingVersionNeedsItsChecksum) {
  Tensors file;
  file.metadata["upswing_version"] = "0.3.0";
  SaveTensors(file, path_);
  EXPECT_TRUE(LoadTensors(path_).has_checksum);
  EXPECT_NE(HeaderError(R"({"__metadata__":{"upswing_version":"0.3.0"}})", 0)
                .find("\"checksum\": expected one"),
            std::string::npos);
  EXPECT_EQ(HeaderError(R"({"__metadata__":{"version":"0.3.0"}})", 0), "");
  EXPECT_FALSE(LoadTensors(path_).has_checksum);
  for (const char* sum : {R"("checksum" : "0000000000000000")", R"("checksum":"")",
                          R"("checksum":"12")", R"("checksum":"0123456789abcdef")"}) {
    EXPECT_NE(HeaderError(std::string(R"({"__metadata__":{)") + sum + "}}", 0).find("checksum"),
              std::string::npos)
        << sum;
  }
}

/// A component with state of every kind.
struct Component {
  std::vector<float> fixed = std::vector<float>(3);
  std::vector<double> growing;
  int64_t number = 0;
  bool flag = false;
  Rng rng = Rng(0, "component");

  void State(const Archive& archive) {
    archive.Array("fixed", std::span(fixed));
    archive.Vector("growing", growing, 4);
    archive.Scalar("number", number, {-6, 6});
    archive.Scalar("flag", flag);
    rng.State(archive.In("rng"));
  }
};

TEST_F(TensorFileTest, ArchiveLoadsItsSavedState) {
  Component saved;
  saved.fixed = {1, 2, 3};
  saved.growing = {4, 5};
  saved.number = -6;
  saved.flag = true;
  saved.rng.Next();
  Tensors target;
  saved.State(Archive::Saver(target).In("part"));
  SaveTensors(target, path_);

  const Tensors source = LoadTensors(path_);
  EXPECT_EQ(source.all().count("part/rng/state"), 1U);
  Component loaded;
  loaded.State(Archive::Loader(source).In("part"));
  EXPECT_EQ(loaded.fixed, saved.fixed);
  EXPECT_EQ(loaded.growing, saved.growing);
  EXPECT_EQ(loaded.number, -6);
  EXPECT_TRUE(loaded.flag);
  EXPECT_EQ(loaded.rng.Next(), saved.rng.Next());
}

TEST_F(TensorFileTest, ArchiveNeitherSavesNorLoadsNumbersThatAreNotFinite) {
  Component component;
  component.fixed[1] = std::numeric_limits<float>::quiet_NaN();
  Tensors target;
  EXPECT_THROW(component.State(Archive::Saver(target)), Error);
  const std::vector<float> bad{1, std::numeric_limits<float>::infinity(), 2};
  Tensors written;
  written.Add<float>("fixed", bad);
  SaveTensors(written, path_);
  const Tensors source = LoadTensors(path_);
  EXPECT_THROW(component.State(Archive::Loader(source)), Error);
}

TEST_F(TensorFileTest, ArchiveNeitherSavesNorLoadsNumbersOutOfBounds) {
  for (const int64_t number : {int64_t{-7}, int64_t{7}, std::numeric_limits<int64_t>::min()}) {
    Component component;
    component.number = number;
    Tensors target;
    EXPECT_THROW(component.State(Archive::Saver(target)), Error);
    Tensors written;
    written.AddScalar("number", number);
    written.AddScalar("flag", int64_t{2});
    SaveTensors(written, path_);
    const Tensors source = LoadTensors(path_);
    const Archive archive = Archive::Loader(source);
    try {
      archive.Scalar("number", component.number, {-6, 6});
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.exit_code(), 2);
      EXPECT_EQ(error.what(),
                Concat(path_.string(), ": tensor \"number\": expected -6 to 6, got ", number));
    }
    EXPECT_THROW(archive.Scalar("flag", component.flag), Error);
  }
}

TEST_F(TensorFileTest, ArchiveLoadsNoRandomStreamOfZeros) {
  const std::vector<uint64_t> zeros(4);
  Tensors written;
  written.Add<uint64_t>("state", zeros);
  SaveTensors(written, path_);
  const Tensors source = LoadTensors(path_);
  Rng rng(1, "stream");
  EXPECT_THROW(rng.State(Archive::Loader(source)), Error);
}

TEST_F(TensorFileTest, ArchiveRefusesMoreThanTheLargestSize) {
  Component saved;
  saved.growing = {1, 2, 3, 4, 5};
  Tensors target;
  saved.State(Archive::Saver(target));
  SaveTensors(target, path_);
  const Tensors source = LoadTensors(path_);
  Component loaded;
  EXPECT_THROW(loaded.State(Archive::Loader(source)), Error);
}

}  // namespace
}  // namespace upswing
