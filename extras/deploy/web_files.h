#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "extras/deploy/http.h"

namespace upswing::deploy {

/// The files of a page, as answers to requests. Nothing outside its folders can be read.
class WebFiles {
 public:
  /// Serves `folder`, whose index.html answers for /.
  explicit WebFiles(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Serves addresses that begin with /`name`/ from another folder.
  void Replace(const std::string& name, std::filesystem::path folder);

  /// Compresses all files that gain from it, so that no later request waits for that.
  void Compress();

  /// The answer to a request, also to a refused one.
  HttpReply Answer(const HttpRequest& request);

 private:
  /// A compressed file.
  struct Compressed {
    std::string version;  // checksum of the file
    std::shared_ptr<const std::string> bytes;
  };

  /// The file for a decoded path; empty if there is none.
  std::filesystem::path Find(const std::string& path) const;
  /// The compressed file; compresses it if another version is known or none.
  std::shared_ptr<const std::string> CompressedOf(const std::filesystem::path& file,
                                                  const std::string& text,
                                                  const std::string& version);

  std::filesystem::path folder_;
  std::map<std::string, std::filesystem::path> replaced_;
  std::map<std::filesystem::path, Compressed> compressed_;
};

}  // namespace upswing::deploy
