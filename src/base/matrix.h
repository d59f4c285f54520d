#pragma once

#include <cassert>
#include <cstddef>
#include <span>
#include <type_traits>

namespace upswing {

/// A view of `rows` × `cols` numbers in row-major order. `stride` is the distance between the
/// starts of two rows, in numbers. Owns nothing.
template <typename T>
class Matrix {
 public:
  Matrix() = default;
  // Written out, because a copy as one block of memory would wait for the numbers just stored one
  // by one, and for all stores before them. That costs 2% of a training with small networks.
  Matrix(const Matrix& other) : Matrix(other.data_, other.rows_, other.cols_, other.stride_) {}
  // NOLINTNEXTLINE(bugprone-unhandled-self-assignment): copies numbers only
  Matrix& operator=(const Matrix& other) {
    data_ = other.data_;
    rows_ = other.rows_;
    cols_ = other.cols_;
    stride_ = other.stride_;
    return *this;
  }
  Matrix(T* data, int rows, int cols) : Matrix(data, rows, cols, cols) {}
  Matrix(T* data, int rows, int cols, int stride)
      : data_(data), rows_(rows), cols_(cols), stride_(stride) {}
  Matrix(std::span<T> values, int rows, int cols) : Matrix(values.data(), rows, cols) {
    assert(values.size() >= size());
  }
  /// Converts to a read-only view of the same numbers.
  template <typename U>
  requires std::is_same_v<const U, T>
  // NOLINTNEXTLINE(google-explicit-constructor): implicit, as T* converts to const T*
  Matrix(const Matrix<U>& other)
      : Matrix(other.data(), other.rows(), other.cols(), other.stride()) {}

  T* data() const { return data_; }
  int rows() const { return rows_; }
  int cols() const { return cols_; }
  int stride() const { return stride_; }
  size_t size() const { return static_cast<size_t>(rows_) * static_cast<size_t>(cols_); }
  bool empty() const { return size() == 0; }

  T& operator()(int row, int col) const { return data_[Offset(row) + col]; }
  /// One row as a span (cols).
  std::span<T> row(int i) const { return {data_ + Offset(i), static_cast<size_t>(cols_)}; }
  /// View of `count` rows from row `first`.
  Matrix Rows(int first, int count) const {
    assert(first >= 0 && first + count <= rows_);
    return {data_ + Offset(first), count, cols_, stride_};
  }
  /// View of `count` columns from column `first`.
  Matrix Cols(int first, int count) const {
    assert(first >= 0 && first + count <= cols_);
    return {data_ + first, rows_, count, stride_};
  }
  /// All numbers as one span (rows · cols). The rows must have no gaps between them.
  std::span<T> values() const {
    assert(stride_ == cols_ || rows_ <= 1);
    return {data_, size()};
  }

 private:
  ptrdiff_t Offset(int row) const { return static_cast<ptrdiff_t>(row) * stride_; }

  T* data_ = nullptr;
  int rows_ = 0;
  int cols_ = 0;
  int stride_ = 0;
};

}  // namespace upswing
