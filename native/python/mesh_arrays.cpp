// Bindings for the export of meshes: what is slow in numpy for millions of triangles.
#include "python/bindings.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <stdexcept>
#include <utility>
#include <vector>

#include "boundary/meshes/crossing_faces.h"
#include "boundary/meshes/trees/box_pairs.h"
#include "python/call.h"
#include "python/numpy_arrays.h"
#include "scene/corners/corner_tangents.h"
#include "scene/corners/shading_normals.h"
#include "util/parallel.h"

namespace nb = nanobind;
using namespace nb::literals;

namespace edgegrad {

namespace {

void check_faces(const InputArray<int32_t>& faces, size_t vertices) {
    for (size_t k = 0; k < faces.size(); ++k)
        if (faces.data()[k] < 0 || static_cast<size_t>(faces.data()[k]) >= vertices)
            throw std::invalid_argument("the array 'faces' names a vertex that is not there");
}

void check_smoothing(const InputArray<int32_t>& smoothing, int64_t normals) {
    for (size_t k = 0; k < smoothing.size(); ++k)
        if (smoothing.data()[k] < -1 || smoothing.data()[k] >= normals)
            throw std::invalid_argument("the array 'smoothing' names a normal that is not there");
}

// Multiplied by 2^64 divided by the golden ratio, since zero and other small keys are allowed.
size_t cell_of(uint64_t key, int log_cells) {
    return static_cast<size_t>(key * 0x9E3779B97F4A7C15u >> (64 - log_cells));
}

// The shading normals that a mesh without normals of its own gets, (count, 3). `smoothing` names the normal
// of each corner of a face, -1: none.
nb::object mesh_normals(nb::handle vertices, nb::handle faces, nb::handle smoothing, int64_t count) {
    const InputArray<double> points(vertices, "vertices", {-1, 3});
    const InputArray<int32_t> corners(faces, "faces", {-1, 3});
    const InputArray<int32_t> groups(smoothing, "smoothing", {static_cast<int64_t>(corners.shape(0)), 3});
    check_faces(corners, points.shape(0));
    check_smoothing(groups, count);
    const std::vector<double> normals = without_interpreter([&] {
        return angle_weighted_normals(points.data(), corners.data(), groups.data(), corners.shape(0),
                                      static_cast<size_t>(count));
    });
    return to_numpy(normals, {static_cast<size_t>(count), 3});
}

// Tangents and signs of the corners of a mesh, (m, 3, 4). `smoothing` as above.
nb::object mesh_tangents(nb::handle vertices, nb::handle faces, nb::handle uv, nb::handle smoothing,
                         nb::handle normals, bool around, int threads) {
    const InputArray<float> points(vertices, "vertices", {-1, 3});
    const InputArray<int32_t> corners(faces, "faces", {-1, 3});
    const int64_t count = static_cast<int64_t>(corners.shape(0));
    const InputArray<float> mapped(uv, "uv", {count, 3, 2});
    const InputArray<int32_t> groups(smoothing, "smoothing", {count, 3});
    const InputArray<float> smooth(normals, "normals", {-1, 3});
    check_faces(corners, points.shape(0));
    check_smoothing(groups, static_cast<int64_t>(smooth.shape(0)));
    if (corners.size() > static_cast<size_t>(std::numeric_limits<int32_t>::max()))
        throw std::invalid_argument("the array 'faces' is too long");
    const OutputArray<float> tangents({corners.shape(0), 3, 4});
    without_interpreter([&] {
        corner_tangents({points.data(), corners.data(), mapped.data(), groups.data(), smooth.data(),
                         points.shape(0), corners.shape(0), around},
                        thread_count(threads), tangents.data());
    });
    return tangents.array();
}

// The pairs of faces of one mesh that share a line, (n, 2).
nb::object crossing_face_pairs(nb::handle vertices, nb::handle faces, int threads) {
    const InputArray<double> points(vertices, "vertices", {-1, 3});
    const InputArray<int32_t> corners(faces, "faces", {-1, 3});
    check_faces(corners, points.shape(0));
    const std::vector<BoxPair> pairs = without_interpreter([&] {
        return crossing_faces(points.data(), corners.data(), corners.shape(0), thread_count(threads));
    });
    std::vector<int64_t> flat;
    flat.reserve(2 * pairs.size());
    for (const BoxPair& pair : pairs)
        for (const size_t face : pair) flat.push_back(static_cast<int64_t>(face));
    return to_numpy(flat, {pairs.size(), 2});
}

// Numbers equal keys equally, from 0 in the order of their first appearance. Returns the number of each key,
// (n,), and the index of the first key of each number. The keys are hashes: their bits are random.
//
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
            size_t at = cell_of(key, log_slots);
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

// The indices of the keys that another one equals, in any order. Zeros are no keys.
//
// Two bits for each of 8 to 16 cells per key stay in the cache: whether one key is in the cell, and whether
// another one is. Only the few keys of cells with several are sorted.
nb::object repeated_keys(nb::handle keys) {
    const InputArray<uint64_t> given(keys, "keys", {-1});
    const size_t n = given.size();
    std::vector<int64_t> repeated;
    {
        const WithoutInterpreter without;
        const int log_cells = std::bit_width(8 * n + 64);
        std::vector<uint64_t> one(size_t{1} << (log_cells - 6)), several(one.size());
        for (size_t k = 0; k < n; ++k) {
            const size_t cell = cell_of(given.data()[k], log_cells);
            const uint64_t bit = uint64_t{1} << (cell % 64);
            several[cell / 64] |= one[cell / 64] & bit;
            one[cell / 64] |= bit;
        }
        std::vector<std::pair<uint64_t, int64_t>> few;
        for (size_t k = 0; k < n; ++k) {
            const size_t cell = cell_of(given.data()[k], log_cells);
            if (given.data()[k] != 0 && (several[cell / 64] >> (cell % 64) & 1) != 0)
                few.emplace_back(given.data()[k], static_cast<int64_t>(k));
        }
        std::sort(few.begin(), few.end());
        const auto equal = [&](size_t a, size_t b) { return b < few.size() && few[a].first == few[b].first; };
        for (size_t k = 0; k < few.size(); ++k)
            if (equal(k, k + 1) || equal(k, k - 1)) repeated.push_back(few[k].second);
    }
    return to_numpy(repeated, {repeated.size()});
}

// For each box, how many others overlap it, at most `most` + 1, and the pairs (box, other) of those with at
// most `most`, sorted.
nb::tuple overlapping_boxes(nb::handle lows, nb::handle highs, int64_t most) {
    const InputArray<float> low(lows, "low", {-1, 3}), high(highs, "high", {-1, 3});
    if (low.size() != high.size()) throw std::invalid_argument("there must be as many 'low' as 'high'");
    std::vector<Box> boxes(low.size() / 3);
    const OutputArray<int64_t> counts({boxes.size()});
    std::vector<int64_t> pairs;
    {
        const WithoutInterpreter without;
        for (size_t k = 0; k < boxes.size(); ++k)
            boxes[k].add(low.data() + 3 * k), boxes[k].add(high.data() + 3 * k);
        const BoxPairs tree(boxes);
        std::vector<size_t> others;
        for (size_t k = 0; k < boxes.size(); ++k) {
            others.clear();
            tree.visit_while(boxes[k], [&](size_t other) {
                if (other != k) others.push_back(other);
                return static_cast<int64_t>(others.size()) <= most;
            });
            counts.data()[k] = static_cast<int64_t>(others.size());
            if (counts.data()[k] > most) continue;
            std::sort(others.begin(), others.end());
            for (const size_t other : others)
                pairs.push_back(static_cast<int64_t>(k)), pairs.push_back(static_cast<int64_t>(other));
        }
    }
    return nb::make_tuple(counts.array(), to_numpy(pairs, {pairs.size() / 2, 2}));
}

}  // namespace

void bind_mesh_arrays(nb::module_& m) {
    m.def("angle_weighted_normals", &mesh_normals, "vertices"_a, "faces"_a, "smoothing"_a, "count"_a,
          "Shading normals of a mesh that has none of its own (native/python/mesh_arrays.cpp).");
    m.def("corner_tangents", &mesh_tangents, "vertices"_a, "faces"_a, "uv"_a, "smoothing"_a, "normals"_a,
          "around"_a, "threads"_a,
          "Tangents of a mesh's corners for normal maps (native/python/mesh_arrays.cpp).");
    m.def("number_equal_keys", &number_equal_keys, "keys"_a,
          "Equal numbers for equal keys (native/python/mesh_arrays.cpp).");
    m.def("repeated_keys", &repeated_keys, "keys"_a,
          "Which keys are there twice (native/python/mesh_arrays.cpp).");
    m.def("overlapping_boxes", &overlapping_boxes, "low"_a, "high"_a, "most"_a,
          "Which boxes overlap few others, and which (native/python/mesh_arrays.cpp).");
    m.def("crossing_face_pairs", &crossing_face_pairs, "vertices"_a, "faces"_a, "threads"_a,
          "Pairs of faces of one mesh that pass through each other (native/python/mesh_arrays.cpp).");
}

}  // namespace edgegrad
