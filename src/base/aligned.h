#pragma once

#include <cstddef>
#include <new>
#include <vector>

namespace upswing {

/// Allocates memory that begins on a cache line. The order of a vectorised sum depends on the
/// alignment of its array. Without a fixed alignment, the last bit of a sum could depend on the
/// array's address.
template <typename T>
struct AlignedAllocator {
  using value_type = T;
  static constexpr std::align_val_t kAlignment{64};

  AlignedAllocator() = default;
  template <typename U>
  AlignedAllocator(const AlignedAllocator<U>&) {}  // NOLINT(google-explicit-constructor)

  T* allocate(size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kAlignment)); }
  void deallocate(T* p, size_t) { ::operator delete(p, kAlignment); }
  bool operator==(const AlignedAllocator&) const = default;
};

/// A vector with the alignment that the kernels need.
template <typename T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace upswing
