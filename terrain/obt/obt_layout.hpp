// SPDX-License-Identifier: Apache-2.0
// Layout of a giant texture file (.obt): places of header fields, tiles, directory blocks and their entries.
//
// All numbers are little endian. Bytes 0 to 4095 are the header, the next 12,288 hold the same as TOML for
// people, padded with zeros. Then the tiles: coarsest level first, within a level in Morton order (column
// bits in the even places) of the tiles that exist, the planes of a tile one after the other, each in a slot
// of stored_tile_edge x stored_tile_edge samples, rounded up to 4096 bytes. Tiles without samples leave
// holes. Then the blocks of the directory, and last the tiles of a lattice that hold f32.
#pragma once

#include "terrain/obt/obt_metadata.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace obscura::terrain::obt {

inline constexpr std::string_view magic = "OBSTEX\r\n";
inline constexpr std::uint32_t version = 1;
inline constexpr std::size_t header_bytes = 4096, toml_bytes = 12288;
inline constexpr std::uint64_t data_start = header_bytes + toml_bytes;
/// Samples along a tile, those of the margin on each side, and both.
inline constexpr int tile_samples = 256, margin = 2, stored_tile_edge = tile_samples + 2 * margin;
inline constexpr std::size_t tile_count = std::size_t{stored_tile_edge} * stored_tile_edge;
inline constexpr std::uint64_t page = 4096;
inline constexpr std::uint64_t low_48 = (std::uint64_t{1} << 48) - 1;
/// No file is larger.
inline constexpr std::uint64_t max_bytes = std::uint64_t{1} << 60;

/// Integer or float at `at`.
template<typename Number>
[[nodiscard]] Number get(const std::byte* at) noexcept {
    std::array<std::byte, sizeof(Number)> bytes;
    std::memcpy(bytes.data(), at, sizeof(Number));
    if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
    return std::bit_cast<Number>(bytes);
}
template<typename Number>
void put(std::byte* at, Number number) noexcept {
    auto bytes = std::bit_cast<std::array<std::byte, sizeof(Number)>>(number);
    if constexpr (std::endian::native == std::endian::big) std::reverse(bytes.begin(), bytes.end());
    std::memcpy(at, bytes.data(), sizeof(Number));
}

/// Tile (i, j) of a level and plane: i along the rows, j down.
struct TileName {
    std::uint32_t plane = 0;
    int level = 0;
    std::int64_t i = 0, j = 0;
    auto operator<=>(const TileName&) const = default;
};
/// "tile (3, 7) of level 2, plane 0".
[[nodiscard]] std::string to_string(const TileName& tile);

enum class Stored : std::uint8_t {
    absent = 0,   ///< values are those of the coarser level
    samples = 1,  ///< of the type of the file
    wide = 2,     ///< f32 in a file with lattices
    constant = 3, ///< no slot: all samples are `base` (f16, f32: its bits as f32; lattice: times the step)
    missing = 4,  ///< no slot: no sample has data
};

/// Entry of the directory, 24 bytes:
///    0 u48 place of the slot, in units of 4096 bytes
///    6 u8  Stored; bit 7: some samples are missing
///    7 i8  exponent of the step: 2^exponent (0 for u8, i16 and u16 without lattice)
///    8 i32 base: a sample of a lattice is (base + code) * step
///   12 u16, 14 u16 bounds of all finest samples below the tile: numbers (base + least) * step and
///                  (base + largest) * step
///   16 f32 largest difference of finest samples from this tile interpolated, in numbers: not less
///   20 u32 CRC-32C of bytes 0 to 19 and of the samples
struct Entry {
    std::uint64_t slot = 0;
    Stored stored = Stored::absent;
    bool holes = false;
    std::int8_t exponent = 0;
    std::int32_t base = 0;
    std::uint16_t least = 0, largest = 0;
    float error = 0;
    std::uint32_t crc = 0;

    [[nodiscard]] bool has_slot() const { return stored == Stored::samples || stored == Stored::wide; }
    [[nodiscard]] double step() const;
    /// Bounds of the numbers of finest samples.
    [[nodiscard]] double min_number() const { return (static_cast<double>(base) + least) * step(); }
    [[nodiscard]] double largest_number() const { return (static_cast<double>(base) + largest) * step(); }
};
inline constexpr std::size_t entry_bytes = 24, entry_crc = 20;
using EntryBytes = std::array<std::byte, entry_bytes>;
[[nodiscard]] EntryBytes bytes_of(const Entry& entry);
/// Nothing if the fields are not those of an entry.
[[nodiscard]] std::optional<Entry> entry_of(const std::byte* at);
/// Lattice code of missing samples in tiles with holes; codes of others are below.
inline constexpr std::uint16_t lattice_nodata = 65535;

