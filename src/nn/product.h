#pragma once

#include <cstddef>
#include <span>

#include "base/matrix.h"
#include "nn/real.h"

namespace upswing {

/// C (M × N) = A (M × K) · B (K × N) + bias, where A(m, k) = a[m · a_m + k · a_k]. All three
/// products of a linear layer have this form.
struct Product {
  int M, N, K;
  const Real* a;
  ptrdiff_t a_m, a_k;
  Matrix<const Real> b;          // (K × N)
  Matrix<Real> c;                // (M × N)
  const Real* bias = nullptr;    // (N); null: no bias
  std::span<Real> b_sum = {};    // (N) receives the sums of the rows of B; empty: not wanted
  bool relu = false;             // C = max(C, 0)
  Matrix<const Real> gate = {};  // (M × N) C = 0 where gate is not positive; empty: no gate
};

/// Computes C (at least one column) with vector instructions. The order of each sum depends only on
/// the sizes.
void Multiply(const Product& product);

}  // namespace upswing
