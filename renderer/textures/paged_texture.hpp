// SPDX-License-Identifier: Apache-2.0
// Texels of a giant texture (.obt) that is larger than memory: tiles in a cache of fixed size.
#pragma once

#include "terrain/obt/obt_file.hpp"

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::renderer {

/// Mip levels of a giant texture for bilinear look-ups. The coarsest ones are always in memory, of the others
/// the tiles used last.
///
/// Two ways to treat a tile that is not there: with waiting (the start), the thread that looks it up reads it
/// from the file; images do not depend on what was in memory before. Without, look-ups are real-time safe:
/// they take a coarser level instead, count that, and leave the name of the tile for a loader thread of
/// ordinary priority. Thread-safe.
///
/// A slot is guarded by a sequence number, odd while its contents change: a reader that finds another number
/// after reading than before takes what it read for missing.
class PagedTexture {
public:
    static constexpr std::size_t default_cache_bytes = std::size_t{256} << 20;

    /// Throws InputError if the file is not suited for textures: missing samples, lattices of heights.
    explicit PagedTexture(std::shared_ptr<const terrain::ObtFile> file,
                          std::size_t cache_bytes = default_cache_bytes);
    ~PagedTexture();
    PagedTexture(const PagedTexture&) = delete;
    PagedTexture& operator=(const PagedTexture&) = delete;

    [[nodiscard]] const terrain::ObtFile& file() const { return *file_; }
    /// Down to one texel.
    [[nodiscard]] std::size_t levels() const { return levels_.size(); }
    /// Memory for texels.
    [[nodiscard]] std::size_t bytes() const;

    /// Whether look-ups wait for the file, from now on. Not real-time safe.
    void set_waiting(bool waiting);
    /// Look-ups that took a coarser level than asked for, since the start.
    [[nodiscard]] std::uint64_t coarser_lookups() const { return coarser_.load(std::memory_order_relaxed); }

    /// Which coordinates repeat; the others are clamped.
    struct Repeats {
        bool u = true, v = false;
    };
    /// Adds `weight` times the numbers of all planes at (u, v), 0 to 1 each, of a level, to `out`. Throws
    /// InputError if it waits and the file cannot be read.
    void add_bilinear(std::size_t level, double u, double v, Repeats repeats, double weight,
                      double* out) const;

private:
    /// Texels along an axis of a level: the last one may be narrower than the others.
    struct Axis {
        std::int64_t count = 1;
        double size = 1;        ///< of the raster, in texels of the level
        double last_centre = 0; ///< of the last texel; that of texel i is at i
    };
    struct Level {
        Axis across, down;
        std::vector<float> texels; ///< of coarse levels, plane after plane
    };
    /// Texel numbers about a place and the share of the second one.
    struct Pair {
        std::int64_t first = 0, second = 0;
        double share = 0;
    };
    struct Slot;
    struct Cache;

    static Pair pair_at(const Axis& axis, double position, bool repeat);
    /// Adds weighted texels of one level; false if one of its tiles is not there.
    [[nodiscard]] bool try_level(std::size_t level, const Pair& across, const Pair& down, double weight,
                                 double* out) const;
    [[nodiscard]] bool add_texels(std::size_t level, const Pair& across, const Pair& down, double weight,
                                  double* out) const;
    void load(std::uint64_t key) const;
    void run_loader(const std::atomic<bool>& stop) const;

    std::shared_ptr<const terrain::ObtFile> file_;
    std::vector<Level> levels_;
    std::size_t paged_levels_ = 0; ///< the first ones, of tiles in the cache
    std::unique_ptr<Cache> cache_;
    mutable std::mutex loading_;
    mutable std::atomic<std::uint64_t> coarser_{0};
    std::atomic<bool> waiting_{true}, stop_{false};
    std::thread loader_;
};

} // namespace obscura::renderer
