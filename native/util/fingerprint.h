// A number that tells bytes from others: two contents have the same one with a probability of about 2^-64.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace edgegrad {

// Random bits, so that a change of any bit of a word changes all bits of its product.
inline constexpr uint64_t kFirstKey = 0xa0761d6478bd642full, kSecondKey = 0xe7037ed1a0b428dbull;
inline constexpr uint64_t kNextKey = 0x9e3779b97f4a7c15ull;

// Returns a fingerprint. The words are multiplied in pairs, with a key for each place, and the products are
// summed: no product waits for another one, as in a chain of hashes.
inline uint64_t fingerprint_of(const char* at, size_t size, uint64_t key = kFirstKey) {
    __extension__ using Product = unsigned __int128;
    struct Pair {
        uint64_t first, second;
    };
    uint64_t sum = 0;
    const auto add = [&](size_t bytes) {
        Pair pair{};
        std::memcpy(&pair, at, bytes);
        const Product product = Product{pair.first ^ key} * (pair.second ^ kSecondKey);
        sum += static_cast<uint64_t>(product) ^ static_cast<uint64_t>(product >> 64);
        key += kNextKey;
        at += bytes;
    };
    for (; size >= sizeof(Pair); size -= sizeof(Pair)) add(sizeof(Pair));
    if (size) add(size);
    return sum;
}

}  // namespace edgegrad
