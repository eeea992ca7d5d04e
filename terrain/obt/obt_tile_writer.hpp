// SPDX-License-Identifier: Apache-2.0
// Writer of single tiles of a giant texture (.obt), in any order, under a temporary name.
#pragma once

#include "terrain/obt/obt_layout.hpp"
#include "terrain/obt/obt_metadata.hpp"
#include "terrain/obt/obt_samples.hpp"
#include "terrain/obt/obt_storage.hpp"

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace obscura::terrain {

/// Tiles that are not written are absent: readers take the coarser level. A file that is not finished stays
/// as `file`.part, for another writer of the same description to go on with. Thread-bound but for prepare().
class ObtTileWriter {
public:
    /// Opens or begins `file`.part. Throws InputError if the description is not allowed, OutputError if it
    /// cannot be written.
    ObtTileWriter(const std::filesystem::path& file, const ObtMetadata& metadata, std::uint64_t shard_bytes,
                  bool resume);

    /// Whether something of an earlier writer is there.
    [[nodiscard]] bool resumed() const { return resumed_; }
    [[nodiscard]] const obt::Layout& layout() const { return layout_; }

    /// A tile whose samples are on their way to disk, but for those of wide tiles.
    struct Prepared {
        obt::Entry entry;
        double least = 1, largest = 0; ///< of the finest samples; none: least above largest
        std::vector<std::byte> wide;   ///< samples that have no place yet
    };
    /// Encodes a tile of 260 x 260 numbers, those of the margin included, and writes its samples; `facts`
    /// with the range of the finest samples below it. `scratch` is overwritten. Thread-safe. Throws
    /// InputError, OutputError.
    [[nodiscard]] Prepared prepare(const obt::TileName& tile, std::span<const float> numbers,
                                   const obt::TileFacts& facts, obt::EncodedTile& scratch);
    /// Enters it into the directory; the order of tiles is that of wide tiles in the file.
    void commit(const obt::TileName& tile, Prepared prepared);
    /// Both.
    void write(const obt::TileName& tile, std::span<const float> numbers, const obt::TileFacts& facts) {
        commit(tile, prepare(tile, numbers, facts, encoded_));
    }
    /// The entry of a tile that is there and has its checksum. Fills `numbers` (tile_count), if not empty.
    [[nodiscard]] std::optional<obt::Entry> intact(const obt::TileName& tile, std::span<float> numbers);
    /// Keeps a tile of an earlier writer. `entry`, `numbers`: of intact().
    void keep(const obt::TileName& tile, const obt::Entry& entry, std::span<const float> numbers);
    /// Numbers of a level from the tiles written. Absent ones are missing samples.
    void read(std::uint32_t plane, int level, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out);
    /// Writes the directory as far as it is known.
    void flush();
    /// Completes the file and gives it its name. Returns the description as written.
    ObtMetadata finish();
    /// Removes what was written.
    void remove() noexcept { shards_.remove(); }

    [[nodiscard]] std::uint64_t tiles() const { return tiles_; }
    [[nodiscard]] std::uint64_t constant() const { return constant_; }
    [[nodiscard]] std::uint64_t wide() const { return wide_; }
    [[nodiscard]] std::uint64_t bytes() const { return wide_end_; }

private:
    struct Block {
        std::vector<std::byte> bytes;
        bool changed = false;
    };
    Block& block(const obt::BlockName& name);
    void put(const obt::TileName& tile, const obt::Entry& entry);
    void count(const obt::TileName& tile, const obt::Entry& entry, double least, double largest);
    std::uint32_t close_block(const obt::BlockName& name, std::vector<std::byte>* root);

    std::string name_;
    ObtMetadata metadata_;
    obt::Layout layout_;
    obt::OutputShards shards_;
    std::uint64_t shard_bytes_;
    std::map<obt::BlockName, Block> blocks_;
    std::vector<ObtPlaneStatistics> statistics_;
    std::vector<bool> any_;
    obt::EncodedTile encoded_;
    std::uint64_t wide_end_, tiles_ = 0, constant_ = 0, wide_ = 0;
    bool resumed_ = false;
};

} // namespace obscura::terrain
