#include "python/numpy_arrays.h"

#include <algorithm>
#include <bit>

namespace nb = nanobind;

namespace edgegrad {
namespace {

// Kind of a format of Python's `struct` module with the byte order of this machine; 0: unsupported.
char kind_of(const char* format) {
    if (!format) return 'u';
    constexpr bool little = std::endian::native == std::endian::little;
    if (*format == '@' || *format == '=' || *format == (little ? '<' : '>')) ++format;
    if (*format == '\0' || format[1] != '\0') return '\0';
    if (std::strchr("fd", *format)) return 'f';
    if (std::strchr("bhilqn", *format)) return 'i';
    if (std::strchr("BHILQN", *format)) return 'u';
    return '\0';
}

struct OwnedZeros {
    Zeros values;
};

int zeros_buffer(PyObject* self, Py_buffer* view, int flags) {
    Zeros& values = nb::inst_ptr<OwnedZeros>(self)->values;
    return PyBuffer_FillInfo(view, self, values.data(),
                             static_cast<Py_ssize_t>(values.size() * sizeof(double)), 0, flags);
}

}  // namespace

void bind_zeros(nb::module_& module) {
    static PyType_Slot slots[] = {{Py_bf_getbuffer, reinterpret_cast<void*>(zeros_buffer)}, {0, nullptr}};
    nb::class_<OwnedZeros>(module, "OwnedZeros", nb::type_slots(slots), "Memory of a large gradient.");
}

ArrayMemory::ArrayMemory(nb::handle array, const char* name, ElementType type, bool writable) {
    const int flags = PyBUF_FORMAT | PyBUF_C_CONTIGUOUS | (writable ? PyBUF_WRITABLE : 0);
    const auto wrong = [name] {
        return std::invalid_argument(std::string("the table '") + name + "' has the wrong type or layout");
    };
    if (PyObject_GetBuffer(array.ptr(), &view_, flags) != 0) {
        if (!PyErr_ExceptionMatches(PyExc_BufferError) && !PyErr_ExceptionMatches(PyExc_TypeError) &&
            !PyErr_ExceptionMatches(PyExc_ValueError))
            throw nb::python_error();
        PyErr_Clear();
        throw wrong();
    }
    if (kind_of(view_.format) != type.kind || static_cast<size_t>(view_.itemsize) != type.bytes) {
        PyBuffer_Release(&view_);
        throw wrong();
    }
}

ArrayMemory::~ArrayMemory() { PyBuffer_Release(&view_); }

nb::object new_array(NewArray kind, ElementType type, const std::vector<size_t>& shape) {
    const std::string dtype = type.kind + std::to_string(type.bytes);
    nb::list sizes;
    for (const size_t size : shape) sizes.append(size);
    const char* const function = kind == NewArray::kZeros ? "zeros" : "empty";
    return nb::module_::import_("numpy").attr(function)(sizes, dtype.c_str());
}

nb::object zeros_to_numpy(Zeros&& values) {
    constexpr size_t kPage = 1 << 9;  // the operating system provides memory by pages
    constexpr size_t kLarge = 1 << 22;
    if (values.size() >= kLarge)
        return nb::module_::import_("numpy").attr("frombuffer")(nb::cast(OwnedZeros{std::move(values)}),
                                                                "float64");
    const OutputArray<double> out({values.size()}, NewArray::kZeros);
    for (size_t at = 0; at < values.size(); at += kPage) {
        const double* const first = values.data() + at;
        const double* const last = values.data() + std::min(at + kPage, values.size());
        if (std::any_of(first, last, [](double x) { return x != 0.0; }))
            std::copy(first, last, out.data() + at);
    }
    return out.array();
}

std::string text(nb::handle string) {
    Py_ssize_t size = 0;
    const char* const letters = PyUnicode_AsUTF8AndSize(string.ptr(), &size);
    if (!letters) throw nb::python_error();
    return std::string(letters, static_cast<size_t>(size));
}

}  // namespace edgegrad
