#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/text.h"
#include "cli/command_line.h"
#include "cli/python_child.h"
#include "cli/signals.h"
#include "extras/deploy/export.h"
#include "os/command.h"
#include "os/file.h"
#include "os/gzip.h"
#include "os/streams.h"

namespace upswing::deploy {

/// The program in Python that serves: the text of extras/deploy/demo_server.py.
const char* DemoServer();

namespace {

namespace fs = std::filesystem;

constexpr const char* kAgents = "agents";  // the page's folder of policies
constexpr int kUsualPort = 4173, kLastPort = 65535;
constexpr int kPatience = 15;  // s, for a whole request, and for a part of an answer

struct DemoArguments {
  std::vector<std::string> policies;
  int64_t port = 0;  // 0: not given
  std::string dist, file;
};

/// The folder of the built page: UPSWING_PAGE, else that of an installed program. Throws Failure.
fs::path PageFolder() {
  const char* given = std::getenv("UPSWING_PAGE");
  const bool is_given = given != nullptr && *given != '\0';
  fs::path page = is_given ? fs::path(given) : SharePath() / "page";
  if (IsFile(page / "index.html")) return page;
  throw Failure(Concat("demo: expected the built page (index.html) in ", page.string(),
                       ", found none; UPSWING_PAGE names another folder, and ./upswing demo in "
                       "the sources builds the page"));
}

/// Copies the content of `from` into the existing folder `to`. New folders are writable, also where
/// an installed page is not.
void CopyContent(const fs::path& from, const fs::path& to) {
  for (const auto& entry : fs::directory_iterator(from)) {
    const fs::path target = to / entry.path().filename();
    if (entry.is_directory()) {
      fs::create_directory(target);
      CopyContent(entry.path(), target);
    } else {
      fs::copy_file(entry.path(), target);
    }
  }
}

/// Adds policies to a folder of agents. Returns the end of the address at which the first one
/// plays; empty without policies.
std::string AddAgents(const DemoArguments& a, const fs::path& folder) {
  if (a.policies.empty()) return "";
  const fs::path first = ExportToPage(a.policies, "", 0, folder).front();
  return Concat("#agent=", first.stem().string(), "&on=1");  // an ID has letters, digits and -
}

/// --dist without slashes at its end, which would hide its name.
fs::path DistFolder(std::string dist) {
  while (dist.size() > 1 && dist.ends_with('/')) dist.pop_back();
  return dist;
}

/// Mistakes in --dist and --file are reported before the agents are read.
void CheckPlace(const DemoArguments& a) {
  if (!a.file.empty()) CheckWritable("--file", a.file);
  if (a.dist.empty()) return;
  const fs::path dist = DistFolder(a.dist);
  CheckFree(dist, "choose another --dist");
  const fs::path parent = dist.has_parent_path() ? dist.parent_path() : ".";
  if (!fs::is_directory(parent)) {
    throw BadInput(Concat("--dist: expected the existing folder ", parent.string(), " for ",
                          dist.filename().string(), ", found none"));
  }
}

/// Writes the page with the policies into a new folder.
int WriteDist(const DemoArguments& a, const fs::path& page) {
  const fs::path dist = DistFolder(a.dist);
  Making making(dist, Making::Kind::kFolder);
  CopyContent(page, making.path());
  (void)AddAgents(a, making.path() / kAgents);
  if (StopSignal() != 0) return 128 + StopSignal();
  making.Publish();
  const std::string name = dist.string();
  if (Printable(name) == name) {
    fmt::print("{}: the page, for any web server; to look at it: python3 -m http.server -d {}\n",
               name, ShellQuoted(name));
  } else {
    fmt::print("the page is written, for any web server\n");
  }
  return 0;
}

/// A folder of agents, and the end of the address that shows the first one added (may be empty).
struct PageAgents {
  fs::path folder;
  std::string address;
};

/// The page's agents. With policies, their files and those of the page's own agents are in the new
/// folder `temporary`, because the page may be read-only.
PageAgents AgentsOf(const DemoArguments& a, const fs::path& page,
                    std::optional<Making>& temporary) {
  if (a.policies.empty()) return {page / kAgents, ""};
  temporary.emplace(fs::temp_directory_path() / "upswing-demo", Making::Kind::kFolder);
  fs::path agents = temporary->path() / kAgents;
  fs::create_directory(agents);
  if (fs::is_directory(page / kAgents)) CopyContent(page / kAgents, agents);
  return {agents, AddAgents(a, agents)};
}

std::string Base64(std::string_view bytes) {
  constexpr std::string_view kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (size_t at = 0; at < bytes.size(); at += 3) {
    uint32_t group = 0;
    for (size_t k = at; k < at + 3; ++k) {
      group = group << 8 | (k < bytes.size() ? static_cast<uint8_t>(bytes[k]) : 0);
    }
    for (const int shift : {18, 12, 6, 0}) text += kLetters[group >> shift & 63];
  }
  const size_t spare = (3 - bytes.size() % 3) % 3;
  return text.replace(text.size() - spare, spare, spare, '=');
}

/// Writes the page with its agents as one file, as web/src/page/fetch.ts reads it.
int WriteSingle(const DemoArguments& a, const fs::path& page) {
  constexpr std::string_view kPlace = "<!-- files -->";
  std::string html = ReadOwnFile(page / "single.html");
  const size_t place = html.rfind(kPlace);
  if (place == std::string::npos) {
    throw Failure(Concat(page.string(), ": expected \"", kPlace, "\" in single.html, found none"));
  }
  const std::string_view beginning = std::string_view(html).substr(0, html.find("data-view"));
  CheckReplaceable("--file", a.file, "page", {Concat(beginning, "data-view")});
  std::optional<Making> temporary;
  std::string files;
  for (const fs::path& folder : {page / "assets", AgentsOf(a, page, temporary).folder}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const fs::path& file = entry.path();
      const std::string type = file.extension().string();
      if (type != ".wasm" && type != ".json" && type != ".safetensors") continue;
      files += Concat("<script type=\"text/plain\" data-file=\"", file.filename().string(), "\">",
                      Base64(Gzip(ReadOwnFile(file))), "</script>\n");
    }
  }
  WriteOutput(a.file, html.replace(place, kPlace.size(), files));
  if (IsStandardStream(a.file)) return 0;
  fmt::print("{} ({:.1f} MB): the page, which a browser opens without a server\n",
             Printable(a.file), static_cast<double>(html.size()) / 1e6);
  return 0;
}

/// Serves the page until a signal ends it.
int ServePage(const DemoArguments& a, const fs::path& page) {
  int64_t first_port = a.port;
  int64_t last_port = a.port;
  if (a.port == 0) {
    first_port = kUsualPort;
    last_port = kLastPort;
  }
  std::string job =
      Concat(kPatience, '\n', first_port, '\n', last_port, '\n', fs::absolute(page).string());
  std::optional<Making> temporary;
  const auto [agents, address] = AgentsOf(a, page, temporary);
  if (temporary) job += '\n' + agents.string();
  PythonChild server("demo", DemoServer(), job);
  while (const auto port = server.Next()) {
    fmt::print("The page is at http://localhost:{}/{} (stop with Ctrl-C).\n", *port, address);
    std::fflush(stdout);
  }
  const int code = server.Finish();
  return StopSignal() == 0 ? code : 128 + StopSignal();
}

int RunDemo(const DemoArguments& a) {
  const fs::path page = PageFolder();
  InstallSignalHandlers("");
  if (!a.file.empty()) return WriteSingle(a, page);
  return a.dist.empty() ? ServePage(a, page) : WriteDist(a, page);
}

}  // namespace

