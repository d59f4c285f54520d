#include "lab/export.h"

#include <fmt/format.h>

#include <memory>

#include "apps/commands.h"
#include "core/error.h"
#include "core/text.h"
#include "io/streams.h"

namespace upswing {
namespace {

namespace fs = std::filesystem;

struct ExportArguments {
  std::vector<std::string> policies;
  std::string page, id, test_vectors;
};

int RunExport(const ExportArguments& a) {
  if (a.page.empty() == a.test_vectors.empty()) {
    throw BadInput(a.page.empty() ? "export: expected --page or --test-vectors"
                                  : "export: expected --page or --test-vectors, got both");
  }
  if (a.page.empty()) {
    if (!a.policies.empty() || !a.id.empty()) {
      throw BadInput("--test-vectors: expected no policy and no --id, for it is of the task alone");
    }
    WriteOutput(a.test_vectors, TestVectorsJson());
    return 0;
  }
  if (a.policies.empty()) throw BadInput("--page: expected policies or run folders, got none");
  const std::vector<fs::path> paths(a.policies.begin(), a.policies.end());
  for (const std::string& id : ExportToPage(paths, a.id, a.page)) {
    fmt::print("{}\n", Printable((fs::path(a.page) / (id + ".safetensors")).string()));
  }
  return 0;
}

}  // namespace

void AddExport(CLI::App& program, Command& command) {
  CLI::App* app = program.add_subcommand(
      "export", "Put policies into the page, or write numbers to test other readers by");
  auto a = std::make_shared<ExportArguments>();
  app->add_option("policies", a->policies, "policy.safetensors or run folders")
      ->type_name("POLICY|RUN")
      ->check(NotEmpty());
  app->add_option("--page", a->page,
                  "the page's folder of agents; one of the same ID is replaced there")
      ->type_name("FOLDER")
      ->check(NotEmpty());
  app->add_option("--id", a->id, "ID in the page, of a single policy [name of the run, or agent]")
      ->type_name("ID")
      ->check(NotEmpty());
  app->add_option("--test-vectors", a->test_vectors,
                  "JSON file to write: states, and what the task's formulas make of them; -: "
                  "standard output")
      ->type_name("FILE")
      ->check(NotEmpty());
  app->footer(
      "Examples:\n"
      "  ./upswing export runs/d3qn-seed1 --page web/public/agents     for every visitor\n"
      "  ./upswing export runs/* --page build/web/agents               in the page built here\n"
      "  ./upswing export policy.safetensors --id mine --page build/web/agents\n"
      "  ./upswing export --test-vectors vectors.json\n\n"
      "`./upswing demo runs/d3qn-seed1` does the second and serves the page.\n");
  app->callback([a, &command] { command = [a] { return RunExport(*a); }; });
}

}  // namespace upswing
