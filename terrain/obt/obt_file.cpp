// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_file.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/lru_cache.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace obscura::terrain {

using namespace obt;

namespace {

constexpr std::size_t cached_blocks = 256; // 8 MiB
constexpr float no_data = std::numeric_limits<float>::quiet_NaN();

} // namespace

struct ObtFile::Caches {
    explicit Caches(std::size_t max_tiles) : tiles(max_tiles) {}
    LruCache<TileName, ObtTile> tiles;
    LruCache<BlockName, Block> blocks{cached_blocks};
};

bool ObtFile::is_one(const std::filesystem::path& file) {
    if (!is_file_at(file)) return false;
    const FileDescriptor fd(::open(file.c_str(), O_RDONLY | O_CLOEXEC));
    std::array<char, magic.size()> first{};
    return fd && ::pread(fd.get(), first.data(), first.size(), 0) == static_cast<ssize_t>(first.size()) &&
           std::string_view(first.data(), first.size()) == magic;
}

ObtFile::ObtFile(const std::filesystem::path& file, std::size_t cache_bytes) : shards_(file) {
    std::vector<std::byte> header(data_start);
    const std::uintmax_t there = file_bytes_at(file);
    header.resize(static_cast<std::size_t>(std::min<std::uintmax_t>(there, header.size())));
    shards_.read(0, header);
    read_header(header, shards_.name(), metadata_, places_);
    if (!places_.complete) throw InputError(shards_.name() + ": its making was not finished");
    shards_.open_all(places_.file_bytes, places_.shard_bytes);
    layout_ = Layout(metadata_, shards_.name());
    caches_ = std::make_unique<Caches>(
        std::max<std::size_t>(cache_bytes / static_cast<std::size_t>(layout_.slot_bytes()), 4));
}

ObtFile::~ObtFile() = default;

ObtPlaneStatistics ObtFile::statistics(std::uint32_t plane) const {
    return plane < metadata_.statistics.size() ? metadata_.statistics[plane] : ObtPlaneStatistics{};
}

std::shared_ptr<const ObtFile::Block> ObtFile::read_block(const BlockName& name, std::uint64_t place,
                                                          std::uint32_t crc) const {
    const auto refuse = [&](std::string_view why) {
        throw InputError(fmt::format("{}: directory block at byte {}: {}", shards_.name(), place, why));
    };
    if (place < data_start || place + block_bytes > places_.file_bytes || place % page != 0)
        refuse("outside of the file");
    Block bytes(block_bytes);
    shards_.read(place, bytes);
    if (crc32c(bytes) != crc) refuse("its checksum does not match: the file is damaged");
    // A block that is reached on two ways, or from below itself, has another name.
    if (get<std::uint64_t>(bytes.data() + block_name) != name.number()) refuse("it is another one's");
    return std::make_shared<const Block>(std::move(bytes));
}

std::shared_ptr<const ObtFile::Block> ObtFile::block(const BlockName& name) const {
    if (auto cached = caches_->blocks.find(name)) return cached;
    std::uint64_t place = 0;
    std::uint32_t crc = 0;
    if (name.group == 0) {
        place = places_.roots[name.plane].place;
        crc = places_.roots[name.plane].crc;
    } else {
        const auto parent = block(name.parent());
        if (!parent) return nullptr;
        const std::byte* const pointer = parent->data() + name.place_in_parent();
        place = (get<std::uint64_t>(pointer) & low_48) * page;
        crc = get<std::uint32_t>(pointer + pointer_crc);
    }
    if (place == 0) return nullptr;
    auto read = read_block(name, place, crc);
    caches_->blocks.insert(name, read);
    return read;
}

