// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/paged_texture.hpp"

#include "core/error.hpp"
#include "core/io/memory_budget.hpp"
#include "core/realtime/log.hpp"
#include "terrain/obt/half.hpp"
#include "terrain/obt/obt_reduction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <optional>

namespace obscura::renderer {

using namespace terrain;
using obt::stored_tile_edge;
using obt::tile_count;
using obt::tile_samples;

namespace {

constexpr std::size_t ways = 8;
constexpr std::size_t max_requested = 1024;
constexpr std::uint64_t no_key = 0;
constexpr auto loader_period = std::chrono::milliseconds(2);

/// Level (6 bits) and tile (29 bits each) as one number, never 0.
std::uint64_t page_key(std::size_t level, std::int64_t i, std::int64_t j) {
    return std::uint64_t{level + 1} << 58 | static_cast<std::uint64_t>(j) << 29 |
           static_cast<std::uint64_t>(i);
}
constexpr std::uint64_t low_29 = (std::uint64_t{1} << 29) - 1;

std::uint64_t mixed_samples(std::uint64_t key) {
    key = (key ^ key >> 31) * 0xBF58476D1CE4E5B9;
    return key ^ key >> 29;
}

std::uint32_t bits_of(float number) {
    return std::bit_cast<std::uint32_t>(number);
}

} // namespace

/// Tile of all planes: per plane tile_count numbers of the type of the file, or one for a constant tile.
struct PagedTexture::Slot {
    std::atomic<std::uint64_t> key{no_key};
    std::atomic<std::uint32_t> sequence{0}; ///< odd while the contents change
    std::atomic<std::uint32_t> used{0};     ///< time of the last use
    std::atomic<bool> absent{false};        ///< the file has the coarser level only
    /// Planes of one number each: its bits as f32.
    std::array<std::atomic<std::uint32_t>, max_obt_planes> number{};
    std::array<std::atomic<bool>, max_obt_planes> constant{};
};

struct PagedTexture::Cache {
    Cache(std::size_t slot_count, std::size_t bytes_per_slot)
        : slots(slot_count), slot_words(bytes_per_slot / 4), words(slot_count * slot_words) {}

    /// The slot that holds the tile; null: none.
    [[nodiscard]] Slot* find(std::uint64_t key) {
        Slot* const set = set_of(key);
        for (std::size_t k = 0; k < ways; ++k)
            if (set[k].key.load(std::memory_order_acquire) == key) return set + k;
        return nullptr;
    }
    [[nodiscard]] Slot* set_of(std::uint64_t key) {
        return slots.data() + mixed_samples(key) % (slots.size() / ways) * ways;
    }
    [[nodiscard]] std::uint32_t* words_of(const Slot& slot) {
        return words.data() + static_cast<std::size_t>(&slot - slots.data()) * slot_words;
    }

