#pragma once

#include <string>

#include "export/export.h"

namespace upswing {

/// The C header of a controller: lqr, energy, pfl or tvlqr; see CHeaderOf, which checks the prefix.
/// Throws BadInput for others.
CHeader ControllerHeaderOf(const LoadedPolicy& loaded, const std::string& prefix);

}  // namespace upswing
