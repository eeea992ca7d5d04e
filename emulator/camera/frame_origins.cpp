// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/frame_origins.hpp"

#include <algorithm>
#include <bit>

namespace obscura::emulator {
namespace {

std::uint64_t word_of(std::int64_t value) noexcept {
    return static_cast<std::uint64_t>(value);
}
std::int64_t signed_of(std::uint64_t word) noexcept {
    return static_cast<std::int64_t>(word);
}

} // namespace

void FrameOrigins::note(const FrameOrigin& origin) noexcept {
    const std::array<std::uint64_t, word_count> values{origin.frame_id,
                                                       word_of(origin.trigger_edge.ns),
                                                       reinterpret_cast<std::uintptr_t>(origin.renderer),
                                                       word_of(origin.scene_to_clock_ns),
                                                       word_of(origin.shown.planned.ns),
                                                       word_of(origin.shown.shown.ns),
                                                       std::bit_cast<std::uint64_t>(origin.shown.rate),
                                                       std::bit_cast<std::uint64_t>(origin.black_level_dn),
                                                       origin.pattern ? 1U : 0U};
    const std::uint64_t count = count_.load(std::memory_order_relaxed);
    Cell& cell = cells_[count % capacity];
    // Every access is ordered by itself, because ThreadSanitizer does not understand fences.
    cell.sequence.fetch_add(1, std::memory_order_acq_rel);
    for (std::size_t i = 0; i < word_count; ++i)
        cell.words[i].store(values[i], std::memory_order_release);
    cell.sequence.fetch_add(1, std::memory_order_acq_rel);
    count_.store(count + 1, std::memory_order_release);
}

std::optional<FrameOrigin> FrameOrigins::find(std::uint64_t frame_id, Time trigger_edge) const noexcept {
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    for (std::uint64_t n = count; n > count - std::min<std::uint64_t>(count, capacity); --n) {
        const Cell& cell = cells_[(n - 1) % capacity];
        const std::uint64_t before = cell.sequence.load(std::memory_order_acquire);
        std::array<std::uint64_t, word_count> v{};
        for (std::size_t i = 0; i < word_count; ++i)
            v[i] = cell.words[i].load(std::memory_order_acquire);
        // One that is overwritten meanwhile is too old.
        if (before % 2 != 0 || cell.sequence.load(std::memory_order_acquire) != before) continue;
        if (v[0] != frame_id || signed_of(v[1]) != trigger_edge.ns) continue;
        FrameOrigin origin;
        origin.frame_id = frame_id;
        origin.trigger_edge = trigger_edge;
        origin.renderer =
            reinterpret_cast<const renderer::Renderer*>(v[2]); // NOLINT(performance-no-int-to-ptr)
        origin.scene_to_clock_ns = signed_of(v[3]);
        origin.shown = {Time{signed_of(v[4])}, Time{signed_of(v[5])}, std::bit_cast<double>(v[6])};
        origin.black_level_dn = std::bit_cast<double>(v[7]);
        origin.pattern = v[8] != 0;
        return origin;
    }
    return std::nullopt;
}

} // namespace obscura::emulator
