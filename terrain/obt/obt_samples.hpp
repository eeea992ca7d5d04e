// SPDX-License-Identifier: Apache-2.0
// Samples of a tile of a giant texture (.obt): numbers to bytes and back.
#pragma once

#include "terrain/obt/obt_layout.hpp"

#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace obscura::terrain::obt {

/// Range of the finest samples below a tile and the tile's distance from them, in numbers.
struct TileFacts {
    double least = std::numeric_limits<double>::infinity();
    double largest = -std::numeric_limits<double>::infinity();
    double error = 0;

    /// Whether there are samples at all.
    [[nodiscard]] bool any() const { return least <= largest; }
    void add(const TileFacts& other);
};

struct EncodedTile {
    Entry entry; ///< without slot and CRC
    std::vector<std::byte> bytes;
    /// Range of the finest samples as they are stored.
    double least = 0, largest = 0;
};

/// Encodes tile_count numbers (NaN: missing). Throws InputError `name: ...` if a sample cannot be stored.
void encode(const ObtMetadata& metadata, const TileName& tile, std::span<const float> numbers,
            const TileFacts& facts, const std::string& name, EncodedTile& out);

/// CRC of an entry and its samples.
[[nodiscard]] std::uint32_t crc_of(const Entry& entry, std::span<const std::byte> samples);

/// Bytes of the samples of a tile with a slot.
[[nodiscard]] std::size_t sample_bytes(const ObtMetadata& metadata, const Entry& entry);

/// Decodes `count` samples from number `first` (row-major) on, as numbers or as values; those of constant
/// and missing tiles as well (`samples` is not used then). Not for absent tiles. Real-time safe.
void decode_numbers(const ObtMetadata& metadata, const Entry& entry, const std::byte* samples,
                    std::size_t first, std::size_t count, float* out) noexcept;
void decode_values(const ObtMetadata& metadata, const Entry& entry, const std::byte* samples,
                   std::size_t first, std::size_t count, float* out) noexcept;

/// Bounds of the finest samples below a tile, in numbers.
[[nodiscard]] TileFacts facts_of(const ObtMetadata& metadata, const Entry& entry);

} // namespace obscura::terrain::obt
