// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_tile_writer.hpp"

#include "core/error.hpp"
#include "terrain/obt/crc32c.hpp"
#include "terrain/obt/obt_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::terrain {

using namespace obt;

namespace {

constexpr std::size_t max_written_blocks = 1024; // 32 MiB

/// Two independent 64-bit hashes of the content, marked as a UUID of version 8 (RFC 9562).
ObtUuid uuid_of(std::span<const std::byte> header, const std::vector<std::vector<std::byte>>& roots) {
    std::array<std::uint64_t, 2> state{0x9E3779B97F4A7C15, 0xD1B54A32D192ED03};
    const auto add = [&](std::span<const std::byte> bytes) {
        for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8)
            for (std::uint64_t& s : state) {
                s ^= obt::get<std::uint64_t>(bytes.data() + i);
                s = (s ^ s >> 30) * 0xBF58476D1CE4E5B9;
                s = (s ^ s >> 27) * 0x94D049BB133111EB;
                s ^= s >> 31;
            }
    };
    add(header);
    for (const auto& root : roots)
        add(root);
    ObtUuid uuid;
    for (std::size_t i = 0; i < uuid.size(); ++i)
        uuid[i] = static_cast<std::uint8_t>(state[i / 8] >> (8 * (i % 8)));
    uuid[6] = static_cast<std::uint8_t>(0x80U | (uuid[6] & 0x0FU));
    uuid[8] = static_cast<std::uint8_t>(0x80U | (uuid[8] & 0x3FU));
    return uuid;
}

/// The description without what the writer finds out.
ObtMetadata checked(ObtMetadata metadata, const std::string& name) {
    metadata.uuid = {};
    metadata.statistics.clear();
    validate(metadata, name);
    return metadata;
}

/// Shards of a texture that is about to be replaced; 0: there is none.
std::uint64_t shards_of_file(const std::filesystem::path& file) {
    if (!ObtFile::is_one(file)) return 0;
    try {
        const ObtFile old(file, 0);
        return shards_of(old.bytes(), old.shard_bytes());
    } catch (const InputError&) {
        return 0; // damaged: its shards are left alone
    }
}

} // namespace

ObtTileWriter::ObtTileWriter(const std::filesystem::path& file, const ObtMetadata& metadata,
                             std::uint64_t shard_bytes, bool resume)
    : name_(file.string()),
      metadata_(checked(metadata, name_)),
      layout_(metadata_, name_),
      shards_(file, shard_bytes),
      shard_bytes_(shard_bytes),
      statistics_(metadata.planes),
      any_(metadata.planes, false),
      wide_end_(layout_.wide_start()) {
    if (shard_bytes < page || shard_bytes % page != 0)
        throw InputError(
            fmt::format("{}: parts of {} bytes: allowed are multiples of 4096", name_, shard_bytes));
    HeaderPlaces places;
    places.shard_bytes = shard_bytes;
    places.roots.resize(metadata_.planes);
    const std::vector<std::byte> begun = header_of(metadata_, places);
    std::vector<std::byte> there(begun.size());
    shards_.read(0, there);
    resumed_ = resume && there == begun;
    if (resumed_) return;
    shards_.clear();
    shards_.write(0, begun);
}

ObtTileWriter::Block& ObtTileWriter::block(const BlockName& name) {
    if (const auto it = blocks_.find(name); it != blocks_.end()) return it->second;
    if (blocks_.size() >= max_written_blocks) {
        flush();
        blocks_.clear();
    }
    Block& b = blocks_[name];
    b.bytes.resize(block_bytes);
    shards_.read(layout_.block_place(name), b.bytes);
    if (obt::get<std::uint64_t>(b.bytes.data() + block_name) != name.number()) {
        std::fill(b.bytes.begin(), b.bytes.end(), std::byte{0});
        obt::put(b.bytes.data() + block_name, name.number());
    }
    return b;
}

void ObtTileWriter::put(const TileName& tile, const Entry& entry) {
    const BlockName name = layout_.block_of(tile);
    const EntryBytes bytes = bytes_of(entry);
    {
        Block& b = block(name);
        std::copy(bytes.begin(), bytes.end(),
                  b.bytes.begin() + static_cast<std::ptrdiff_t>(layout_.place_in_block(tile)));
        b.changed = true;
    }
    // The blocks above point to it.
    for (BlockName child = name; child.group > 0; child = child.parent()) {
        const std::uint64_t place = layout_.block_place(child) / page;
        Block& above = block(child.parent());
        std::byte* const pointer = above.bytes.data() + child.place_in_parent();
        if ((obt::get<std::uint64_t>(pointer) & low_48) == place) break;
        obt::put(pointer, place);
        above.changed = true;
    }
}

