// SPDX-License-Identifier: Apache-2.0
// Damage to giant textures that their checksums do not show.
#pragma once

#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/obt_layout.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace obscura::test {

/// What is given the checksums that it should have.
struct Checksums {
    bool header = true, blocks = true, tiles = true;
};

/// Puts right the checksums of a file in memory with directory roots only (at most 5 levels), as far as its
/// places are inside.
inline void fix_checksums(std::string& bytes, Checksums which = {}) {
    using namespace terrain;
    constexpr std::size_t planes_at = 26, table_at = 1280, plane_bytes = 48, type_at = 21, crc_at = 4092;
    auto* const file = reinterpret_cast<std::byte*>(bytes.data());
    const auto inside = [&](std::uint64_t place, std::uint64_t size) {
        return place < bytes.size() && size <= bytes.size() - place;
    };
    if (!inside(0, obt::data_start)) return;
    const std::size_t planes = obt::get<std::uint16_t>(file + planes_at);
    for (std::size_t p = 0; p < planes && p < max_obt_planes; ++p) {
        std::byte* const root = file + table_at + p * plane_bytes;
        const auto place = obt::get<std::uint64_t>(root);
        if (place < obt::data_start || !inside(place, obt::block_bytes)) continue;
        for (std::size_t k = 0; which.tiles && k < obt::block_tiles; ++k) {
            std::byte* const at = file + place + k * obt::entry_bytes;
            const auto entry = obt::entry_of(at);
            if (!entry || entry->stored == obt::Stored::absent) continue;
            std::uint32_t crc = crc32c({at, obt::entry_crc});
            const auto type = static_cast<SampleType>(file[type_at]);
            const std::size_t size =
                obt::tile_count * (entry->stored == obt::Stored::wide ? 4 : bytes_of(type));
            if (entry->has_slot() && inside(entry->slot, size)) crc = crc32c({file + entry->slot, size}, crc);
            obt::put(at + obt::entry_crc, crc);
        }
        // Pointers to blocks, the root itself among them.
        for (std::size_t k = 0; which.blocks && k < obt::block_pointers; ++k) {
            std::byte* const at = file + place + (obt::block_tiles + k) * obt::entry_bytes;
            const std::uint64_t below =
                (obt::get<std::uint64_t>(at) & ((std::uint64_t{1} << 48) - 1)) * obt::page;
            if (below != 0 && below != place && inside(below, obt::block_bytes))
                obt::put(at + obt::pointer_crc, crc32c({file + below, obt::block_bytes}));
        }
        if (which.blocks) obt::put(root + 8, crc32c({file + place, obt::block_bytes}));
    }
    if (which.header) obt::put(file + crc_at, crc32c({file, crc_at}));
}

} // namespace obscura::test
