// One block of memory for many arrays, laid out by counting: what names the arrays runs twice, first to add
// up their sizes, then to place them.
//
// Debug builds, and those that define EDGEGRAD_GUARD_ZONES, leave a zone of known bytes behind each array, so
// that check() finds a write beyond one that would otherwise land in its neighbour unseen.
#pragma once

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

namespace edgegrad {

class ScratchBlock {
 public:
#if defined(NDEBUG) && !defined(EDGEGRAD_GUARD_ZONES)
    static constexpr size_t kGuard = 0;
#else
    static constexpr size_t kGuard = 256;
#endif
    bool empty() const { return lines_.empty(); }

    // arrays(take): calls take(count, p...) with pointers, or arrays of pointers, each of which gets `count`
    // elements of its own: zeros, at a multiple of 64 bytes.
    template <typename Arrays>
    void lay_out(const Arrays& arrays) {
        size_t bytes = 0;
        arrays([&](size_t count, auto&... p) { (each(p, [&](auto*& a) { bytes += room(count, a); }), ...); });
        lines_.assign(bytes / sizeof(Line), Line{});
        zones_.clear();
        std::byte* next = lines_.data()->bytes;
        const auto place = [&](size_t count, auto*& a) {
            a = reinterpret_cast<std::remove_reference_t<decltype(a)>>(next);
            std::byte* const end = next + count * sizeof *a;
            next += room(count, a);
            if (kGuard == 0) return;
            zones_.push_back({end, next});
            std::memset(end, kPattern, static_cast<size_t>(next - end));
        };
        arrays([&](size_t count, auto&... p) { (each(p, [&](auto*& a) { place(count, a); }), ...); });
    }

    // Throws std::logic_error if something was written behind an array.
    void check() const {
        for (size_t k = 0; k < zones_.size(); ++k)
            for (const std::byte* b = zones_[k].first; b < zones_[k].last; ++b)
                if (*b != std::byte{kPattern})
                    throw std::logic_error("array " + std::to_string(k) +
                                           " of a workspace was written beyond its end");
    }

 private:
    struct alignas(64) Line {
        std::byte bytes[64];
    };
    struct Zone {
        std::byte *first, *last;
    };
    static constexpr unsigned char kPattern = 0xa5;

    template <typename T>
    static size_t room(size_t count, T*) {
        const size_t bytes = count * sizeof(T) + kGuard;
        return (bytes + sizeof(Line) - 1) / sizeof(Line) * sizeof(Line);
    }
    template <typename T, typename F>
    static void each(T*& pointer, const F& run) {
        run(pointer);
    }
    template <typename T, size_t N, typename F>
    static void each(T (&pointers)[N], const F& run) {
        for (T& p : pointers) each(p, run);
    }

    std::vector<Line> lines_;
    std::vector<Zone> zones_;  // empty in release builds
};

}  // namespace edgegrad
