#pragma once

#include <filesystem>
#include <string>
#include <vector>

/// What `export` writes for programs in other languages.
namespace upswing {

/// The task's formulas as numbers, by which a reader in another language tests its own: a JSON
/// document of plants, states and what follows from them, the same with every call.
std::string TestVectorsJson();

/// Copies policies (files or run folders) into a page's folder of agents as ID.safetensors and
/// adds them to its agents.json, or replaces those of the same ID there. `id` names a single one;
/// empty: by its run's folder, else by its agent. Everything is read and checked before anything
/// is written. Returns their IDs. Throws BadInput; Failure if the folder cannot be written.
std::vector<std::string> ExportToPage(const std::vector<std::filesystem::path>& paths,
                                      const std::string& id, const std::filesystem::path& folder);

}  // namespace upswing
