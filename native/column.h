// Reads numpy arrays out of Python objects.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <stdexcept>
#include <string>
#include <vector>

namespace edgegrad {

// A field of a Python object as a flat vector of T; the array must hold exactly S.
template <typename S, typename T = S>
std::vector<T> column(nanobind::handle object, const char* name) {
    using Array = nanobind::ndarray<const S, nanobind::c_contig, nanobind::device::cpu>;
    Array array;
    if (!nanobind::try_cast<Array>(object.attr(name), array))
        throw std::invalid_argument(std::string("the table '") + name + "' has the wrong type or layout");
    return std::vector<T>(array.data(), array.data() + array.size());
}

}  // namespace edgegrad
