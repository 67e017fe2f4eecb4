#include "python/mesh_arrays.h"

#include <bit>
#include <limits>
#include <stdexcept>

#include "python/call.h"
#include "python/numpy_arrays.h"
#include "scene/shading_normals.h"

namespace nb = nanobind;

namespace edgegrad {

nb::object angle_weighted_normals(nb::handle vertices, nb::handle faces, nb::handle smoothing,
                                  int64_t count) {
    const InputArray<double> points(vertices, "vertices", {-1, 3});
    const InputArray<int32_t> corners(faces, "faces", {-1, 3});
    const InputArray<int32_t> groups(smoothing, "smoothing", {static_cast<int64_t>(corners.shape(0)), 3});
    for (size_t k = 0; k < corners.size(); ++k) {
        if (corners.data()[k] < 0 || static_cast<size_t>(corners.data()[k]) >= points.shape(0))
            throw std::invalid_argument("the array 'faces' names a vertex that is not there");
        if (groups.data()[k] < -1 || groups.data()[k] >= count)
            throw std::invalid_argument("the array 'smoothing' names a normal that is not there");
    }
    std::vector<double> normals;
    {
        const WithoutInterpreter without;
        normals = angle_weighted_normals(points.data(), corners.data(), groups.data(), corners.shape(0),
                                         static_cast<size_t>(count));
    }
    return to_numpy(normals, {static_cast<size_t>(count), 3});
}

// A hash table with open addressing: each slot holds the number of a key, whose value is that of its first
// key.
nb::tuple number_equal_keys(nb::handle keys) {
    const InputArray<uint64_t> given(keys, "keys", {-1});
    const size_t n = given.size();
    if (n > static_cast<size_t>(std::numeric_limits<int32_t>::max()))
        throw std::invalid_argument("the array 'keys' is too long");
    const OutputArray<int32_t> numbers({n});
    std::vector<int64_t> first;
    {
        const WithoutInterpreter without;
        const int log_slots = std::bit_width(2 * n + 1);
        std::vector<int32_t> slots(size_t{1} << log_slots, -1);
        for (size_t k = 0; k < n; ++k) {
            const uint64_t key = given.data()[k];
            // Multiplied by 2^64 divided by the golden ratio, since zero and other small keys are allowed.
            size_t at = static_cast<size_t>(key * 0x9E3779B97F4A7C15u >> (64 - log_slots));
            while (slots[at] >= 0 && given.data()[first[static_cast<size_t>(slots[at])]] != key)
                at = (at + 1) & (slots.size() - 1);
            if (slots[at] < 0) {
                slots[at] = static_cast<int32_t>(first.size());
                first.push_back(static_cast<int64_t>(k));
            }
            numbers.data()[k] = slots[at];
        }
    }
    return nb::make_tuple(numbers.array(), to_numpy(first, {first.size()}));
}

}  // namespace edgegrad
