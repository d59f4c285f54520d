#include "extras/deploy/web_files.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "base/checksum.h"
#include "base/error.h"
#include "base/text.h"
#include "os/file.h"
#include "os/gzip.h"

namespace upswing::deploy {
namespace {

namespace fs = std::filesystem;

struct FileType {
  std::string_view ending, type;
  bool shrinks;  // whether gzip gains from it
};

constexpr auto kTypes =
    std::to_array<FileType>({{".html", "text/html; charset=utf-8", true},
                             {".js", "text/javascript; charset=utf-8", true},
                             {".css", "text/css; charset=utf-8", true},
                             {".wasm", "application/wasm", true},
                             {".json", "application/json", true},
                             {".webmanifest", "application/manifest+json", true},
                             {".xml", "text/xml; charset=utf-8", true},
                             {".svg", "image/svg+xml", true},
                             {".txt", "text/plain; charset=utf-8", true},
                             {".png", "image/png", false},
                             {".gif", "image/gif", false},
                             {".ico", "image/x-icon", false},
                             {".webm", "video/webm", false},
                             {".woff2", "font/woff2", false},
                             {".safetensors", "application/octet-stream", false}});
constexpr FileType kOther{"", "application/octet-stream", false};

const FileType& TypeOf(const fs::path& file) {
  const auto* found = std::ranges::find(kTypes, file.extension().string(), &FileType::ending);
  return found == kTypes.end() ? kOther : *found;
}

std::string VersionOf(const std::string& text) {
  Checksum checksum;
  checksum.Update(BytesOf(text));
  return checksum.Hex();
}

/// Whether `path` is in `folder`; both without links.
bool IsIn(const fs::path& folder, const fs::path& path) {
  return std::ranges::mismatch(folder, path).in1 == folder.end();
}

}  // namespace

void WebFiles::Replace(const std::string& name, fs::path folder) {
  replaced_[name] = std::move(folder);
}

fs::path WebFiles::Find(const std::string& path) const {
  fs::path inside = fs::path(path).relative_path();
  // Hidden names are not part of a page; .. begins with a dot, too.
  const auto is_hidden = [](const fs::path& name) { return name.string().starts_with('.'); };
  if (std::ranges::any_of(inside, is_hidden)) return {};
  if (path.ends_with('/')) inside /= "index.html";

  fs::path folder = folder_;
  if (const auto other = replaced_.find(inside.begin()->string()); other != replaced_.end()) {
    folder = other->second;
    inside = inside.lexically_relative(other->first);
  }
  std::error_code error;
  const fs::path root = fs::canonical(folder, error);
  if (error) return {};
  const fs::path file = fs::canonical(root / inside, error);
  return !error && IsIn(root, file) && IsFile(file) ? file : fs::path();
}

std::shared_ptr<const std::string> WebFiles::CompressedOf(const fs::path& file,
                                                          const std::string& text,
                                                          const std::string& version) {
  Compressed& known = compressed_[file];
  if (known.version != version) {
    known = {version, std::make_shared<const std::string>(Gzip(text))};
  }
  return known.bytes;
}

void WebFiles::Compress() {
  for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
    if (!TypeOf(entry.path()).shrinks || !entry.is_regular_file()) continue;
    const std::string text = ReadOwnFile(entry.path());
    CompressedOf(fs::canonical(entry.path()), text, VersionOf(text));
  }
}

HttpReply WebFiles::Answer(const HttpRequest& request) {
  if (request.refusal != 0) return MakeHttpError(request, request.refusal);
  const fs::path file = Find(request.path);
  if (file.empty()) return MakeHttpError(request, 404);
  try {
    const FileType& type = TypeOf(file);
    auto body = std::make_shared<const std::string>(ReadOwnFile(file));
    const std::string version = VersionOf(*body);
    const bool shrunk = type.shrinks && request.takes_gzip;
    const std::string tag = Concat('"', version, shrunk ? "-gzip\"" : "\"");
    // The browser asks each time, so that it sees a page that was built again.
    std::string fields = Concat("Cache-Control: no-cache\r\nETag: ", tag, "\r\n");
    if (type.shrinks) fields += "Vary: Accept-Encoding\r\n";
    if (request.if_none_match.find(tag) != std::string::npos) {
      return MakeHttpReply(request, 304, fields, nullptr);
    }
    fields += Concat("Content-Type: ", type.type, "\r\n");
    if (shrunk) {
      fields += "Content-Encoding: gzip\r\n";
      body = CompressedOf(file, *body, version);
    }
    return MakeHttpReply(request, 200, fields, std::move(body));
  } catch (const Error&) {
    return MakeHttpError(request, 500);  // it cannot be read
  }
}

}  // namespace upswing::deploy