Entry ObtFile::entry_in(const Block& block, const TileName& name) const {
    const auto refuse = [&](std::string_view why) {
        throw InputError(fmt::format("{}: {}: {}", shards_.name(), to_string(name), why));
    };
    const std::optional<Entry> found = entry_of(block.data() + layout_.place_in_block(name));
    if (!found) refuse("its entry in the directory is not one");
    const Entry& e = *found;
    if (e.stored == Stored::wide && !metadata_.lattice) refuse("f32 in a file without lattice");
    const bool whole = metadata_.type != SampleType::f16 && metadata_.type != SampleType::f32;
    const int finest = metadata_.lattice ? metadata_.finest_exponent : 0;
    const int coarsest = metadata_.lattice ? metadata_.coarsest_exponent : 0;
    if (whole && (e.stored == Stored::samples || e.stored == Stored::constant) &&
        (e.exponent < finest || e.exponent > coarsest))
        refuse(fmt::format("a step of 2^{}: its header allows 2^{} to 2^{}", e.exponent, finest, coarsest));
    if (e.has_slot() && (e.slot < data_start || e.slot + sample_bytes(metadata_, e) > places_.file_bytes))
        refuse(fmt::format("at byte {}: outside of the file", e.slot));
    return e;
}

Entry ObtFile::entry(const TileName& name) const {
    if (!layout_.has(name))
        throw std::out_of_range(fmt::format("{}: there is no {}", shards_.name(), to_string(name)));
    const auto found = block(layout_.block_of(name));
    return found ? entry_in(*found, name) : Entry{};
}

ObtTile ObtFile::tile(const TileName& name) const {
    ObtTile tile{entry(name), {}};
    if (tile.entry.stored == Stored::absent) return tile;
    if (tile.entry.has_slot()) {
        tile.samples.resize(sample_bytes(metadata_, tile.entry));
        shards_.read(tile.entry.slot, tile.samples);
    }
    if (crc_of(tile.entry, tile.samples) != tile.entry.crc)
        throw InputError(fmt::format("{}: {} at byte {}: its checksum does not match: the file is damaged",
                                     shards_.name(), to_string(name), tile.entry.slot));
    return tile;
}

TileFacts ObtFile::bounds(const TileName& name) const {
    TileFacts facts = facts_of(metadata_, entry(name));
    if (!facts.any()) return facts;
    facts.least = metadata_.offset + metadata_.scale * facts.least;
    facts.largest = metadata_.offset + metadata_.scale * facts.largest;
    facts.error *= std::abs(metadata_.scale);
    if (facts.least > facts.largest) std::swap(facts.least, facts.largest);
    return facts;
}

SampleRange ObtFile::range(std::uint32_t plane, std::int64_t x, std::int64_t y, std::int64_t columns,
                           std::int64_t rows) const {
    const ObtPlaneStatistics whole = statistics(plane);
    const SampleRange all{static_cast<float>(whole.least), static_cast<float>(whole.largest)};
    const std::int64_t x1 = std::min(x + columns, width(0)), y1 = std::min(y + rows, height(0));
    x = std::max<std::int64_t>(x, 0);
    y = std::max<std::int64_t>(y, 0);
    if (x >= x1 || y >= y1) return all;
    // The level at which the block has at most 4 x 4 tiles or so.
    int level = 0;
    while (level + 1 < levels() && (std::max(x1 - x, y1 - y) >> level) > 3 * tile_samples)
        ++level;
    TileFacts facts;
    for (std::int64_t j = (y >> level) / tile_samples; j <= ((y1 - 1) >> level) / tile_samples; ++j)
        for (std::int64_t i = (x >> level) / tile_samples; i <= ((x1 - 1) >> level) / tile_samples; ++i) {
            if (entry({plane, level, i, j}).stored == Stored::absent) return all;
            facts.add(bounds({plane, level, i, j}));
        }
    if (!facts.any()) return all;
    // Not beyond what float holds, whatever a damaged file says.
    return {static_cast<float>(std::clamp(facts.least, whole.least, whole.largest)),
            static_cast<float>(std::clamp(facts.largest, whole.least, whole.largest))};
}

std::shared_ptr<const ObtTile> ObtFile::cached_tile(const TileName& name) const {
    if (auto cached = caches_->tiles.find(name)) return cached;
    auto read = std::make_shared<const ObtTile>(tile(name));
    caches_->tiles.insert(name, read);
    return read;
}

