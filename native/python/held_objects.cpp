// Which of very many Python objects have not been touched since they were last looked at: the quick part of
// core/rendering/taken_over.py. A scene may have hundreds of thousands of objects, and a call must know that
// none has changed. Python takes microseconds for each of them; here an object costs little more than one
// read of its memory.
//
// An object is touched if one of its fields refers to another value, if a compared entry of an array has
// other bytes, or if the same holds for a dict among its values. Python then compares the object itself, and
// decides.

#include "python/bindings.h"

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <stdexcept>
#include <utility>
#include <vector>

#include "python/numpy_arrays.h"
#include "util/fingerprint.h"

namespace nb = nanobind;
using nb::literals::operator""_a;

namespace edgegrad {
namespace {

// Evenly spaced entries of a C-contiguous array, which the list of values keeps alive.
struct Entries {
    const char* first;
    uint64_t step;  // bytes
    uint32_t count, bytes;
    uint64_t fingerprint;

    uint64_t read() const {
        if (step == bytes) return fingerprint_of(first, static_cast<size_t>(step) * count, kFirstKey);
        uint64_t sum = 0, key = kFirstKey;
        for (uint32_t k = 0; k < count; ++k, key += kNextKey)
            sum += fingerprint_of(first + k * step, bytes, key);
        return sum;
    }
};

// A number that changes whenever the dict does (PEP 509), so that its items need not be read; 0: not known,
// as in later Pythons and in the stable ABI.
uint64_t version_of([[maybe_unused]] const nb::object& dict) {
#if !defined(Py_LIMITED_API) && PY_VERSION_HEX < 0x030C0000
    return reinterpret_cast<const PyDictObject*>(dict.ptr())->ma_version_tag;
#else
    return 0;
#endif
}

// What has been noted of objects. Lists of all objects together are read faster than a list for each.
struct Notes {
    // A dict: the fields of an object, or a dict among its values.
    struct Dict {
        nb::object dict;
        size_t items;
        uint64_t version;

        bool is_certainly_unchanged() const { return version && version == version_of(dict); }
    };
    struct Item {
        nb::object key, value;
    };
    std::vector<Dict> dicts;
    std::vector<Item> items;
    std::vector<Entries> entries;
};

// The part of the notes that is about one object. `known`: false if one of its values cannot be watched.
struct Part {
    size_t dict, item, entry;  // the first of each
    size_t dicts, items, entries;
    bool known;

    bool same_size(const Part& other) const {
        return dicts == other.dicts && items == other.items && entries == other.entries;
    }
};

class HeldObjects {
 public:
    HeldObjects(nb::handle array_type, size_t samples)
        : array_type_(nb::borrow(array_type)), samples_(samples) {}

    void hold(size_t k, nb::handle fields) {
        if (k > parts_.size()) throw std::out_of_range("there is no such object");
        Notes found;
        Part part{};
        part.known = note(nb::borrow(fields), found);
        part.dicts = found.dicts.size(), part.items = found.items.size(), part.entries = found.entries.size();
        if (k < parts_.size()) {
            const Part& old = parts_[k];
            if (old.same_size(part)) {
                part.dict = old.dict, part.item = old.item, part.entry = old.entry;
                put(found.dicts, notes_.dicts, part.dict);
                put(found.items, notes_.items, part.item);
                put(found.entries, notes_.entries, part.entry);
                parts_[k] = part;
                return;
            }
            // Its place stays empty, but its values are not kept.
            for (size_t i = 0; i < old.dicts; ++i) notes_.dicts[old.dict + i] = {};
            for (size_t i = 0; i < old.items; ++i) notes_.items[old.item + i] = {};
        }
        part.dict = append(found.dicts, notes_.dicts);
        part.item = append(found.items, notes_.items);
        part.entry = append(found.entries, notes_.entries);
        if (k == parts_.size())
            parts_.push_back(part);
        else
            parts_[k] = part;
    }

    nb::list touched() const {
        nb::list out;
        for (size_t k = 0; k < parts_.size(); ++k) {
            if (k + kAhead < parts_.size()) fetch(parts_[k + kAhead]);
            if (!is_untouched(parts_[k])) out.append(k);
        }
        return out;
    }

