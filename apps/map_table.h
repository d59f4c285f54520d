#pragma once

#include "judge/map_result.h"

namespace upswing {

/// Prints the map's figures on standard output.
void PrintMapTable(const MapResult& map);

}  // namespace upswing