void ObtFile::read(std::uint32_t plane, int level, std::int64_t x, std::int64_t y, int columns, int rows,
                   std::span<float> out) const {
    if (plane >= metadata_.planes || level < 0 || level >= levels() || x < 0 || y < 0 || columns < 0 ||
        rows < 0 || x > width(level) - columns || y > height(level) - rows ||
        out.size() < static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows))
        throw std::out_of_range(
            fmt::format("{}: {} x {} samples at ({}, {}) of level {}, plane {}: outside of the raster",
                        shards_.name(), columns, rows, x, y, level, plane));
    if (columns == 0 || rows == 0) return;
    std::vector<float> coarser; // of the whole block, once one tile is absent
    for (std::int64_t j = y / tile_samples; j <= (y + rows - 1) / tile_samples; ++j)
        for (std::int64_t i = x / tile_samples; i <= (x + columns - 1) / tile_samples; ++i) {
            const std::int64_t x0 = std::max(x, i * tile_samples);
            const std::int64_t y0 = std::max(y, j * tile_samples);
            const auto w = static_cast<int>(std::min(x + columns, (i + 1) * tile_samples) - x0);
            const auto h = static_cast<int>(std::min(y + rows, (j + 1) * tile_samples) - y0);
            const auto tile = cached_tile({plane, level, i, j});
            float* const to = out.data() + (y0 - y) * columns + (x0 - x);
            if (tile->entry.stored == Stored::absent) {
                if (coarser.empty()) coarser = read_from_coarser(plane, level, x, y, columns, rows);
                for (int row = 0; row < h; ++row) {
                    const std::ptrdiff_t first = (y0 + row - y) * columns + (x0 - x);
                    std::copy_n(coarser.begin() + first, w, out.begin() + first);
                }
                continue;
            }
            for (int row = 0; row < h; ++row) {
                const auto first =
                    static_cast<std::size_t>((y0 + row - j * tile_samples + margin) * stored_tile_edge +
                                             (x0 - i * tile_samples) + margin);
                decode_values(metadata_, tile->entry, tile->samples.data(), first,
                              static_cast<std::size_t>(w), to + static_cast<std::ptrdiff_t>(row) * columns);
            }
        }
}

std::vector<float> ObtFile::read_from_coarser(std::uint32_t plane, int level, std::int64_t x, std::int64_t y,
                                              int columns, int rows) const {
    std::vector<float> out(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), no_data);
    if (level + 1 == levels()) return out;
    // Sample i of this level is at (i + 0.5) / 2 - 0.5 of the coarser one, or at i / 2.
    const bool node = metadata_.registration == Registration::node;
    const auto place = [&](std::int64_t i, std::int64_t size, std::int64_t& first, double& share) {
        const double at = node ? 0.5 * static_cast<double>(i) : 0.5 * static_cast<double>(i) - 0.25;
        const double low = std::floor(at);
        share = at - low;
        first = static_cast<std::int64_t>(low);
        if (first < 0) {
            first = 0;
            share = 0;
        }
        if (first >= size - 1) {
            first = size - 1;
            share = 0;
        }
    };
    std::int64_t x0 = 0, x1 = 0, y0 = 0, y1 = 0;
    double unused = 0;
    place(x, width(level + 1), x0, unused);
    place(x + columns - 1, width(level + 1), x1, unused);
    place(y, height(level + 1), y0, unused);
    place(y + rows - 1, height(level + 1), y1, unused);
    const auto w = static_cast<int>(std::min(x1 + 2, width(level + 1)) - x0);
    const auto h = static_cast<int>(std::min(y1 + 2, height(level + 1)) - y0);
    std::vector<float> coarse(static_cast<std::size_t>(w) * static_cast<std::size_t>(h));
    read(plane, level + 1, x0, y0, w, h, coarse);
    for (int row = 0; row < rows; ++row) {
        std::int64_t top = 0;
        double fy = 0;
        place(y + row, height(level + 1), top, fy);
        const float* const upper = coarse.data() + (top - y0) * w;
        const float* const lower = fy > 0 ? upper + w : upper;
        for (int column = 0; column < columns; ++column) {
            std::int64_t left = 0;
            double fx = 0;
            place(x + column, width(level + 1), left, fx);
            const std::int64_t a = left - x0, b = fx > 0 ? a + 1 : a;
            const auto mix = [&](const float* line) {
                return (1 - fx) * static_cast<double>(line[a]) + fx * static_cast<double>(line[b]);
            };
            out[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                static_cast<std::size_t>(column)] =
                static_cast<float>((1 - fy) * mix(upper) + fy * mix(lower));
        }
    }
    return out;
}

