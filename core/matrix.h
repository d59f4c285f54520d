#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <type_traits>
#include <vector>

namespace upswing {

/// A view of `rows` × `cols` numbers, row after row without gaps. Owns nothing.
template <typename T>
class Matrix {
 public:
  Matrix() = default;
  Matrix(T* data, int rows, int cols) : data_(data), rows_(rows), cols_(cols) {}
  Matrix(std::span<T> values, int rows, int cols) : Matrix(values.data(), rows, cols) {
    assert(values.size() >= size());
  }
  /// A read-only view of the same numbers.
  template <typename U>
  requires std::is_same_v<const U, T>
  // NOLINTNEXTLINE(google-explicit-constructor): as a pointer converts
  Matrix(const Matrix<U>& other) : Matrix(other.data(), other.rows(), other.cols()) {}

  T* data() const { return data_; }
  int rows() const { return rows_; }
  int cols() const { return cols_; }
  size_t size() const { return static_cast<size_t>(rows_) * static_cast<size_t>(cols_); }
  bool empty() const { return size() == 0; }

  T& operator()(int row, int col) const { return data_[Offset(row) + col]; }
  /// One row as a span (cols).
  std::span<T> row(int i) const { return {data_ + Offset(i), static_cast<size_t>(cols_)}; }
  /// `count` rows from `first` on.
  Matrix Rows(int first, int count) const {
    assert(first >= 0 && first + count <= rows_);
    return {data_ + Offset(first), count, cols_};
  }
  /// All numbers as one span (rows · cols).
  std::span<T> values() const { return {data_, size()}; }

 private:
  ptrdiff_t Offset(int row) const { return static_cast<ptrdiff_t>(row) * cols_; }

  T* data_ = nullptr;
  int rows_ = 0;
  int cols_ = 0;
};

}  // namespace upswing