void ObtTileWriter::count(const TileName& tile, const Entry& entry, double least, double largest) {
    tiles_ += entry.has_slot() ? 1 : 0;
    constant_ += entry.has_slot() ? 0 : 1;
    wide_ += entry.stored == Stored::wide ? 1 : 0;
    ObtPlaneStatistics& s = statistics_[tile.plane];
    s.holes = s.holes || entry.holes || entry.stored == Stored::missing;
    if (tile.level > 0 || !(least <= largest)) return;
    s.least = any_[tile.plane] ? std::min(s.least, least) : least;
    s.largest = any_[tile.plane] ? std::max(s.largest, largest) : largest;
    any_[tile.plane] = true;
}

ObtTileWriter::Prepared ObtTileWriter::prepare(const TileName& tile, std::span<const float> numbers,
                                               const TileFacts& facts, EncodedTile& scratch) {
    encode(metadata_, tile, numbers, facts, name_, scratch);
    Prepared made;
    made.entry = scratch.entry;
    if (facts.any()) {
        made.least = scratch.least;
        made.largest = scratch.largest;
    }
    if (made.entry.stored == Stored::wide) {
        made.wide = std::move(scratch.bytes);
        return made;
    }
    if (made.entry.stored == Stored::samples) made.entry.slot = layout_.slot_place(tile);
    made.entry.crc = crc_of(made.entry, scratch.bytes);
    shards_.write(made.entry.slot, scratch.bytes);
    return made;
}

void ObtTileWriter::commit(const TileName& tile, Prepared prepared) {
    Entry& entry = prepared.entry;
    if (entry.stored == Stored::wide) {
        entry.slot = wide_end_;
        wide_end_ += (prepared.wide.size() + page - 1) / page * page;
        entry.crc = crc_of(entry, prepared.wide);
        shards_.write(entry.slot, prepared.wide);
    }
    put(tile, entry);
    count(tile, entry, prepared.least, prepared.largest);
}

std::optional<Entry> ObtTileWriter::intact(const TileName& tile, std::span<float> numbers) {
    const Block& b = block(layout_.block_of(tile));
    const std::optional<Entry> entry = entry_of(b.bytes.data() + layout_.place_in_block(tile));
    if (!entry || entry->stored == Stored::absent) return std::nullopt;
    if (entry->has_slot()) {
        const bool wide = entry->stored == Stored::wide;
        if (wide ? !metadata_.lattice || entry->slot < layout_.wide_start()
                 : entry->slot != layout_.slot_place(tile))
            return std::nullopt;
        encoded_.bytes.resize(sample_bytes(metadata_, *entry));
        shards_.read(entry->slot, encoded_.bytes);
    } else {
        encoded_.bytes.clear();
    }
    if (crc_of(*entry, encoded_.bytes) != entry->crc) return std::nullopt;
    if (!numbers.empty())
        decode_numbers(metadata_, *entry, encoded_.bytes.data(), 0, tile_count, numbers.data());
    return entry;
}

void ObtTileWriter::keep(const TileName& tile, const Entry& entry, std::span<const float> numbers) {
    put(tile, entry);
    if (entry.stored == Stored::wide)
        wide_end_ =
            std::max(wide_end_, entry.slot + (sample_bytes(metadata_, entry) + page - 1) / page * page);
    double least = 1, largest = 0;
    if (tile.level == 0)
        for (int row = margin; row < stored_tile_edge - margin; ++row)
            for (int column = margin; column < stored_tile_edge - margin; ++column) {
                const auto v =
                    static_cast<double>(numbers[static_cast<std::size_t>(row * stored_tile_edge + column)]);
                if (std::isnan(v)) continue;
                const bool first = least > largest;
                least = first ? v : std::min(least, v);
                largest = first ? v : std::max(largest, v);
            }
    count(tile, entry, least, largest);
}

