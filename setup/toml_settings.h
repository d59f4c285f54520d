#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/options.h"
#include "setup/config.h"

namespace upswing {

/// Parses a TOML document. Throws BadInput with `where`, which names it, and the line.
toml::table ParseToml(std::string_view text, const std::string& where);

/// Name of a document and line of one of its nodes: `FILE:3`.
std::string PlaceOf(const toml::node& node, const std::string& where);

/// A TOML value as the text that Option::Set takes; nothing for a type that no setting has.
std::optional<std::string> TextOf(const toml::node& node);

/// Sets the options that a table names in their sections; if `alone`, also outside of sections.
/// Returns what it set. Throws BadInput with the line.
std::vector<FlagValue> ApplyTable(const Options& options, const toml::table& table,
                                  const std::string& where, bool alone);

}  // namespace upswing
