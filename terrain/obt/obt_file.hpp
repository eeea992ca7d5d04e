// SPDX-License-Identifier: Apache-2.0
// Reader of giant textures (.obt): rasters of any size on disk, read tile by tile.
#pragma once

#include "terrain/obt/obt_layout.hpp"
#include "terrain/obt/obt_metadata.hpp"
#include "terrain/obt/obt_samples.hpp"
#include "terrain/obt/obt_storage.hpp"
#include "terrain/sample_pyramid.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::terrain {

/// A tile as it is stored: entry and bytes of its samples, checked.
struct ObtTile {
    obt::Entry entry;
    std::vector<std::byte> samples; ///< empty without slot
};

/// What ObtFile::check() found.
struct ObtCheck {
    std::uint64_t tiles = 0, constant = 0, missing = 0, wide = 0, blocks = 0, bytes = 0;
    std::uint64_t damaged = 0;         ///< tiles and blocks
    std::vector<std::string> findings; ///< the first ones, one line each
    bool interrupted = false;
};

/// The first plane of a file as SamplePyramid; other planes by ObtPlane. Samples are values (offset + scale *
/// number); where a tile is absent, those of the coarser level, interpolated. Reads by pread, with a cache of
/// tiles and one of directory blocks, and no mapping. Thread-safe.
class ObtFile final : public SamplePyramid {
public:
    static constexpr std::size_t default_cache_bytes = std::size_t{64} << 20;

    /// Whether `file` begins as such a file does; false if it cannot be read.
    [[nodiscard]] static bool is_one(const std::filesystem::path& file);

    /// Opens the file and its shards and checks header and sizes. Throws InputError `file: ...`.
    explicit ObtFile(const std::filesystem::path& file, std::size_t cache_bytes = default_cache_bytes);
    ~ObtFile() override;

    [[nodiscard]] const ObtMetadata& metadata() const { return metadata_; }
    [[nodiscard]] const std::string& name() const { return shards_.name(); }
    /// Size of the file with its shards, holes included.
    [[nodiscard]] std::uint64_t bytes() const { return places_.file_bytes; }
    [[nodiscard]] std::uint64_t shard_bytes() const { return places_.shard_bytes; }
    [[nodiscard]] const obt::Layout& layout() const { return layout_; }

    [[nodiscard]] int levels() const override { return layout_.levels(); }
    [[nodiscard]] std::int64_t width(int level) const override { return layout_.width(level); }
    [[nodiscard]] std::int64_t height(int level) const override { return layout_.height(level); }
    [[nodiscard]] bool levels_of_nodes() const override {
        return metadata_.registration == Registration::node;
    }
    [[nodiscard]] float least() const override { return static_cast<float>(statistics(0).least); }
    [[nodiscard]] float largest() const override { return static_cast<float>(statistics(0).largest); }
    [[nodiscard]] bool has_holes() const override { return statistics(0).holes; }
    [[nodiscard]] SampleRange range(std::int64_t x, std::int64_t y, std::int64_t columns,
                                    std::int64_t rows) const override {
        return range(0, x, y, columns, rows);
    }
    void read(int level, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) const override {
        read(0, level, x, y, columns, rows, out);
    }

    /// Range and mean of a plane; zeros if it has no sample.
    [[nodiscard]] ObtPlaneStatistics statistics(std::uint32_t plane) const;
    /// As SamplePyramid::range(), from the directory alone.
    [[nodiscard]] SampleRange range(std::uint32_t plane, std::int64_t x, std::int64_t y, std::int64_t columns,
                                    std::int64_t rows) const;
    /// As SamplePyramid::read().
    void read(std::uint32_t plane, int level, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) const;
    /// A tile that the layout has, from disk; not kept in the cache. Throws InputError.
    [[nodiscard]] ObtTile tile(const obt::TileName& name) const;
    /// Its entry alone.
    [[nodiscard]] obt::Entry entry(const obt::TileName& name) const;
    /// Bounds of the finest values below a tile; least above largest: no samples, or not known (absent).
    [[nodiscard]] obt::TileFacts bounds(const obt::TileName& name) const;

    /// Reads everything once and compares checksums, ranges and places. `progress`, called with tiles done
    /// and tiles in total at most, may return false to interrupt.
    [[nodiscard]] ObtCheck
    check(const std::function<bool(std::uint64_t done, std::uint64_t total)>& progress = {}) const;

private:
    struct Caches;
    using Block = std::vector<std::byte>;

    /// Null: there is none.
    [[nodiscard]] std::shared_ptr<const Block> block(const obt::BlockName& name) const;
    [[nodiscard]] std::shared_ptr<const Block> read_block(const obt::BlockName& name, std::uint64_t place,
                                                          std::uint32_t crc) const;
    [[nodiscard]] obt::Entry entry_in(const Block& block, const obt::TileName& name) const;
    [[nodiscard]] std::shared_ptr<const ObtTile> cached_tile(const obt::TileName& name) const;
    [[nodiscard]] std::vector<float> read_from_coarser(std::uint32_t plane, int level, std::int64_t x,
                                                       std::int64_t y, int columns, int rows) const;
    void check_block(const obt::BlockName& name, std::uint64_t place, std::uint32_t crc, ObtCheck& result,
                     const std::function<bool(std::uint64_t, std::uint64_t)>& progress) const;

    obt::InputShards shards_;
    ObtMetadata metadata_;
    obt::HeaderPlaces places_;
    obt::Layout layout_;
    std::unique_ptr<Caches> caches_;
};

/// One plane of a file. Thread-safe.
class ObtPlane final : public SamplePyramid {
public:
    /// `plane`: below metadata().planes.
    ObtPlane(std::shared_ptr<const ObtFile> file, std::uint32_t plane)
        : file_(std::move(file)), plane_(plane) {}
    [[nodiscard]] int levels() const override { return file_->levels(); }
    [[nodiscard]] std::int64_t width(int level) const override { return file_->width(level); }
    [[nodiscard]] std::int64_t height(int level) const override { return file_->height(level); }
    [[nodiscard]] bool levels_of_nodes() const override { return file_->levels_of_nodes(); }
    [[nodiscard]] float least() const override { return static_cast<float>(file_->statistics(plane_).least); }
    [[nodiscard]] float largest() const override {
        return static_cast<float>(file_->statistics(plane_).largest);
    }
    [[nodiscard]] bool has_holes() const override { return file_->statistics(plane_).holes; }
    [[nodiscard]] SampleRange range(std::int64_t x, std::int64_t y, std::int64_t columns,
                                    std::int64_t rows) const override {
        return file_->range(plane_, x, y, columns, rows);
    }
    void read(int level, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) const override {
        file_->read(plane_, level, x, y, columns, rows, out);
    }

private:
    std::shared_ptr<const ObtFile> file_;
    std::uint32_t plane_;
};

} // namespace obscura::terrain