void ObtTileWriter::read(std::uint32_t plane, int level, std::int64_t x, std::int64_t y, int columns,
                         int rows, std::span<float> out) {
    std::vector<float> numbers(tile_count);
    for (std::int64_t j = y / tile_samples; j <= (y + rows - 1) / tile_samples; ++j)
        for (std::int64_t i = x / tile_samples; i <= (x + columns - 1) / tile_samples; ++i) {
            if (!intact({plane, level, i, j}, numbers))
                std::fill(numbers.begin(), numbers.end(), std::numeric_limits<float>::quiet_NaN());
            const std::int64_t x0 = std::max(x, i * tile_samples);
            const std::int64_t x1 = std::min(x + columns, (i + 1) * tile_samples);
            for (std::int64_t row = std::max(y, j * tile_samples);
                 row < std::min(y + rows, (j + 1) * tile_samples); ++row) {
                const float* const from = numbers.data() +
                                          (row - j * tile_samples + margin) * stored_tile_edge +
                                          (x0 - i * tile_samples) + margin;
                std::copy(from, from + (x1 - x0), out.data() + (row - y) * columns + (x0 - x));
            }
        }
}

void ObtTileWriter::flush() {
    for (auto& [name, b] : blocks_) {
        if (!b.changed) continue;
        shards_.write(layout_.block_place(name), b.bytes);
        b.changed = false;
    }
    shards_.start_writeback();
}

/// Writes the checksums of the blocks below into a block, and the block; its own checksum.
std::uint32_t ObtTileWriter::close_block(const BlockName& name, std::vector<std::byte>* root) {
    std::vector<std::byte> bytes = block(name).bytes;
    for (std::uint32_t k = 0; k < block_pointers; ++k) {
        const BlockName child{name.plane, name.group + 1, (name.i << block_levels) + (k & 31U),
                              (name.j << block_levels) + (k >> block_levels)};
        std::byte* const pointer = bytes.data() + child.place_in_parent();
        if ((obt::get<std::uint64_t>(pointer) & low_48) != 0)
            obt::put(pointer + pointer_crc, close_block(child, nullptr));
    }
    shards_.write(layout_.block_place(name), bytes);
    if (root != nullptr) *root = bytes;
    return crc32c(bytes);
}

ObtMetadata ObtTileWriter::finish() {
    flush();
    HeaderPlaces places;
    places.complete = true;
    places.shard_bytes = shard_bytes_;
    places.file_bytes = wide_end_;
    places.roots.resize(metadata_.planes);
    metadata_.statistics.assign(metadata_.planes, {});
    std::vector<std::vector<std::byte>> roots(metadata_.planes);
    std::vector<float> numbers(tile_count);
    for (std::uint32_t p = 0; p < metadata_.planes; ++p) {
        const TileName coarsest{p, layout_.levels() - 1, 0, 0};
        places.roots[p] = {layout_.block_place({p, 0, 0, 0}), close_block({p, 0, 0, 0}, &roots[p])};
        // The mean of the coarsest level, whose samples at the edges stand for fewer finest ones.
        double sum = 0, weights = 0;
        if (intact(coarsest, numbers)) {
            const auto cover = [&](std::int64_t i, std::int64_t size) {
                const std::int64_t first = i << coarsest.level;
                return static_cast<double>(std::min(size, first + (std::int64_t{1} << coarsest.level)) -
                                           first);
            };
            for (std::int64_t j = 0; j < layout_.height(coarsest.level); ++j)
                for (std::int64_t i = 0; i < layout_.width(coarsest.level); ++i) {
                    const float v =
                        numbers[static_cast<std::size_t>((j + margin) * stored_tile_edge + i + margin)];
                    if (std::isnan(v)) continue;
                    const double weight = cover(i, metadata_.width) * cover(j, metadata_.height);
                    sum += weight * static_cast<double>(v);
                    weights += weight;
                }
        }
        const auto value = [&](double number) { return metadata_.offset + metadata_.scale * number; };
        ObtPlaneStatistics& s = metadata_.statistics[p];
        s.holes = statistics_[p].holes || !(weights > 0);
        if (any_[p]) {
            s.least = std::min(value(statistics_[p].least), value(statistics_[p].largest));
            s.largest = std::max(value(statistics_[p].least), value(statistics_[p].largest));
            s.mean = weights > 0 ? value(sum / weights) : s.least;
        }
    }
    metadata_.uuid = uuid_of(header_of(metadata_, places), roots);
    const std::uint64_t before = shards_of_file(name_);
    shards_.finish(places.file_bytes, header_of(metadata_, places));
    std::error_code ignored;
    for (std::uint64_t k = shards_of(places.file_bytes, shard_bytes_); k < before; ++k)
        std::filesystem::remove(shard_path(name_, k), ignored);
    return metadata_;
}

} // namespace obscura::terrain
