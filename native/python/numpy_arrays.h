// Arrays and strings between Python and C++, by Python's buffer protocol.
//
// nanobind's own converters of arrays, strings and vectors allocate memory in functions that may not throw,
// so that running out of memory ends the process. Here every failure is an exception: a MemoryError if memory
// runs out, else a ValueError.
#pragma once

#include <nanobind/nanobind.h>

#include <cstdint>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

#include "util/zeroed_memory.h"

namespace edgegrad {

// Type of an array's elements: 'f' floats, 'i' and 'u' integers, and their size in bytes.
struct ElementType {
    char kind;
    size_t bytes;
    template <typename T>
    static constexpr ElementType of() {
        return {std::is_floating_point_v<T> ? 'f' : std::is_signed_v<T> ? 'i' : 'u', sizeof(T)};
    }
};

// The memory of a C-contiguous array. It stays in place while this exists.
class ArrayMemory {
 public:
    // `name` is the array's name in messages.
    ArrayMemory(nanobind::handle array, const char* name, ElementType type, bool writable);
    ~ArrayMemory();
    ArrayMemory(const ArrayMemory&) = delete;
    ArrayMemory& operator=(const ArrayMemory&) = delete;

    void* data() const { return view_.buf; }
    size_t bytes() const { return static_cast<size_t>(view_.len); }
    int dimensions() const { return view_.ndim; }
    size_t shape(int axis) const { return static_cast<size_t>(view_.shape[axis]); }

 private:
    Py_buffer view_;
};

// An array to read from. Its elements must be exactly of type T.
template <typename T>
class InputArray {
 public:
    InputArray(nanobind::handle array, const char* name)
        : memory_(array, name, ElementType::of<T>(), false) {}
    // Also requires the given sizes; -1: any.
    InputArray(nanobind::handle array, const char* name, std::initializer_list<int64_t> shape)
        : InputArray(array, name) {
        bool fits = memory_.dimensions() == static_cast<int>(shape.size());
        int axis = 0;
        for (const int64_t size : shape) {
            fits = fits && (size < 0 || this->shape(axis) == static_cast<size_t>(size));
            ++axis;
        }
        if (!fits) throw std::invalid_argument(std::string("the array '") + name + "' has the wrong shape");
    }
    const T* data() const { return static_cast<const T*>(memory_.data()); }
    size_t size() const { return memory_.bytes() / sizeof(T); }
    size_t shape(int axis) const { return memory_.shape(axis); }
    std::vector<T> copy() const { return std::vector<T>(data(), data() + size()); }

 private:
    ArrayMemory memory_;
};

// A new array in Python's own memory to write results to, by numpy.empty or numpy.zeros.
enum class NewArray { kEmpty, kZeros };
nanobind::object new_array(NewArray kind, ElementType type, const std::vector<size_t>& shape);

template <typename T>
class OutputArray {
 public:
    explicit OutputArray(const std::vector<size_t>& shape, NewArray kind = NewArray::kEmpty)
        : array_(new_array(kind, ElementType::of<T>(), shape)),
          memory_(array_, "result", ElementType::of<T>(), true) {}
    T* data() const { return static_cast<T*>(memory_.data()); }
    size_t size() const { return memory_.bytes() / sizeof(T); }
    const nanobind::object& array() const { return array_; }

 private:
    nanobind::object array_;
    ArrayMemory memory_;
};

template <typename T>
nanobind::object to_numpy(const std::vector<T>& values, const std::vector<size_t>& shape) {
    const OutputArray<T> out(shape);
    if (out.size() != values.size()) throw std::logic_error("a result has another size than its shape");
    std::copy(values.begin(), values.end(), out.data());
    return out.array();
}

// Rows of so many columns; a flat array of one.
template <typename T>
nanobind::object rows_to_numpy(const std::vector<T>& values, size_t columns) {
    const size_t rows = values.size() / columns;
    return columns == 1 ? to_numpy(values, {rows}) : to_numpy(values, {rows, columns});
}

// A Python list of numbers or C strings.
template <typename Values>
nanobind::list to_list(const Values& values) {
    nanobind::list out;
    for (const auto& value : values) out.append(value);
    return out;
}

// An array of values that are mostly untouched zeros, which take no memory in the array either: a copy, or
// for large arrays their own memory.
nanobind::object zeros_to_numpy(Zeros&& values);
// Adds the type that owns such memory to the module.
void bind_zeros(nanobind::module_& module);

// Converts a Python string.
std::string text(nanobind::handle string);

// Reads a field of a Python object as a flat vector of T. The array's elements must be exactly of type S.
template <typename S, typename T = S>
std::vector<T> column(nanobind::handle object, const char* name) {
    const InputArray<S> array(object.attr(name), name);
    return std::vector<T>(array.data(), array.data() + array.size());
}

}  // namespace edgegrad
