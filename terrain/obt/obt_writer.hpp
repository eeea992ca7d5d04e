// SPDX-License-Identifier: Apache-2.0
// Writer of giant textures (.obt): all levels from one source of finest samples, with progress and resume.
#pragma once

#include "terrain/obt/obt_metadata.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>

namespace obscura::terrain {

/// Finest samples of a raster that is made into a file. Called by the thread that builds.
class ObtSource {
public:
    virtual ~ObtSource() = default;
    /// Numbers (values before scale and offset) of columns x to x + columns - 1 and rows y to y + rows - 1,
    /// all inside the raster, into `out` (row-major); missing samples are NaN. Exceptions end the build.
    virtual void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out) = 0;
    /// Whether blocks must be whole rows, asked for once each from the first to the last (of every plane in
    /// turn, some hundred rows at a time): formats that decompress row by row. A resumed build begins later.
    /// False: blocks of about 4100 x 4100 samples, which overlap by 3 %.
    [[nodiscard]] virtual bool by_rows() const { return false; }
};

/// How a giant texture is written.
struct ObtWriteOptions {
    /// Continue what an interrupted build of the same description left. False: begin anew.
    bool resume = true;
    /// Keep what is done, for another run, when the source throws. Errors of the output always remove it.
    bool keep_on_error = true;
    /// Called after each block with the samples done and their total, about every second; false interrupts
    /// the build, and a later one with `resume` goes on from there.
    std::function<bool(std::uint64_t done, std::uint64_t total)> progress;
    /// Parts of the file on disk; a multiple of 4096.
    std::uint64_t shard_bytes = std::uint64_t{1} << 40;
    /// Threads that make tiles; 0: as many as there are processors, at most 8. The bytes are the same.
    unsigned threads = 0;
};

/// What writing a giant texture came to.
struct ObtWriteReport {
    bool finished = false;      ///< false: interrupted
    std::uint64_t tiles = 0;    ///< with samples, written by this run or found intact
    std::uint64_t constant = 0; ///< without samples: all the same or all missing
    std::uint64_t resumed = 0;  ///< of both, found intact in what an earlier run left
    std::uint64_t wide = 0;     ///< tiles of a lattice that hold f32
    std::uint64_t bytes = 0;    ///< of the file and its shards, with holes
    ObtMetadata metadata;       ///< as written
};

/// Writes `file` (and `file`.001 and so on, if it is larger than a shard): first under names that end in
/// ".part", renamed when all is on disk. Needs up to 150 MB, by rows up to 700 MB. Throws InputError if the
/// description is not allowed or a sample cannot be stored (naming its column and row), OutputError if
/// writing fails, and what the source throws.
ObtWriteReport write_obt(const std::filesystem::path& file, const ObtMetadata& metadata, ObtSource& source,
                         const ObtWriteOptions& options = {});

} // namespace obscura::terrain
