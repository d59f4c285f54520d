#pragma once

#include <toml++/toml.h>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "agents/config.h"
#include "base/options.h"

namespace upswing {

/// Parses a TOML document. Throws BadInput with `where`, the document's name, and the line. Also
/// refuses documents that are too large or too deeply nested to parse safely.
toml::table ParseToml(std::string_view text, const std::string& where);

/// Place of a node of a document: name and line, such as `FILE:3`.
std::string PlaceOf(const toml::node& node, const std::string& where);

/// A TOML value as text for Option::Set; nothing for a type that no setting has.
std::optional<std::string> TextOf(const toml::node& node);

/// Takes the text of a key out of a table; empty: the table lacks it. Throws BadInput for another
/// type.
std::string TakeText(toml::table& table, std::string_view key, const std::string& where);

/// Removes everything from a table that is not an option in its section. Returns the names, such as
/// task.model.
std::vector<std::string> TakeUnknown(const Options& options, toml::table& table);

/// Sets the options in the sections of a table; if `flat`, also options outside of sections.
/// Returns the settings that it applied. Throws BadInput with the line.
std::vector<FlagValue> ApplyTable(const Options& options, const toml::table& table,
                                  const std::string& where, bool flat);

}  // namespace upswing
