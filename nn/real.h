#pragma once

namespace upswing {

/// The numbers of kernels and networks: float. With UPSWING_DOUBLE they are double, for tests
/// alone: there finite differences check gradients to 6 digits (see nn_double_test in
/// CMakeLists.txt).
#ifdef UPSWING_DOUBLE
using Real = double;
#else
using Real = float;
#endif

}  // namespace upswing
