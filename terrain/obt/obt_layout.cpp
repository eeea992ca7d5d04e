// SPDX-License-Identifier: Apache-2.0
#include "terrain/obt/obt_layout.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::terrain::obt {
namespace {

constexpr std::uint8_t holes_bit = 0x80;

} // namespace

std::string to_string(const TileName& tile) {
    return fmt::format("tile ({}, {}) of level {}, plane {}", tile.i, tile.j, tile.level, tile.plane);
}

double Entry::step() const {
    return std::ldexp(1.0, exponent);
}

EntryBytes bytes_of(const Entry& entry) {
    EntryBytes out{};
    const std::uint64_t state = static_cast<std::uint64_t>(entry.stored) | (entry.holes ? holes_bit : 0U);
    const auto exponent = static_cast<std::uint8_t>(entry.exponent);
    put(out.data(), entry.slot / page | state << 48 | std::uint64_t{exponent} << 56);
    put(out.data() + 8, entry.base);
    put(out.data() + 12, entry.least);
    put(out.data() + 14, entry.largest);
    put(out.data() + 16, entry.error);
    put(out.data() + entry_crc, entry.crc);
    return out;
}

std::optional<Entry> entry_of(const std::byte* at) {
    Entry e;
    const auto first = get<std::uint64_t>(at);
    e.slot = (first & low_48) * page;
    const auto state = static_cast<std::uint8_t>(first >> 48);
    if ((state & ~holes_bit) > static_cast<unsigned>(Stored::missing)) return std::nullopt;
    e.stored = static_cast<Stored>(state & ~holes_bit);
    e.holes = (state & holes_bit) != 0;
    e.exponent = static_cast<std::int8_t>(first >> 56);
    e.base = get<std::int32_t>(at + 8);
    e.least = get<std::uint16_t>(at + 12);
    e.largest = get<std::uint16_t>(at + 14);
    e.error = get<float>(at + 16);
    e.crc = get<std::uint32_t>(at + entry_crc);
    if (!(e.error >= 0 && std::isfinite(e.error)) || e.least > e.largest) return std::nullopt;
    return e;
}

Layout::Layout(const ObtMetadata& metadata, const std::string& name)
    : levels_(obt_levels(metadata.width, metadata.height)),
      width_(metadata.width),
      height_(metadata.height),
      planes_(metadata.planes),
      slot_bytes_((tile_count * terrain::bytes_of(metadata.type) + page - 1) / page * page) {
    // In long double: exact up to 2^64, and larger sizes are refused.
    long double bytes = static_cast<long double>(data_start);
    const auto add = [&](long double count, std::uint64_t each) {
        bytes += count * planes_ * static_cast<long double>(each);
        if (bytes > static_cast<long double>(max_bytes))
            throw InputError(
                fmt::format("{}: {} x {} samples in {} planes: a file of at most 2^60 bytes has fewer", name,
                            width_, height_, planes_));
    };
    std::uint64_t count = 0;
    for (int level = levels_ - 1; level >= 0; --level) {
        level_start_[static_cast<std::size_t>(level)] = count;
        const auto across = static_cast<std::uint64_t>(tiles_across(level));
        const auto down = static_cast<std::uint64_t>(tiles_down(level));
        add(static_cast<long double>(across) * static_cast<long double>(down), slot_bytes_);
        count += across * down * planes_;
    }
    directory_start_ = data_start + count * slot_bytes_;
    count = 0;
    for (int group = 0; group * block_levels < levels_; ++group) {
        group_start_[static_cast<std::size_t>(group)] = count;
        const int level = levels_ - 1 - group * block_levels;
        const auto blocks =
            static_cast<std::uint64_t>(tiles_across(level)) * static_cast<std::uint64_t>(tiles_down(level));
        add(static_cast<long double>(blocks), block_bytes);
        count += blocks * planes_;
    }
    wide_start_ = directory_start_ + count * block_bytes;
}

bool Layout::has(const TileName& tile) const {
    return tile.plane < planes_ && tile.level >= 0 && tile.level < levels_ && tile.i >= 0 && tile.j >= 0 &&
           tile.i < tiles_across(tile.level) && tile.j < tiles_down(tile.level);
}

std::uint64_t Layout::morton_rank(std::int64_t i, std::int64_t j, std::int64_t across, std::int64_t down) {
    std::uint64_t rank = 0;
    std::int64_t left = 0, top = 0; // of the square that holds (i, j)
    std::int64_t size = 1;
    while (size < std::max(across, down))
        size *= 2;
    const auto cells = [&](std::int64_t x, std::int64_t y, std::int64_t edge) {
        const std::int64_t w = std::clamp<std::int64_t>(across - x, 0, edge);
        const std::int64_t h = std::clamp<std::int64_t>(down - y, 0, edge);
        return static_cast<std::uint64_t>(w) * static_cast<std::uint64_t>(h);
    };
    while (size > 1) {
        size /= 2;
        const bool right = i >= left + size, below = j >= top + size;
        if (right || below) rank += cells(left, top, size);
        if (below) rank += cells(left + size, top, size);
        if (below && right) rank += cells(left, top + size, size);
        left += right ? size : 0;
        top += below ? size : 0;
    }
    return rank;
}

std::uint64_t Layout::slot_place(const TileName& tile) const {
    const std::uint64_t before =
        morton_rank(tile.i, tile.j, tiles_across(tile.level), tiles_down(tile.level)) * planes_ + tile.plane;
    return data_start + (level_start_[static_cast<std::size_t>(tile.level)] + before) * slot_bytes_;
}

BlockName Layout::block_of(const TileName& tile) const {
    const int depth = levels_ - 1 - tile.level;
    const int below = depth % block_levels;
    return {tile.plane, depth / block_levels, static_cast<std::uint32_t>(tile.i >> below),
            static_cast<std::uint32_t>(tile.j >> below)};
}

std::size_t Layout::place_in_block(const TileName& tile) const {
    const int below = (levels_ - 1 - tile.level) % block_levels;
    const std::size_t edge = std::size_t{1} << below;
    const std::size_t before = (edge * edge - 1) / 3;
    const auto i = static_cast<std::size_t>(tile.i) & (edge - 1);
    const auto j = static_cast<std::size_t>(tile.j) & (edge - 1);
    return (before + j * edge + i) * entry_bytes;
}

std::uint64_t Layout::block_place(const BlockName& block) const {
    const int level = levels_ - 1 - block.group * block_levels;
    const std::uint64_t before =
        (static_cast<std::uint64_t>(block.j) * static_cast<std::uint64_t>(tiles_across(level)) + block.i) *
            planes_ +
        block.plane;
    return directory_start_ + (group_start_[static_cast<std::size_t>(block.group)] + before) * block_bytes;
}

} // namespace obscura::terrain::obt
