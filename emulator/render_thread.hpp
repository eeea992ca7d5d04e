// SPDX-License-Identifier: Apache-2.0
// Render thread: the light of frames, of the one that is expected next before its trigger.
#pragma once

#include "core/event_count.hpp"
#include "core/time.hpp"
#include "emulator/frame_light.hpp"
#include "renderer/render_work.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>

namespace obscura {
class Clock;
}

namespace obscura::emulator {

/// Outcomes of rendering ahead since construction: each frame begun is later used or discarded.
struct AheadCounters {
    std::uint64_t begun = 0;     ///< frames whose rendering began before their trigger
    std::uint64_t used = 0;      ///< confirmed by the trigger
    std::uint64_t discarded = 0; ///< other settings, another instant, or the trigger never came
    std::uint64_t early = 0;     ///< of `used`: all rows were ready at the trigger
};

/// Renders one frame at a time on a thread of its own, into one of two stores: while the detector reads the
/// light of a frame from one, the other takes that of the next. One thread, which makes the frames, calls
/// everything that is not stated otherwise; nothing allocates after construction.
class RenderThread {
public:
    /// `blank`: a FrameLight whose vectors have room for any frame. `floats`: of a store; row blocks beyond
    /// it are left to the caller. `blocks`: renders them. `enter`: called first on the new thread.
    RenderThread(const FrameLight& blank, std::size_t floats, BlockRenderer blocks, const Clock& clock,
                 const std::function<void()>& enter);
    ~RenderThread();
    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;

    /// Begins to render the frame that is expected next, which replaces an earlier one that was not claimed.
    /// It is the frame of a trigger whose rows come up to `tolerance_ns` earlier or later, too.
    void expect(const FrameLight& light, std::int64_t tolerance_ns) noexcept;
    /// Stops rendering what no frame has claimed; it is discarded by the next expect() or claim().
    /// Thread-safe.
    void cancel() noexcept;

    /// A frame with `light` is made now: take() gives its light. If that is not the expected frame, what was
    /// rendered is discarded, and this one begins.
    void claim(const FrameLight& light) noexcept;
    /// Waits for block `index` of the claimed frame and returns its light; empty if the caller must render
    /// it, or if `cancel` became true.
    [[nodiscard]] std::span<const float> take(std::size_t index, const std::atomic<bool>* cancel) noexcept;
    /// By how much the rows of the claimed frame come later than those that it shows, ns.
    [[nodiscard]] std::int64_t later_ns() const noexcept { return later_ns_; }
    /// True if all blocks of the claimed frame have been rendered here.
    [[nodiscard]] bool took_all() const noexcept {
        return claimed().ready.load(std::memory_order_acquire) == claimed().light.blocks.size();
    }
    /// What rendering the claimed frame has cost, if took_all().
    [[nodiscard]] const renderer::RenderWork& work() const noexcept { return claimed().work; }
    /// When its last block was ready.
    [[nodiscard]] Time ended() const noexcept { return claimed().ended; }

    /// True if a frame in the making uses that renderer. Thread-safe.
    [[nodiscard]] bool uses(const renderer::Renderer& renderer) const noexcept {
        return rendering_with_.load() == &renderer;
    }
    [[nodiscard]] AheadCounters counters() const noexcept;

private:
    struct Store {
        FrameLight light;
        std::vector<float> floats;
        std::vector<std::size_t> offsets;  ///< of each block that has room
        std::atomic<std::size_t> ready{0}; ///< blocks that are rendered
        std::atomic<bool> stopped{true};   ///< no further block follows
        std::atomic<bool> cancel{false};
        // Valid when the last block is ready.
        renderer::RenderWork work;
        Time ended;
    };

    void run() noexcept;
    void render(Store& store) noexcept;
    void begin(const FrameLight& light) noexcept;
    void discard() noexcept;
    [[nodiscard]] Store& store(std::uint32_t job) noexcept { return stores_[job % stores_.size()]; }
    [[nodiscard]] const Store& claimed() const noexcept { return stores_[claimed_job_ % stores_.size()]; }

    const Clock& clock_;
    BlockRenderer blocks_;
    std::array<Store, 2> stores_;
    std::int64_t tolerance_ns_ = 0;          ///< of the expected frame
    std::int64_t later_ns_ = 0;              ///< of the claimed frame
    std::atomic<std::uint32_t> expected_{0}; ///< jobs begun with the expected frame; 0: none, or claimed
    std::uint32_t claimed_job_ = 0;          ///< number of the claimed job
    std::atomic<std::uint32_t> jobs_{0};     ///< begun so far
    std::atomic<bool> quit_{false};
    std::atomic<const renderer::Renderer*> rendering_with_{nullptr};
    EventCount changed_; ///< blocks ready, or stopped
    std::atomic<std::uint64_t> begun_{0}, used_{0}, discarded_{0}, early_{0};
    std::thread thread_;
};

} // namespace obscura::emulator
