// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_writer.hpp"

#include "core/error.hpp"
#include "core/io/stop_reading.hpp"
#include "terrain/obt/obt_reduction.hpp"
#include "terrain/obt/obt_tile_writer.hpp"
#include "terrain/obt/worker_team.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <limits>

namespace obscura::terrain {

using namespace obt;

namespace {

/// Levels that are made from one block of samples.
constexpr int max_reductions = 4;
/// Memory for blocks of whole rows, all levels and planes.
constexpr std::int64_t max_row_bytes = std::int64_t{400} << 20;
/// Rows that two blocks of whole rows share at most.
constexpr int max_shared_rows = 4 * margin << max_reductions;

/// Threads that make tiles, if options do not say.
constexpr unsigned max_threads = 8;

struct Interrupted {};

/// Errors of the source, told from those of the output.
struct SourceFailed {
    std::exception_ptr error;
};

/// Makes levels from blocks of one level. A pass takes its samples from the source or, later, from the tiles
/// of the coarsest level that the pass before made: the disk is read again for one sample in 256 only.
class Builder {
public:
    Builder(ObtTileWriter& writer, const ObtMetadata& metadata, ObtSource& source,
            const ObtWriteOptions& options)
        : writer_(writer),
          layout_(writer.layout()),
          metadata_(metadata),
          source_(source),
          options_(options),
          numbers_(tile_count),
          previous_(metadata.planes),
          team_(options.threads, max_threads) {
        total_ = static_cast<std::uint64_t>(metadata.planes) * static_cast<std::uint64_t>(metadata.width) *
                 static_cast<std::uint64_t>(metadata.height);
    }

    void run() {
        int made = pass(0, true);
        while (made < layout_.levels() - 1)
            made = pass(made, false);
    }

    [[nodiscard]] std::uint64_t resumed() const { return resumed_; }

private:
    /// Makes the levels after `base`, and with `from_source` that level itself; the coarsest level made.
    int pass(int base, bool from_source) {
        int reductions = std::min(max_reductions, layout_.levels() - 1 - base);
        const std::int64_t w = layout_.width(base), h = layout_.height(base);
        const bool rows = from_source && source_.by_rows();
        const auto edge = [&] { return std::int64_t{tile_samples} << reductions; };
        if (rows)
            while (reductions > 0 &&
                   (edge() + 2 * halo(reductions)) * w * 7 * metadata_.planes > max_row_bytes)
                --reductions;
        for (std::int64_t y = 0; y < h; y += edge())
            for (std::int64_t x = 0; x < w; x += rows ? w : edge())
                for (std::uint32_t plane = 0; plane < metadata_.planes; ++plane) {
                    const std::int64_t x1 = rows ? w : std::min(w, x + edge());
                    block(plane, base, reductions, from_source, x, y, x1, std::min(h, y + edge()));
                    if (!from_source) continue;
                    done_ += static_cast<std::uint64_t>(x1 - x) *
                             static_cast<std::uint64_t>(std::min(h, y + edge()) - y);
                    tell();
                }
        return base + reductions;
    }

    void tell() {
        const auto now = std::chrono::steady_clock::now();
        if (!options_.progress || (done_ < total_ && now - told_ < std::chrono::milliseconds(200))) return;
        told_ = now;
        if (!options_.progress(done_, total_) && done_ < total_) throw Interrupted{};
    }

    /// Samples about a block that the margins of its coarsest level need.
    static std::int64_t halo(int reductions) { return std::int64_t{2 * margin} << reductions; }

    /// Calls `use(tile)` for the tiles of a level that lie in a part of level `base`.
    template<typename Use>
    void for_each_tile(std::uint32_t plane, int base, int level, std::int64_t x0, std::int64_t y0,
                       std::int64_t x1, std::int64_t y1, const Use& use) const {
        const int shift = level - base;
        const auto last = [&](std::int64_t end) { return (((end - 1) >> shift) / tile_samples); };
        for (std::int64_t j = (y0 >> shift) / tile_samples; j <= last(y1); ++j)
            for (std::int64_t i = (x0 >> shift) / tile_samples; i <= last(x1); ++i)
                use(TileName{plane, level, i, j});
    }

    /// Whether all tiles of the block are there from an earlier run.
    bool keep_block(std::uint32_t plane, int base, int reductions, bool with_base, std::int64_t x0,
                    std::int64_t y0, std::int64_t x1, std::int64_t y1) {
        if (!writer_.resumed()) return false;
        bool all = true;
        const auto each = [&](const auto& use) {
            for (int level = base + (with_base ? 0 : 1); level <= base + reductions; ++level)
                for_each_tile(plane, base, level, x0, y0, x1, y1, use);
        };
        each([&](const TileName& tile) { all = all && writer_.intact(tile, {}).has_value(); });
        if (all)
            each([&](const TileName& tile) {
                const std::optional<Entry> entry = writer_.intact(tile, numbers_);
                if (!entry) throw OutputError("the temporary file changed while it was read");
                writer_.keep(tile, *entry, numbers_);
                ++resumed_;
            });
        return all;
    }

