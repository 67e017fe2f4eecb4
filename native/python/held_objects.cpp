// The quick part of core/rendering/taken_over.py. A scene may have hundreds of thousands of objects, and a
// call must know that none has changed. Python takes microseconds for each of them; here an object costs
// little more than one read of its memory.
//
// An object is touched if one of its fields refers to another value, if a compared entry of an array has
// other bytes, or if the same holds for a dict among its values. Python then compares the object itself, and
// decides.

#include "python/held_objects.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <vector>

namespace nb = nanobind;
using nb::literals::operator""_a;

namespace edgegrad {
namespace {

// Mixes bytes into a fingerprint. Two arrays that differ in one word never have the same one.
uint64_t mixed(uint64_t sum, const char* at, size_t size) {
    while (size > 0) {
        const size_t bytes = std::min<size_t>(size, 8);
        uint64_t word = 0;
        std::memcpy(&word, at, bytes);
        sum = (sum ^ word) * 0xff51afd7ed558ccdull;
        sum ^= sum >> 32;
        at += bytes;
        size -= bytes;
    }
    return sum;
}

// Evenly spaced entries of a C-contiguous array, which the list of values keeps alive.
struct Entries {
    const char* first;
    uint64_t step;  // bytes
    uint32_t count, bytes;
    uint64_t fingerprint;

    uint64_t read() const {
        uint64_t sum = 0;
        if (step == bytes) return mixed(sum, first, static_cast<size_t>(step) * count);
        for (uint32_t k = 0; k < count; ++k) sum = mixed(sum, first + k * step, bytes);
        return sum;
    }
};

class HeldObjects {
 public:
    HeldObjects(nb::handle array_type, size_t samples)
        : array_type_(nb::borrow(array_type)), samples_(samples) {}

    void hold(size_t k, nb::handle fields) {
        if (k > objects_.size()) throw std::out_of_range("there is no such object");
        if (k == objects_.size()) objects_.emplace_back();
        Object found{dicts_.size(), 0, entries_.size(), 0, true};
        note(nb::borrow(fields), found);
        found.last_dict = dicts_.size();
        found.last_entries = entries_.size();
        objects_[k] = found;
    }

    nb::list touched() const {
        nb::list out;
        for (size_t k = 0; k < objects_.size(); ++k)
            if (!is_untouched(objects_[k])) out.append(k);
        return out;
    }

 private:
    // Its first dict has its fields. `known`: false if a value cannot be watched.
    struct Object {
        size_t first_dict, last_dict, first_entries, last_entries;
        bool known;
    };
    struct Dict {
        nb::object dict;
        size_t first_item, last_item;
    };
    struct Item {
        nb::object key, value;
    };

    void note(const nb::object& dict, Object& object) {
        if (!PyDict_Check(dict.ptr())) {
            object.known = false;
            return;
        }
        Py_ssize_t at = 0;
        PyObject *key, *value;
        const size_t first = items_.size();
        while (PyDict_Next(dict.ptr(), &at, &key, &value))
            items_.push_back({nb::borrow(key), nb::borrow(value)});
        const size_t last = items_.size();
        dicts_.push_back({dict, first, last});
        for (size_t k = first; k < last; ++k) {
            const nb::object held = items_[k].value;
            if (nb::isinstance(held, array_type_))
                note_array(held, object);
            else if (nb::hasattr(held, "items"))
                note(held, object);
        }
    }

    void note_array(const nb::object& array, Object& object) {
        Py_buffer view;
        if (PyObject_GetBuffer(array.ptr(), &view, PyBUF_C_CONTIGUOUS) != 0) {
            PyErr_Clear();  // not contiguous, or of a type without a buffer
            object.known = false;
            return;
        }
        const size_t bytes = static_cast<size_t>(view.itemsize);
        const size_t size = bytes ? static_cast<size_t>(view.len) / bytes : 0;
        const size_t step = std::max<size_t>(1, size / samples_);
        Entries entries{static_cast<const char*>(view.buf), step * bytes,
                        static_cast<uint32_t>((size + step - 1) / step), static_cast<uint32_t>(bytes), 0};
        PyBuffer_Release(&view);
        entries.fingerprint = entries.read();
        entries_.push_back(entries);
    }

    bool is_untouched(const Object& object) const {
        if (!object.known) return false;
        for (size_t d = object.first_dict; d < object.last_dict; ++d)
            if (!is_untouched(dicts_[d])) return false;
        for (size_t k = object.first_entries; k < object.last_entries; ++k)
            if (entries_[k].read() != entries_[k].fingerprint) return false;
        return true;
    }

    bool is_untouched(const Dict& held) const {
        Py_ssize_t at = 0;
        PyObject *key, *value;
        size_t k = held.first_item;
        while (PyDict_Next(held.dict.ptr(), &at, &key, &value)) {
            if (k == held.last_item || items_[k].key.ptr() != key || items_[k].value.ptr() != value)
                return false;
            ++k;
        }
        return k == held.last_item;
    }

    nb::object array_type_;
    size_t samples_;
    std::vector<Object> objects_;
    std::vector<Dict> dicts_;  // an object that is held anew leaves its earlier ones unused
    std::vector<Item> items_;
    std::vector<Entries> entries_;
};

}  // namespace

void bind_held_objects(nb::module_& module) {
    nb::class_<HeldObjects>(module, "HeldObjects",
                            "Objects that are watched for changes; see edgegrad.rendering.taken_over.")
        .def(nb::init<nb::handle, size_t>(), "array_type"_a, "samples"_a,
             "`samples`: about how many entries of an array are compared.")
        .def("hold", &HeldObjects::hold, "k"_a, "fields"_a,
             "Looks at object k, a new one or one that is held, by the dict of its fields.")
        .def("touched", &HeldObjects::touched, "Objects that may have changed since they were looked at.");
}

}  // namespace edgegrad
