// Runs a target's corpus without libFuzzer: CORPUS/accepted/* must be accepted, CORPUS/refused/*
// refused. If files are named instead, it tries them one by one, to examine a finding.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <new>
#include <string>
#include <vector>

#include "os/file.h"
#include "tools/fuzz/target.h"

namespace {

namespace fs = std::filesystem;

/// Largest allocation that an input of a corpus needs. A parser that asks for more trusts a size
/// claimed by the file. libFuzzer's -malloc_limit_mb detects the same.
constexpr size_t kMostBytes = size_t{64} << 20;

/// Tries one file. Returns whether it was accepted.
bool Try(const fs::path& file) {
  std::printf("%s\n", file.c_str());
  std::fflush(stdout);  // shows which file ended the process
  return upswing::TryInput(upswing::ReadOwnFile(file));
}

/// Tries the files of a folder. Returns how many contradict the folder's name.
int TryFolder(const fs::path& folder) {
  const bool expected = folder.filename() == "accepted";
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) files.push_back(entry.path());
  std::ranges::sort(files);
  int wrong = 0;
  for (const fs::path& file : files) {
    if (Try(file) == expected) continue;
    std::printf("  expected it to be %s\n", expected ? "accepted" : "refused");
    ++wrong;
  }
  std::printf("%s: %zu files, %d wrong\n", folder.c_str(), files.size(), wrong);
  return wrong + (files.empty() ? 1 : 0);
}

}  // namespace

void* operator new(size_t size) {
  if (size > kMostBytes) {
    std::fprintf(stderr, "expected at most %zu bytes at once, got a demand for %zu\n", kMostBytes,
                 size);
    std::abort();
  }
  if (void* block = std::malloc(size > 0 ? size : 1)) return block;
  throw std::bad_alloc();
}
void* operator new(size_t size, const std::nothrow_t& /*tag*/) noexcept {
  return std::malloc(size > 0 ? size : 1);
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, size_t) noexcept { std::free(block); }

int main(int argc, char** argv) {
  int wrong = 0;
  for (int i = 1; i < argc; ++i) {
    const fs::path path = argv[i];
    if (fs::is_directory(path)) {
      wrong += TryFolder(path / "accepted") + TryFolder(path / "refused");
    } else {
      std::printf("  %s\n", Try(path) ? "accepted" : "refused");
    }
  }
  return argc > 1 && wrong == 0 ? EXIT_SUCCESS : EXIT_FAILURE;
}