void ObtFile::check_block(const BlockName& name, std::uint64_t place, std::uint32_t crc, ObtCheck& result,
                          const std::function<bool(std::uint64_t, std::uint64_t)>& progress) const {
    const auto note = [&](const std::exception& e) {
        ++result.damaged;
        if (result.findings.size() < 20) result.findings.emplace_back(e.what());
    };
    std::shared_ptr<const Block> bytes;
    try {
        bytes = read_block(name, place, crc);
    } catch (const InputError& e) {
        note(e);
        return;
    }
    ++result.blocks;
    caches_->blocks.insert(name, bytes);
    std::vector<float> numbers(tile_count);
    const int first_depth = name.group * block_levels;
    for (int below = 0; below < block_levels && first_depth + below < levels(); ++below)
        for (std::int64_t j = 0; j < 1 << below; ++j)
            for (std::int64_t i = 0; i < 1 << below; ++i) {
                const TileName t{name.plane, levels() - 1 - first_depth - below,
                                 (std::int64_t{name.i} << below) + i, (std::int64_t{name.j} << below) + j};
                if (!layout_.has(t)) continue;
                try {
                    const ObtTile tile = this->tile(t);
                    const Stored stored = tile.entry.stored;
                    result.tiles += tile.entry.has_slot() ? 1 : 0;
                    result.wide += stored == Stored::wide ? 1 : 0;
                    result.constant += stored == Stored::constant ? 1 : 0;
                    result.missing += stored == Stored::missing ? 1 : 0;
                    result.bytes += tile.samples.size();
                    // What one tile holds twice its siblings hold, too: damage by programs shows in the
                    // range.
                    if (t.level == 0 && tile.entry.has_slot()) {
                        decode_numbers(metadata_, tile.entry, tile.samples.data(), 0, tile_count,
                                       numbers.data());
                        const TileFacts facts = facts_of(metadata_, tile.entry);
                        for (int row = margin; row < stored_tile_edge - margin; ++row)
                            for (int column = margin; column < stored_tile_edge - margin; ++column) {
                                const auto v = static_cast<double>(
                                    numbers[static_cast<std::size_t>(row * stored_tile_edge + column)]);
                                if (v < facts.least || v > facts.largest)
                                    throw InputError(fmt::format(
                                        "{}: {}: sample {} is outside of its range, {} to {}", shards_.name(),
                                        to_string(t), v, facts.least, facts.largest));
                            }
                    }
                } catch (const InputError& e) {
                    note(e);
                }
                if (progress && result.tiles % 64 == 0 &&
                    !progress(result.tiles + result.constant + result.missing,
                              static_cast<std::uint64_t>(layout_.tiles_across(0)) *
                                  static_cast<std::uint64_t>(layout_.tiles_down(0)) * metadata_.planes * 4 /
                                  3))
                    result.interrupted = true;
                if (result.interrupted) return;
            }
    for (std::uint32_t k = 0; k < block_pointers && !result.interrupted; ++k) {
        const BlockName child{name.plane, name.group + 1, (name.i << block_levels) + (k & 31U),
                              (name.j << block_levels) + (k >> block_levels)};
        const std::byte* const pointer = bytes->data() + child.place_in_parent();
        const std::uint64_t at = (get<std::uint64_t>(pointer) & low_48) * page;
        if (at == 0) continue;
        const int level = levels() - 1 - child.group * block_levels;
        if (!layout_.has({child.plane, level, child.i, child.j})) {
            note(InputError(fmt::format(
                "{}: directory block at byte {}: points to a block below the finest level or beside the raster",
                shards_.name(), place)));
            continue;
        }
        check_block(child, at, get<std::uint32_t>(pointer + pointer_crc), result, progress);
    }
}

ObtCheck ObtFile::check(const std::function<bool(std::uint64_t, std::uint64_t)>& progress) const {
    ObtCheck result;
    for (std::uint32_t plane = 0; plane < metadata_.planes; ++plane) {
        const HeaderPlaces::Root& root = places_.roots[plane];
        if (root.place != 0) check_block({plane, 0, 0, 0}, root.place, root.crc, result, progress);
    }
    return result;
}

} // namespace obscura::terrain
