// SPDX-License-Identifier: Apache-2.0
#include "core/camera/frame.hpp"

#include "core/camera/scene_truth.hpp"
#include "core/clock.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cstring>

namespace obscura {

static_assert(std::endian::native == std::endian::little, "pixels are packed little endian by plain copies");

void Frame::publish_rows(std::int32_t rows) noexcept {
    assert(rows >= rows_ready() && rows <= info.height);
    progress_.store(static_cast<std::uint32_t>(rows), std::memory_order_release);
    notify_waiters();
}

void Frame::notify_waiters() noexcept {
    progressed_.notify();
    for (std::atomic<EventCount*>& place : waiters_)
        if (EventCount* waiter = place.load(std::memory_order_acquire)) waiter->notify();
}

bool Frame::add_waiter(EventCount& waiter) noexcept {
    for (std::atomic<EventCount*>& place : waiters_) {
        EventCount* free = nullptr;
        if (place.compare_exchange_strong(free, &waiter, std::memory_order_acq_rel)) return true;
    }
    return false;
}

void Frame::abandon() noexcept {
    if (complete()) return;
    flags.fetch_or(frame_partial, std::memory_order_relaxed);
    progress_.fetch_or(abandoned_bit, std::memory_order_acq_rel);
    notify_waiters();
}

std::int32_t Frame::wait_rows(std::int32_t rows, Heartbeat* heartbeat) const noexcept {
    for (;;) {
        const std::uint32_t notified = progressed_.value();
        const std::uint32_t seen = progress_.load(std::memory_order_acquire);
        if ((seen & abandoned_bit) != 0 || static_cast<std::int32_t>(seen) >= rows)
            return static_cast<std::int32_t>(seen & ~abandoned_bit);
        if (heartbeat != nullptr) {
            heartbeat->beat();
            progressed_.wait(notified, MonotonicClock().now() + Heartbeat::max_wait_ns);
        } else {
            progressed_.wait(notified);
        }
    }
}

/// Poses for which a frame's truth table has room; more need the heap once.
constexpr std::size_t scene_poses_kept = 64;

FramePool::FramePool(std::size_t frames, std::size_t max_pixels, std::size_t max_rows, KeptTruth truth)
    : count_(frames),
      max_pixels_(max_pixels),
      max_rows_(max_rows),
      // Value-initialise, so that the pages are faulted in now and not by the first frame.
      pixel_store_(std::make_unique<std::uint16_t[]>(frames * max_pixels)),
      row_store_(std::make_unique<RowTime[]>(frames * max_rows)),
      truth_store_(truth.pixels ? frames : 0),
      scene_truth_store_(truth.scene_entries > 0 ? std::make_shared<SceneTruth[]>(frames) : nullptr),
      frames_(std::make_unique<Frame[]>(frames)) {
    for (std::size_t i = 0; i < frames; ++i) {
        frames_[i].pixels_ = pixel_store_.get() + i * max_pixels;
        frames_[i].row_times_ = row_store_.get() + i * max_rows;
        frames_[i].max_pixels_ = max_pixels;
        frames_[i].max_rows_ = max_rows;
        if (truth.scene_entries > 0) {
            SceneTruth& scene = scene_truth_store_[i];
            scene.entries.reserve(truth.scene_entries);
            scene.poses.reserve(scene_poses_kept);
            frames_[i].scene_truth_ = &scene;
        }
        if (!truth.pixels) continue;
        truth_store_[i].mean_e.resize(max_pixels);
        truth_store_[i].saturated.resize(max_pixels);
        truth_store_[i].hits.reserve(PixelTruth::hits_kept);
        frames_[i].pixel_truth_ = &truth_store_[i];
    }
}

FrameRef FramePool::acquire() noexcept {
    const std::size_t start = next_.fetch_add(1, std::memory_order_relaxed);
    for (std::size_t i = 0; i < count_; ++i) {
        Frame& frame = frames_[(start + i) % count_];
        std::uint32_t free = 0;
        if (frame.references_.compare_exchange_strong(free, 1, std::memory_order_acq_rel)) {
            frame.info = FrameInfo{};
            for (std::atomic<EventCount*>& place : frame.waiters_)
                place.store(nullptr, std::memory_order_relaxed);
            frame.scene_truth_final_.store(false, std::memory_order_relaxed);
            frame.flags.store(0, std::memory_order_relaxed);
            frame.saturated_windows.store(0, std::memory_order_relaxed);
            frame.progress_.store(0, std::memory_order_release);
            return FrameRef(&frame);
        }
    }
    return {};
}

std::size_t FramePool::in_use() const noexcept {
    return static_cast<std::size_t>(std::count_if(frames_.get(), frames_.get() + count_, [](const Frame& f) {
        return f.references_.load(std::memory_order_relaxed) != 0;
    }));
}

namespace {

struct FormatLayout {
    int bits;    // significant bits
    bool packed; // bits follow each other without padding
};

constexpr FormatLayout layout_of(PixelFormat format) noexcept {
    switch (format) {
    case PixelFormat::mono8:
        return {8, false};
    case PixelFormat::mono10:
        return {10, false};
    case PixelFormat::mono12:
        return {12, false};
    case PixelFormat::mono14:
        return {14, false};
    case PixelFormat::mono10p:
        return {10, true};
    case PixelFormat::mono12p:
        return {12, true};
    case PixelFormat::mono16:
        break;
    }
    return {16, false};
}

} // namespace

int significant_bits(PixelFormat format) noexcept {
    return layout_of(format).bits;
}

std::size_t packed_bytes(PixelFormat format, std::int64_t pixels) noexcept {
    const FormatLayout layout = layout_of(format);
    const auto n = static_cast<std::size_t>(pixels);
    if (layout.packed) return (n * static_cast<std::size_t>(layout.bits) + 7) / 8;
    return layout.bits == 8 ? n : 2 * n;
}

std::size_t packed_row_bytes(PixelFormat format, std::int32_t width) noexcept {
    return packed_bytes(format, width);
}

void pack_pixels(PixelFormat format, int bits, std::span<const std::uint16_t> pixels,
                 std::span<std::uint8_t> out) noexcept {
    assert(out.size() >= packed_bytes(format, static_cast<std::int64_t>(pixels.size())));
    const FormatLayout layout = layout_of(format);
    const int shift = std::max(0, bits - layout.bits);
    if (!layout.packed && layout.bits == 8) {
        for (std::size_t i = 0; i < pixels.size(); ++i)
            out[i] = static_cast<std::uint8_t>(pixels[i] >> shift);
    } else if (!layout.packed && shift == 0) {
        std::memcpy(out.data(), pixels.data(), pixels.size() * 2);
    } else if (!layout.packed) {
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            const auto value = static_cast<std::uint16_t>(pixels[i] >> shift);
            std::memcpy(out.data() + 2 * i, &value, 2);
        }
    } else {
        // PFNC "p" formats: least significant bit first, no gaps.
        std::uint64_t accumulator = 0;
        int held = 0;
        std::size_t at = 0;
        for (const std::uint16_t pixel : pixels) {
            accumulator |= static_cast<std::uint64_t>(pixel >> shift) << held;
            held += layout.bits;
            for (; held >= 8; held -= 8, accumulator >>= 8)
                out[at++] = static_cast<std::uint8_t>(accumulator);
        }
        if (held > 0) out[at] = static_cast<std::uint8_t>(accumulator);
    }
}

} // namespace obscura
