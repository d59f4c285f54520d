#pragma once

namespace upswing {

/// Number type of kernels and networks: float. UPSWING_DOUBLE makes it double, only for tests:
/// finite differences then check gradients to 6 digits (see nn_double_test in CMakeLists.txt).
#ifdef UPSWING_DOUBLE
using Real = double;
#else
using Real = float;
#endif

}  // namespace upswing