 private:
    // Objects lie anywhere in memory, and a read would wait for it: so many objects before its turn, the
    // memory of an object is asked for.
    static constexpr size_t kAhead = 12;

    // Inlined, since GCC drops calls of a function that does nothing but prefetch.
    __attribute__((always_inline)) void fetch(const Part& part) const {
        constexpr size_t kLine = 64, kMostLines = 8;
        for (size_t d = part.dict; d < part.dict + part.dicts; ++d)
            __builtin_prefetch(notes_.dicts[d].dict.ptr());
        for (size_t k = part.entry; k < part.entry + part.entries; ++k) {
            const Entries& e = notes_.entries[k];
            const size_t bytes = static_cast<size_t>(e.step) * e.count;
            const size_t stride = std::max<size_t>(kLine, static_cast<size_t>(e.step));
            for (size_t at = 0, lines = 0; at < bytes && lines < kMostLines; at += stride, ++lines)
                __builtin_prefetch(e.first + at);
        }
    }

    template <typename T>
    static void put(std::vector<T>& from, std::vector<T>& to, size_t at) {
        std::move(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(at));
    }
    template <typename T>
    static size_t append(std::vector<T>& from, std::vector<T>& to) {
        const size_t first = to.size();
        to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
        return first;
    }

    // Returns whether all values can be watched.
    bool note(const nb::object& dict, Notes& notes) const {
        if (!PyDict_Check(dict.ptr())) return false;
        const size_t first = notes.items.size();
        Py_ssize_t at = 0;
        PyObject *key, *value;
        while (PyDict_Next(dict.ptr(), &at, &key, &value))
            notes.items.push_back({nb::borrow(key), nb::borrow(value)});
        const size_t last = notes.items.size();
        notes.dicts.push_back({dict, last - first, version_of(dict)});
        bool known = true;
        for (size_t k = first; k < last; ++k) {
            const nb::object held = notes.items[k].value;  // a reference of its own: the list grows
            if (nb::isinstance(held, array_type_))
                known = note_array(held, notes) && known;
            else if (nb::hasattr(held, "items"))
                known = note(held, notes) && known;
        }
        return known;
    }

    bool note_array(const nb::object& array, Notes& notes) const {
        Py_buffer view;
        if (PyObject_GetBuffer(array.ptr(), &view, PyBUF_C_CONTIGUOUS) != 0) {
            PyErr_Clear();
            return false;  // not contiguous, or of a type without a buffer
        }
        const size_t bytes = static_cast<size_t>(view.itemsize);
        const size_t size = bytes ? static_cast<size_t>(view.len) / bytes : 0;
        const size_t step = std::max<size_t>(1, size / samples_);
        Entries entries{static_cast<const char*>(view.buf), step * bytes,
                        static_cast<uint32_t>((size + step - 1) / step), static_cast<uint32_t>(bytes), 0};
        PyBuffer_Release(&view);
        entries.fingerprint = entries.read();
        notes.entries.push_back(entries);
        return true;
    }

    bool is_untouched(const Part& part) const {
        if (!part.known) return false;
        const Notes::Item* item = notes_.items.data() + part.item;
        for (size_t d = part.dict; d < part.dict + part.dicts; ++d) {
            const Notes::Item* const end = item + notes_.dicts[d].items;
            if (notes_.dicts[d].is_certainly_unchanged()) {
                item = end;
                continue;
            }
            Py_ssize_t at = 0;
            PyObject *key, *value;
            while (PyDict_Next(notes_.dicts[d].dict.ptr(), &at, &key, &value)) {
                if (item == end || item->key.ptr() != key || item->value.ptr() != value) return false;
                ++item;
            }
            if (item != end) return false;
        }
        return std::all_of(notes_.entries.data() + part.entry,
                           notes_.entries.data() + part.entry + part.entries,
                           [](const Entries& e) { return e.read() == e.fingerprint; });
    }

    nb::object array_type_;
    size_t samples_;
    Notes notes_;
    std::vector<Part> parts_;
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
    module.def(
        "fingerprint",
        [](nb::handle array) {
            const InputArray<float> values(array, "values");
            return fingerprint_of(reinterpret_cast<const char*>(values.data()),
                                  sizeof(float) * values.size());
        },
        "values"_a, "A number that tells arrays with other bytes apart.");
}

}  // namespace edgegrad
