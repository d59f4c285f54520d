#pragma once

#include <cstddef>

#include "core/matrix.h"
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
  const Real* bias = nullptr;    // (N), or null for none
  bool relu = false;             // C = max(C, 0)
  Matrix<const Real> gate = {};  // C = 0 where gate (M × N) is not positive; empty for none

  /// The part that computes `rows` rows from m on and `cols` columns from n on.
  Product Part(int m, int rows, int n, int cols) const {
    return {rows,
            cols,
            K,
            a + m * a_m,
            a_m,
            a_k,
            b.Cols(n, cols),
            c.Rows(m, rows).Cols(n, cols),
            bias == nullptr ? nullptr : bias + n,
            relu,
            gate.empty() ? gate : gate.Rows(m, rows).Cols(n, cols)};
  }
};

/// Computes C, of at least one column, on vectors. The order of each sum depends on the sizes
/// alone.
void Multiply(const Product& product);

}  // namespace upswing
