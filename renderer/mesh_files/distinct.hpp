// SPDX-License-Identifier: Apache-2.0
// Numbers of the distinct ones among many things, by hashing with open addressing.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <bit>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <vector>

namespace obscura::renderer {

/// Hash of a few floats; -0 is like 0.
inline std::uint64_t hash_floats(std::initializer_list<float> values) {
    std::uint64_t hash = 0;
    for (const float x : values) {
        hash = (hash ^ std::bit_cast<std::uint32_t>(x + 0.0F)) * 0x9E3779B97F4A7C15U;
        hash ^= hash >> 29;
    }
    return hash;
}

inline bool is_same(Vec3f a, Vec3f b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
}

/// Numbers `things` things, fewer than 2^32, from 0 in order of first appearance: those that are `same(i, j)`
/// and so have the same `hash(i)` have the same number. Sets `count` to the number of distinct ones. Linear
/// in time and memory.
template<typename Hash, typename Same>
std::vector<std::uint32_t> number_distinct(std::size_t things, std::uint32_t& count, const Hash& hash,
                                           const Same& same) {
    constexpr std::uint32_t none = 0xFFFFFFFF;
    std::vector<std::uint32_t> table(std::bit_ceil(2 * things + 1), none);
    std::vector<std::uint32_t> numbers(things);
    count = 0;
    for (std::size_t i = 0; i < things; ++i) {
        std::size_t slot = hash(i) & (table.size() - 1);
        while (table[slot] != none && !same(table[slot], i))
            slot = (slot + 1) & (table.size() - 1);
        if (table[slot] == none) {
            table[slot] = static_cast<std::uint32_t>(i);
            numbers[i] = count++;
        } else {
            numbers[i] = numbers[table[slot]];
        }
    }
    return numbers;
}

} // namespace obscura::renderer