    std::vector<Slot> slots;
    std::size_t slot_words;
    std::vector<std::uint32_t> words; ///< written and read as atomics
    std::array<std::atomic<std::uint64_t>, max_requested> wanted{};
    std::atomic<std::uint32_t> time{1};
};

PagedTexture::PagedTexture(std::shared_ptr<const ObtFile> file, std::size_t cache_bytes)
    : file_(std::move(file)) {
    const ObtMetadata& m = file_->metadata();
    if (m.lattice)
        throw InputError(fmt::format("{}: numbers in steps by tile: textures need u8, i16, u16, f16 or f32",
                                     file_->name()));
    if (std::max(m.width, m.height) > std::int64_t{tile_samples} << 29)
        throw InputError(fmt::format("{}: {} x {} texels: a texture has at most 2^37 each way", file_->name(),
                                     m.width, m.height));
    for (std::uint32_t p = 0; p < m.planes; ++p)
        if (file_->statistics(p).holes)
            throw InputError(
                fmt::format("{}: samples of plane {} are missing: textures need all", file_->name(), p));
    const auto axis = [](std::int64_t size, int level) {
        Axis a;
        a.count = ((size - 1) >> level) + 1;
        a.size = std::ldexp(static_cast<double>(size), -level);
        const auto last = static_cast<double>(a.count - 1);
        a.last_centre = 0.5 * (last + a.size) - 0.5;
        return a;
    };
    paged_levels_ = static_cast<std::size_t>(file_->levels() - 1);
    for (int level = 0;; ++level) {
        Level l{axis(m.width, level), axis(m.height, level), {}};
        const bool last = l.across.count == 1 && l.down.count == 1;
        levels_.push_back(std::move(l));
        if (last) break;
    }
    // The coarsest level of the file, and means of it.
    for (std::uint32_t p = 0; p < m.planes; ++p) {
        obt::SampleBlock block;
        block.level = file_->levels() - 1;
        block.columns = static_cast<int>(file_->width(block.level));
        block.rows = static_cast<int>(file_->height(block.level));
        const ObtTile tile = file_->tile({p, block.level, 0, 0});
        if (tile.entry.stored == obt::Stored::absent)
            throw InputError(fmt::format("{}: plane {} has no samples", file_->name(), p));
        std::vector<float> numbers(tile_count);
        obt::decode_numbers(m, tile.entry, tile.samples.data(), 0, tile_count, numbers.data());
        for (int row = 0; row < block.rows; ++row) {
            const auto first = numbers.begin() + (row + obt::margin) * stored_tile_edge + obt::margin;
            block.samples.insert(block.samples.end(), first, first + block.columns);
        }
        for (std::size_t level = paged_levels_; level < levels_.size(); ++level) {
            std::vector<float>& texels = levels_[level].texels;
            texels.insert(texels.end(), block.samples.begin(), block.samples.end());
            if (level + 1 == levels_.size()) break;
            obt::SampleBlock coarser;
            obt::reduce(block, Registration::pixel, m.width, m.height, coarser);
            block = std::move(coarser);
        }
    }
    if (paged_levels_ == 0) return;
    std::uint64_t tiles = 0; // no more slots than there are tiles, at even distribution twice as many
    for (int level = 0; level < file_->levels(); ++level)
        tiles += 2 * static_cast<std::uint64_t>(file_->layout().tiles_across(level)) *
                 static_cast<std::uint64_t>(file_->layout().tiles_down(level));
    const std::size_t slot_bytes = static_cast<std::size_t>(file_->layout().slot_bytes()) * m.planes;
    const std::size_t sets = std::max<std::size_t>(
        2, static_cast<std::size_t>(std::min<std::uint64_t>(cache_bytes / slot_bytes, tiles)) / ways);
    require_memory(sets * ways * slot_bytes, file_->name());
    cache_ = std::make_unique<Cache>(sets * ways, slot_bytes);
}

PagedTexture::~PagedTexture() {
    stop_ = true;
    if (loader_.joinable()) loader_.join();
}

std::size_t PagedTexture::bytes() const {
    std::size_t texels = cache_ ? cache_->words.size() : 0;
    for (const Level& level : levels_)
        texels += level.texels.size();
    return texels * sizeof(float);
}

void PagedTexture::set_waiting(bool waiting) {
    waiting_ = waiting;
    if (!waiting && cache_ && !loader_.joinable()) loader_ = std::thread([this] { run_loader(stop_); });
}

PagedTexture::Pair PagedTexture::pair_at(const Axis& axis, double position, bool repeat) {
    const std::int64_t last = axis.count - 1;
    // From the last texel's centre to that of the first one, a turn on.
    const double gap = axis.size - axis.last_centre;
    if (position < 0) {
        if (!repeat) return {0, 0, 0};
        return {last, 0, std::max(0.0, (position + gap) / gap)};
    }
    if (position >= axis.last_centre) {
        if (!repeat) return {last, last, 0};
        return {last, 0, std::min(1.0, (position - axis.last_centre) / gap)};
    }
    const double left = std::floor(position);
    auto first = static_cast<std::int64_t>(left);
    if (first >= last - 1 && last > 0) { // the last texel's centre may be nearer
        first = last - 1;
        const auto from = static_cast<double>(first);
        return {first, last, (position - from) / (axis.last_centre - from)};
    }
    return {first, first + 1, position - left};
}

void PagedTexture::add_bilinear(std::size_t level, double u, double v, Repeats repeats, double weight,
                                double* out) const {
    for (std::size_t k = level; k < levels_.size(); ++k) {
        const Level& l = levels_[k];
        const Pair across = pair_at(l.across, u * l.across.size - 0.5, repeats.u);
        const Pair down = pair_at(l.down, v * l.down.size - 0.5, repeats.v);
        if (try_level(k, across, down, weight, out)) return;
        if (k == level && !waiting_.load(std::memory_order_relaxed))
            coarser_.fetch_add(1, std::memory_order_relaxed);
    }
}

bool PagedTexture::try_level(std::size_t level, const Pair& across, const Pair& down, double weight,
                             double* out) const {
    const std::size_t planes = file_->metadata().planes;
    if (level >= paged_levels_) {
        const Level& l = levels_[level];
        const auto w = static_cast<std::size_t>(l.across.count), h = static_cast<std::size_t>(l.down.count);
        const auto x0 = static_cast<std::size_t>(across.first), x1 = static_cast<std::size_t>(across.second);
        for (std::size_t p = 0; p < planes; ++p) {
            const float* const upper = l.texels.data() + (p * h + static_cast<std::size_t>(down.first)) * w;
            const float* const lower = l.texels.data() + (p * h + static_cast<std::size_t>(down.second)) * w;
            const auto mix = [&](const float* row) {
                return (1 - across.share) * static_cast<double>(row[x0]) +
                       across.share * static_cast<double>(row[x1]);
            };
            out[p] += weight * ((1 - down.share) * mix(upper) + down.share * mix(lower));
        }
        return true;
    }
    std::array<double, max_obt_planes> sum{};
    // Neighbours are in one tile with its margin, but for those across the seam.
    const auto adjacent = [](const Pair& pair) {
        return pair.second == pair.first || pair.second == pair.first + 1;
    };
    bool whole = true;
    if (adjacent(across) && adjacent(down)) {
        whole = add_texels(level, across, down, 1, sum.data());
    } else {
        for (int k = 0; k < 4 && whole; ++k) {
            const std::int64_t x = k % 2 == 0 ? across.first : across.second;
            const std::int64_t y = k / 2 == 0 ? down.first : down.second;
            const double share =
                (k % 2 == 0 ? 1 - across.share : across.share) * (k / 2 == 0 ? 1 - down.share : down.share);
            whole = add_texels(level, {x, x, 0}, {y, y, 0}, share, sum.data());
        }
    }
    if (!whole) return false;
    for (std::size_t p = 0; p < planes; ++p)
        out[p] += weight * sum[p];
    return true;
}

bool PagedTexture::add_texels(std::size_t level, const Pair& across, const Pair& down, double weight,
                              double* out) const {
    const ObtMetadata& m = file_->metadata();
    const std::int64_t i = across.first / tile_samples, j = down.first / tile_samples;
    const auto x0 = static_cast<std::size_t>(across.first - i * tile_samples + obt::margin);
    const auto y0 = static_cast<std::size_t>(down.first - j * tile_samples + obt::margin);
    const std::size_t right = across.second == across.first ? 0 : 1,
                      below = down.second == down.first ? 0 : 1;
    const std::size_t first = y0 * stored_tile_edge + x0;
    const std::array<std::size_t, 4> places{first, first + right, first + below * stored_tile_edge,
                                            first + below * stored_tile_edge + right};
    const std::uint64_t key = page_key(level, i, j);
    while (true) {
        Slot* const slot = cache_->find(key);
        if (slot == nullptr) {
            if (!waiting_.load(std::memory_order_relaxed)) {
                std::atomic<std::uint64_t>& wanted = cache_->wanted[mixed_samples(key) / 7 % max_requested];
                if (wanted.load(std::memory_order_relaxed) != key)
                    wanted.store(key, std::memory_order_relaxed);
                return false;
            }
            load(key);
            continue;
        }
        const std::uint32_t before = slot->sequence.load(std::memory_order_acquire);
        std::array<double, max_obt_planes> sum{};
        std::uint32_t* const words = cache_->words_of(*slot);
        const std::size_t plane_words = static_cast<std::size_t>(file_->layout().slot_bytes()) / 4;
        const bool absent = slot->absent.load(std::memory_order_relaxed);
        for (std::size_t p = 0; p < m.planes && !absent; ++p) {
            std::array<double, 4> t{};
            if (slot->constant[p].load(std::memory_order_relaxed)) {
                t.fill(static_cast<double>(
                    std::bit_cast<float>(slot->number[p].load(std::memory_order_relaxed))));
            } else {
                for (std::size_t k = 0; k < t.size(); ++k) {
                    const std::size_t per_word = 4 / bytes_of(m.type);
                    const std::uint32_t word =
                        std::atomic_ref<std::uint32_t>(words[p * plane_words + places[k] / per_word])
                            .load(std::memory_order_relaxed);
                    const auto shift = static_cast<unsigned>(places[k] % per_word * 8 * bytes_of(m.type));
                    switch (m.type) {
                    case SampleType::u8:
                        t[k] = word >> shift & 0xFFU;
                        break;
                    case SampleType::i16:
                        t[k] = static_cast<std::int16_t>(word >> shift);
                        break;
                    case SampleType::u16:
                        t[k] = static_cast<std::uint16_t>(word >> shift);
                        break;
                    case SampleType::f16:
                        t[k] = static_cast<double>(float_of_half(static_cast<std::uint16_t>(word >> shift)));
                        break;
                    case SampleType::f32:
                        t[k] = static_cast<double>(std::bit_cast<float>(word));
                        break;
                    }
                }
            }
            const double upper = (1 - across.share) * t[0] + across.share * t[1];
            const double lower = (1 - across.share) * t[2] + across.share * t[3];
            sum[p] = (1 - down.share) * upper + down.share * lower;
        }
        std::atomic_thread_fence(std::memory_order_acquire);
        if ((before & 1U) != 0 || slot->sequence.load(std::memory_order_relaxed) != before ||
            slot->key.load(std::memory_order_relaxed) != key) {
            if (!waiting_.load(std::memory_order_relaxed)) return false;
            continue;
        }
        const std::uint32_t now = cache_->time.load(std::memory_order_relaxed);
        if (slot->used.load(std::memory_order_relaxed) != now)
            slot->used.store(now, std::memory_order_relaxed);
        if (absent) return false;
        for (std::size_t p = 0; p < m.planes; ++p)
            out[p] += weight * sum[p];
        return true;
    }
}

void PagedTexture::load(std::uint64_t key) const {
    const ObtMetadata& m = file_->metadata();
    const int level = static_cast<int>(key >> 58) - 1;
    const auto i = static_cast<std::int64_t>(key & low_29), j = static_cast<std::int64_t>(key >> 29 & low_29);
    // Read first, and take the lock then: threads read at the same time, seldom the same tile.
    std::vector<ObtTile> tiles;
    bool absent = false;
    for (std::uint32_t p = 0; p < m.planes; ++p) {
        tiles.push_back(file_->tile({p, level, i, j}));
        absent = absent || tiles.back().entry.stored == obt::Stored::absent;
        if (tiles.back().entry.holes || tiles.back().entry.stored == obt::Stored::missing)
            throw InputError(fmt::format("{}: {}: samples are missing, which its header denies",
                                         file_->name(), to_string(obt::TileName{p, level, i, j})));
    }
    const std::lock_guard lock(loading_);
    if (cache_->find(key) != nullptr) return;
    Slot* const set = cache_->set_of(key);
    Slot* slot = set;
    for (std::size_t k = 0; k < ways; ++k) {
        if (set[k].key.load(std::memory_order_relaxed) == no_key) {
            slot = set + k;
            break;
        }
        if (set[k].used.load(std::memory_order_relaxed) < slot->used.load(std::memory_order_relaxed))
            slot = set + k;
    }
    const std::uint32_t sequence = slot->sequence.load(std::memory_order_relaxed);
    slot->sequence.store(sequence + 1, std::memory_order_relaxed);
    std::atomic_thread_fence(std::memory_order_release);
    slot->key.store(no_key, std::memory_order_relaxed);
    slot->absent.store(absent, std::memory_order_relaxed);
    std::uint32_t* words = cache_->words_of(*slot);
    for (std::uint32_t p = 0; p < m.planes && !absent; ++p) {
        const ObtTile& tile = tiles[p];
        const bool constant = tile.entry.stored == obt::Stored::constant;
        slot->constant[p].store(constant, std::memory_order_relaxed);
        if (constant) {
            float number = 0;
            obt::decode_numbers(m, tile.entry, nullptr, 0, 1, &number);
            slot->number[p].store(bits_of(number), std::memory_order_relaxed);
        }
        // Little endian as in the file; add_texels() takes the numbers out of the words by shifts.
        for (std::size_t k = 0; k < tile.samples.size() / 4; ++k)
            std::atomic_ref<std::uint32_t>(words[k]).store(
                obt::get<std::uint32_t>(tile.samples.data() + 4 * k), std::memory_order_relaxed);
        words += file_->layout().slot_bytes() / 4;
    }
    slot->used.store(cache_->time.fetch_add(1, std::memory_order_relaxed), std::memory_order_relaxed);
    slot->sequence.store(sequence + 2, std::memory_order_release);
    slot->key.store(key, std::memory_order_release);
}

void PagedTexture::run_loader(const std::atomic<bool>& stop) const {
    bool told = false;
    std::vector<std::uint64_t> keys;
    while (!stop) {
        keys.clear();
        for (std::atomic<std::uint64_t>& wanted : cache_->wanted)
            if (const std::uint64_t key = wanted.exchange(no_key, std::memory_order_relaxed); key != no_key)
                keys.push_back(key);
        // Coarse levels first.
        std::sort(keys.begin(), keys.end(), std::greater<>());
        for (const std::uint64_t key : keys) {
            if (stop) return;
            try {
                if (cache_->find(key) == nullptr) load(key);
            } catch (const std::exception& e) {
                if (!told) log_line(LogLevel::error, e.what(), "TEXTURE: WHY");
                told = true;
            }
        }
        if (keys.empty()) std::this_thread::sleep_for(loader_period);
    }
}

} // namespace obscura::renderer
