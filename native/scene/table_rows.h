// Pointers to tables that always have at least one row.
#pragma once

#include <cstddef>
#include <type_traits>
#include <vector>

namespace edgegrad {

// At least as wide as the rows of any table.
inline constexpr size_t kZeroRowBytes = 1024;
alignas(64) inline constexpr std::byte kZeroRow[kZeroRowBytes] = {};

// The rows of a table, or one row of zeros for an empty table. Packets read row 0 for inactive lanes, also in
// scenes without meshes, edges, materials or lights. So every table that kernels gather from must have that
// row. Tables that may be absent as a whole are null instead, and kernels test for that.
template <typename T>
const T* zero_row() {
    static_assert(std::is_trivially_copyable_v<T> && sizeof(T) <= kZeroRowBytes);
    return reinterpret_cast<const T*>(kZeroRow);
}
template <typename T>
const T* rows_of(const std::vector<T>& table) {
    return table.empty() ? zero_row<T>() : table.data();
}

}  // namespace edgegrad