    void read_source(std::uint32_t plane, SampleBlock& out) {
        out.samples.resize(static_cast<std::size_t>(out.columns) * static_cast<std::size_t>(out.rows));
        // Whole rows are asked for once: those that two blocks share are kept.
        SampleBlock& before = previous_[plane];
        int kept = 0;
        if (source_.by_rows()) {
            kept = static_cast<int>(std::clamp<std::int64_t>(before.y + before.rows - out.y, 0,
                                                             before.y <= out.y ? out.rows : 0));
            const auto from = before.samples.begin() +
                              static_cast<std::ptrdiff_t>(out.y - before.y) * (kept > 0 ? before.columns : 0);
            std::copy(from, from + static_cast<std::ptrdiff_t>(kept) * out.columns, out.samples.begin());
        }
        if (kept < out.rows) try {
                const std::size_t first =
                    static_cast<std::size_t>(kept) * static_cast<std::size_t>(out.columns);
                source_.read(plane, out.x, out.y + kept, out.columns, out.rows - kept,
                             std::span(out.samples).subspan(first));
            } catch (const ReadingStopped&) {
                throw Interrupted{};
            } catch (...) {
                throw SourceFailed{std::current_exception()};
            }
        if (!source_.by_rows()) return;
        before = {out.level, out.x, std::max(out.y, out.y + out.rows - max_shared_rows), out.columns, 0, {}};
        before.rows = static_cast<int>(out.y + out.rows - before.y);
        before.samples.assign(out.samples.end() - static_cast<std::ptrdiff_t>(before.rows) * before.columns,
                              out.samples.end());
    }

    void block(std::uint32_t plane, int base, int reductions, bool from_source, std::int64_t x0,
               std::int64_t y0, std::int64_t x1, std::int64_t y1) {
        if (keep_block(plane, base, reductions, from_source, x0, y0, x1, y1)) return;
        // Memory is used again: it is larger than what a process gets cheaply.
        SampleBlock& fine = fine_;
        fine.level = base;
        fine.x = std::max<std::int64_t>(0, x0 - halo(reductions));
        fine.y = std::max<std::int64_t>(0, y0 - halo(reductions));
        fine.columns = static_cast<int>(std::min(layout_.width(base), x1 + halo(reductions)) - fine.x);
        fine.rows = static_cast<int>(std::min(layout_.height(base), y1 + halo(reductions)) - fine.y);
        if (from_source) {
            read_source(plane, fine);
        } else {
            fine.samples.resize(static_cast<std::size_t>(fine.columns) * static_cast<std::size_t>(fine.rows));
            writer_.read(plane, base, fine.x, fine.y, fine.columns, fine.rows, fine.samples);
        }
        std::map<TileName, TileFacts> facts;
        if (from_source) {
            make_tiles(tiles_of(plane, base, base, x0, y0, x1, y1), fine, facts,
                       [&](const TileName& tile) { return range_of(fine, tile); });
        } else {
            for_each_tile(plane, base, base, x0, y0, x1, y1, [&](const TileName& tile) {
                if (const auto entry = writer_.intact(tile, {})) facts[tile] = facts_of(metadata_, *entry);
            });
        }
        for (int level = base + 1; level <= base + reductions; ++level) {
            SampleBlock& coarse = coarse_;
            reduce(fine, metadata_.registration, metadata_.width, metadata_.height, coarse);
            std::map<TileName, TileFacts> above;
            make_tiles(tiles_of(plane, base, level, x0, y0, x1, y1), coarse, above,
                       [&](const TileName& tile) {
                           TileFacts f;
                           double step = 0;
                           for (std::int64_t k = 0; k < 4; ++k) {
                               const TileName child{plane, level - 1, 2 * tile.i + k % 2, 2 * tile.j + k / 2};
                               const auto it = facts.find(child);
                               if (it == facts.end() || !it->second.any()) continue;
                               f.add(it->second);
                               step = std::max(step, difference(fine, coarse, child));
                           }
                           f.error += step;
                           return f;
                       });
            facts = std::move(above);
            std::swap(fine, coarse);
        }
        writer_.flush();
    }

    [[nodiscard]] std::vector<TileName> tiles_of(std::uint32_t plane, int base, int level, std::int64_t x0,
                                                 std::int64_t y0, std::int64_t x1, std::int64_t y1) const {
        std::vector<TileName> tiles;
        for_each_tile(plane, base, level, x0, y0, x1, y1,
                      [&](const TileName& tile) { tiles.push_back(tile); });
        return tiles;
    }

    /// Memory of a thread that makes tiles.
    struct TileScratch {
        std::vector<float> numbers = std::vector<float>(tile_count);
        EncodedTile encoded;
    };

    /// Writes tiles of a block. `look(tile)`: what is below it; called by several threads.
    template<typename Look>
    void make_tiles(const std::vector<TileName>& tiles, const SampleBlock& from,
                    std::map<TileName, TileFacts>& facts, const Look& look) {
        std::vector<TileFacts> found(tiles.size());
        std::vector<ObtTileWriter::Prepared> prepared(tiles.size());
        team_.run(tiles.size(), [&](std::size_t k, TileScratch& scratch) {
            found[k] = look(tiles[k]);
            cut(from, tiles[k], scratch.numbers);
            prepared[k] = writer_.prepare(tiles[k], scratch.numbers, found[k], scratch.encoded);
        });
        for (std::size_t k = 0; k < tiles.size(); ++k) {
            writer_.commit(tiles[k], std::move(prepared[k]));
            facts[tiles[k]] = found[k];
        }
    }