/// Directory block, 32 KiB: the entries of a subtree of 5 levels of the quadtree of a plane (1 + 4 + ... +
/// 256, coarsest first, row by row), then 1024 pointers to the blocks below (row by row): u48 place in units
/// of 4096 bytes, 0: none, u16 0, u32 CRC-32C of that block, 12 bytes 0; then u64: bits 0 to 29 column, 30 to
/// 59 row, 60 to 63 1 + group of the block itself. The root of the quadtree is the one tile of the coarsest
/// level.
inline constexpr int block_levels = 5;
inline constexpr std::size_t block_tiles = 341, block_pointers = 1024, block_bytes = 32768;
inline constexpr std::size_t block_name = block_bytes - 8, pointer_crc = 8;
/// Block that holds a tile's entry, and where in it.
struct BlockName {
    std::uint32_t plane = 0;
    int group = 0;
    std::uint32_t i = 0, j = 0;
    auto operator<=>(const BlockName&) const = default;
    [[nodiscard]] BlockName parent() const {
        return {plane, group - 1, i >> block_levels, j >> block_levels};
    }
    /// Where the pointer to this block is in its parent.
    [[nodiscard]] std::size_t place_in_parent() const {
        return (block_tiles + (j & 31U) * 32 + (i & 31U)) * entry_bytes;
    }
    [[nodiscard]] std::uint64_t number() const {
        return i | std::uint64_t{j} << 30 | static_cast<std::uint64_t>(group + 1) << 60;
    }
};

/// Sizes of levels and places of tiles and blocks.
class Layout {
public:
    Layout() = default;
    /// For sizes that validate() allows; throws InputError if the file were larger than max_bytes.
    Layout(const ObtMetadata& metadata, const std::string& name);

    [[nodiscard]] int levels() const { return levels_; }
    [[nodiscard]] std::int64_t width(int level) const { return shrunk(width_, level); }
    [[nodiscard]] std::int64_t height(int level) const { return shrunk(height_, level); }
    [[nodiscard]] std::int64_t tiles_across(int level) const { return tiles(width(level)); }
    [[nodiscard]] std::int64_t tiles_down(int level) const { return tiles(height(level)); }
    [[nodiscard]] bool has(const TileName& tile) const;
    [[nodiscard]] std::uint64_t slot_bytes() const { return slot_bytes_; }
    /// Byte at which the slot of the tile begins.
    [[nodiscard]] std::uint64_t slot_place(const TileName& tile) const;
    [[nodiscard]] BlockName block_of(const TileName& tile) const;
    /// Byte of the tile's entry in its block.
    [[nodiscard]] std::size_t place_in_block(const TileName& tile) const;
    [[nodiscard]] std::uint64_t block_place(const BlockName& block) const;
    /// First byte after the blocks: of f32 tiles of a lattice.
    [[nodiscard]] std::uint64_t wide_start() const { return wide_start_; }

    /// Cells (x, y) of the rectangle before (i, j) in Morton order.
    [[nodiscard]] static std::uint64_t morton_rank(std::int64_t i, std::int64_t j, std::int64_t across,
                                                   std::int64_t down);

private:
    static std::int64_t shrunk(std::int64_t size, int level) { return ((size - 1) >> level) + 1; }
    static std::int64_t tiles(std::int64_t size) { return (size + tile_samples - 1) / tile_samples; }

    int levels_ = 1;
    std::int64_t width_ = 1, height_ = 1;
    std::uint32_t planes_ = 1;
    std::uint64_t slot_bytes_ = 0, directory_start_ = 0, wide_start_ = 0;
    std::array<std::uint64_t, 48> level_start_{}; ///< tiles of all planes before each level
    std::array<std::uint64_t, 8> group_start_{};  ///< blocks of all planes before each group
};

/// What a header holds besides the description.
struct HeaderPlaces {
    bool complete = false; ///< false: a build that goes on
    std::uint64_t file_bytes = 0, shard_bytes = 0;
    struct Root {
        std::uint64_t place = 0; ///< 0: the plane has no tile
        std::uint32_t crc = 0;
    };
    std::vector<Root> roots; ///< of the planes
};
/// The header and the TOML text, data_start bytes.
[[nodiscard]] std::vector<std::byte> header_of(const ObtMetadata& metadata, const HeaderPlaces& places);
/// Reads and checks both. Throws InputError `name: ...`.
void read_header(std::span<const std::byte> header, const std::string& name, ObtMetadata& metadata,
                 HeaderPlaces& places);

} // namespace obscura::terrain::obt
