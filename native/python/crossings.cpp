#include "python/crossings.h"

#include <stdexcept>

#include "boundary/meshes/crossing_faces.h"
#include "python/call.h"
#include "python/numpy_arrays.h"
#include "util/parallel.h"

namespace nb = nanobind;

namespace edgegrad {

nb::object crossing_face_pairs(nb::handle vertices, nb::handle faces, int threads) {
    const InputArray<double> points(vertices, "vertices", {-1, 3});
    const InputArray<int32_t> corners(faces, "faces", {-1, 3});
    for (size_t k = 0; k < corners.size(); ++k)
        if (corners.data()[k] < 0 || static_cast<size_t>(corners.data()[k]) >= points.shape(0))
            throw std::invalid_argument("the array 'faces' names a vertex that is not there");
    std::vector<BoxPair> pairs;
    {
        const WithoutInterpreter without;
        pairs = crossing_faces(points.data(), corners.data(), corners.shape(0), thread_count(threads));
    }
    std::vector<int64_t> flat;
    flat.reserve(2 * pairs.size());
    for (const BoxPair& pair : pairs)
        for (const size_t face : pair) flat.push_back(static_cast<int64_t>(face));
    return to_numpy(flat, {pairs.size(), 2});
}

}  // namespace edgegrad