    [[nodiscard]] std::int64_t end_column(const TileName& tile) const {
        return std::min(layout_.width(tile.level), (tile.i + 1) * tile_samples);
    }
    [[nodiscard]] std::int64_t end_row(const TileName& tile) const {
        return std::min(layout_.height(tile.level), (tile.j + 1) * tile_samples);
    }

    [[nodiscard]] double difference(const SampleBlock& fine, const SampleBlock& coarse,
                                    const TileName& tile) const {
        return largest_difference(fine, coarse, metadata_.registration, tile.i * tile_samples,
                                  tile.j * tile_samples, end_column(tile), end_row(tile));
    }

    [[nodiscard]] TileFacts range_of(const SampleBlock& fine, const TileName& tile) const {
        // Several samples at a time; comparisons with NaN are false.
        constexpr std::size_t lanes = 16;
        std::array<float, lanes> least, largest;
        least.fill(std::numeric_limits<float>::infinity());
        largest.fill(-std::numeric_limits<float>::infinity());
        const auto look = [&](float v, std::size_t lane) {
            least[lane] = v < least[lane] ? v : least[lane];
            largest[lane] = v > largest[lane] ? v : largest[lane];
        };
        const std::int64_t first = tile.i * tile_samples;
        const auto count = static_cast<std::size_t>(end_column(tile) - first);
        for (std::int64_t row = tile.j * tile_samples; row < end_row(tile); ++row) {
            const float* const line =
                fine.samples.data() +
                static_cast<std::size_t>(row - fine.y) * static_cast<std::size_t>(fine.columns) +
                static_cast<std::size_t>(first - fine.x);
            std::size_t i = 0;
            for (; i + lanes <= count; i += lanes)
                for (std::size_t lane = 0; lane < lanes; ++lane)
                    look(line[i + lane], lane);
            for (; i < count; ++i)
                look(line[i], 0);
        }
        TileFacts facts;
        for (std::size_t lane = 0; lane < lanes; ++lane) {
            facts.least = std::min(facts.least, static_cast<double>(least[lane]));
            facts.largest = std::max(facts.largest, static_cast<double>(largest[lane]));
        }
        return facts;
    }

    /// Cuts a tile with its margin out of a block; beyond the raster, the nearest samples are repeated.
    void cut(const SampleBlock& from, const TileName& tile, std::span<float> numbers) const {
        const std::int64_t x = tile.i * tile_samples - margin, y = tile.j * tile_samples - margin;
        const std::int64_t right = layout_.width(tile.level) - 1, bottom = layout_.height(tile.level) - 1;
        const std::int64_t first = std::max<std::int64_t>(x, 0),
                           last = std::min(x + stored_tile_edge - 1, right);
        for (std::int64_t row = 0; row < stored_tile_edge; ++row) {
            const std::int64_t at = std::clamp<std::int64_t>(y + row, 0, bottom);
            const float* const line = from.samples.data() + static_cast<std::size_t>(at - from.y) *
                                                                static_cast<std::size_t>(from.columns);
            float* const out = numbers.data() + row * stored_tile_edge;
            std::fill(out, out + (first - x), line[first - from.x]);
            std::copy(line + (first - from.x), line + (last + 1 - from.x), out + (first - x));
            std::fill(out + (last + 1 - x), out + stored_tile_edge, line[last - from.x]);
        }
    }

    ObtTileWriter& writer_;
    const Layout& layout_;
    const ObtMetadata& metadata_;
    ObtSource& source_;
    const ObtWriteOptions& options_;
    std::vector<float> numbers_;
    std::vector<SampleBlock> previous_;
    SampleBlock fine_, coarse_;
    WorkerTeam<TileScratch> team_;
    std::uint64_t done_ = 0, total_ = 0, resumed_ = 0;
    std::chrono::steady_clock::time_point told_{};
};

} // namespace

ObtWriteReport write_obt(const std::filesystem::path& file, const ObtMetadata& metadata, ObtSource& source,
                         const ObtWriteOptions& options) {
    ObtTileWriter writer(file, metadata, options.shard_bytes, options.resume);
    Builder builder(writer, metadata, source, options);
    ObtWriteReport report;
    try {
        builder.run();
        report.metadata = writer.finish();
        report.finished = true;
    } catch (const Interrupted&) {
        writer.flush();
        report.metadata = metadata;
    } catch (const SourceFailed& failed) {
        if (!options.keep_on_error) writer.remove();
        std::rethrow_exception(failed.error);
    } catch (...) {
        writer.remove();
        throw;
    }
    report.tiles = writer.tiles();
    report.constant = writer.constant();
    report.resumed = builder.resumed();
    report.wide = writer.wide();
    report.bytes = writer.bytes();
    return report;
}

} // namespace obscura::terrain