void AddDemo(CommandLine& line) {
  DemoArguments& a = line.Runs(RunDemo);
  line.Texts("policies", a.policies, "POLICY|RUN",
             "policies to add to the page's: policy.safetensors or run folders");
  Options own;
  own.Add(&a.port, "port", {1, kLastPort}, "", "port to listen on").usual =
      Concat(kUsualPort, ", or the next free one");
  line.Arguments(own);
  line.Text("--dist", a.dist, "FOLDER",
            "new or empty folder to write the page into, for any web server, instead of serving",
            "a folder");
  line.Text(
      "--file", a.file, "FILE.html",
      "HTML file to write the page into, which a browser opens without a server or a network");
  line.Excludes("--port", {"--dist", "--file"});
  line.Excludes("--dist", {"--file"});
  line.Check([&a] { CheckPlace(a); });
  line.Notes(
      "At the printed address the first of the policies plays. The server listens on this machine\n"
      "only. It runs in Python: `python3`, or the one that UPSWING_PYTHON names.\n");
  line.Examples(
      "  ./upswing demo\n"
      "  ./upswing demo runs/d3qn-seed1\n"
      "  ./upswing demo --dist site && python3 -m http.server -d site\n"
      "  ./upswing demo --file upswing.html\n");
}

}  // namespace upswing::deploy
