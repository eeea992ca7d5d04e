// SPDX-License-Identifier: Apache-2.0
// Render thread: the light of frames, of the one that is expected next before its trigger.
#pragma once

#include "core/camera/camera_counters.hpp"
#include "core/camera/frame.hpp"
#include "core/realtime/event_count.hpp"
#include "core/time.hpp"
#include "emulator/render/adaptive_frame.hpp"
#include "emulator/render/frame_light.hpp"
#include "emulator/render/kept_frames.hpp"
#include "emulator/render/quality_controller.hpp"
#include "renderer/render_work.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <thread>

namespace obscura {
class Clock;
}

namespace obscura::emulator {

/// Room for a frame whose rows have levels, with its halo; 0: none.
struct LevelStore {
    std::size_t floats = 0, pixels = 0, rows = 0;
    /// Memory for what is made of an earlier frame; empty: nothing is.
    std::function<std::unique_ptr<renderer::Workspace>()> make_workspace{};
};

/// Renders one frame at a time on a thread of its own, into one of two stores: while the detector reads the
/// light of a frame from one, the other takes that of the next. An expected frame that turns out to be at
/// another time or of other poses is made into that of the trigger in the other store: group of rows by
/// group, bodies are reprojected, or stay where they have moved within the tolerance; stars and small bodies
/// are drawn at their true places. One thread, which makes the frames, calls everything that is not stated
/// otherwise; nothing allocates after construction.
class RenderThread {
public:
    /// `blank`: a FrameLight whose vectors have room for any frame. `floats`: of a store; row blocks beyond
    /// it are left to the caller. `blocks`: renders them. `enter`: called first on the new thread. `levels`:
    /// of frames that adapt (FrameLight::adapts). `make_kept`: of frames that may be reprojected; empty: none
    /// are.
    RenderThread(const FrameLight& blank, std::size_t floats, BlockRenderer blocks, const Clock& clock,
                 const std::function<void()>& enter, const LevelStore& levels = {},
                 const KeptFrames::Make& make_kept = {});
    ~RenderThread();
    RenderThread(const RenderThread&) = delete;
    RenderThread& operator=(const RenderThread&) = delete;

    /// Before the first frame: what a frame of `height` rows takes at full quality on this machine.
    void expect_frame_time(std::int64_t frame_ns, std::int32_t height) noexcept;

    /// Lamps of a scene whose poses or edges are only predicted.
    static constexpr std::size_t max_lamps = 16;

    /// How far the light of the frame of a trigger may be from that of the expected one.
    struct Tolerance {
        double image_px = 0;      ///< apparent motion in the image, of live scenes
        std::int64_t time_ns = 0; ///< its rows come earlier or later
        double px_per_ns = 0;     ///< image motion of scenes that are not live
        bool exact_time = true;   ///< those are of no use at another time
    };
    /// Begins to render the frame that is expected next, which replaces an earlier one that was not claimed.
    /// Rendering begins at `not_before` (clock of the constructor): a frame that is claimed or replaced until
    /// then has not begun.
    void expect(const FrameLight& light, const Tolerance& tolerance, Time not_before = {}) noexcept;
    /// Stops rendering what no frame has claimed; it is discarded by the next expect() or claim().
    /// Thread-safe.
    void cancel() noexcept;

    /// Whether the last frame begun has been rendered.
    [[nodiscard]] bool ready() const noexcept {
        const std::uint32_t jobs = jobs_.load(std::memory_order_relaxed);
        const Store& last = stores_[(jobs + stores_.size() - 1) % stores_.size()];
        return jobs > 0 && last.ready.load(std::memory_order_acquire) == last.light.blocks.size();
    }

    /// A frame with `light` is made now, with the scene in the state `truth`: take() gives its light. If that
    /// is not the expected frame, what was rendered is discarded, and this one begins.
    void claim(const FrameLight& light, const GroundTruth& truth) noexcept;
    /// Waits for block `index` of the claimed frame and returns its light; empty if the caller must render
    /// it, or if `cancel` became true.
    [[nodiscard]] std::span<const float> take(std::size_t index, const std::atomic<bool>* cancel) noexcept;
    /// Waits until block `index` of the claimed frame is as good as it will be in time, and copies its light
    /// to `out`. False if the claimed frame has no levels, the caller must render the block, or `cancel`
    /// became true.
    [[nodiscard]] bool take_by_level(std::size_t index, std::span<float> out,
                                     const std::atomic<bool>* cancel) noexcept;
    /// Whether the rows of the claimed frame have levels.
    [[nodiscard]] bool has_levels() const noexcept { return claimed().adapts; }
    /// Describes the quality of the claimed frame, all blocks of which have been taken by level.
    void describe(FrameQuality& quality, const LightUse& use) noexcept {
        claimed().levels->describe(quality, use);
        last_error_ = static_cast<double>(quality.error_rms);
    }
    /// Largest apparent motion between what was rendered for the claimed frame and what it should show,
    /// pixels.
    [[nodiscard]] double error_px() const noexcept { return error_px_; }
    /// Describes the quality of the claimed frame, of `height` rows, if it was made from the expected one.
    void describe_moved(FrameQuality& quality, const LightUse& use, std::int32_t height) const noexcept;
    /// All blocks of the claimed frame have been taken: measures what is not known yet for the next.
    void end_claimed() noexcept {
        if (claimed().adapts) claimed().levels->try_last_resort();
    }
    /// True if all blocks of the claimed frame have been rendered here.
    [[nodiscard]] bool took_all() const noexcept {
        return claimed().ready.load(std::memory_order_acquire) == claimed().light.blocks.size();
    }
    /// What rendering the claimed frame has cost, if took_all().
    [[nodiscard]] const renderer::RenderWork& work() const noexcept { return claimed().work; }
    /// When its last block was ready, before it was reprojected.
    [[nodiscard]] Time ended() const noexcept { return claimed().ended; }

    /// True if a frame in the making uses that renderer. Thread-safe.
    [[nodiscard]] bool uses(const renderer::Renderer& renderer) const noexcept {
        return rendering_with_.load() == &renderer;
    }
    [[nodiscard]] AheadCounters counters() const noexcept;

private:
    /// State of a scene, as far as the light depends on it.
    struct State {
        GroundTruth truth;
        std::array<Pose, max_lamps> lamps;

        void note(const renderer::Renderer& renderer, Time t) noexcept;
    };
    /// Whether an expected frame still waits for the instant at which it may begin.
    enum class Hold : std::uint8_t { none, waiting, withdrawn };
    struct Store {
        FrameLight light;
        Time not_before; ///< see expect()
        std::atomic<Hold> hold{Hold::none};
        std::unique_ptr<AdaptiveFrame> levels; ///< null: no frame has them
        bool adapts = false;                   ///< `levels` has the light of this frame
        const Store* source = nullptr;         ///< store of the frame that this one is made from
        /// Groups of rows of such a frame stand within it, px; none: all do. Those chosen so far.
        std::optional<double> tolerance_px{};
        std::size_t groups_chosen = 0;
        std::vector<float> floats;
        std::vector<std::size_t> offsets;  ///< of each block that has room
        std::atomic<std::size_t> ready{0}; ///< blocks that are rendered
        std::atomic<bool> stopped{true};   ///< no further block follows
        std::atomic<bool> cancel{false};
        /// Live scenes: their states when rendering began and when it had ended, as many as are `seen`.
        std::array<State, 2> states;
        std::atomic<std::size_t> seen{0};
        renderer::RenderWork before; ///< the renderer's totals when the frame was begun
        // Valid when the last block is ready.
        renderer::RenderWork work;
        Time ended;
    };

    void run() noexcept;
    void render(Store& store) noexcept;
    void end(Store& store) noexcept;
    void begin(const FrameLight& light, Time not_before = {}, const Store* source = nullptr,
               std::optional<double> tolerance_px = {}) noexcept;
    [[nodiscard]] bool wait_to_begin(Store& store) noexcept;
    void note_kept(const Store& before) noexcept;
    static void take_from(Store& store, const Store& source) noexcept;
    [[nodiscard]] bool render_block(Store& store, std::size_t index) noexcept;
    void claim_levels(const FrameLight& light) noexcept;
    void discard() noexcept;
    void note_state(Store& store) noexcept;
    /// What the light in a store is to a frame.
    struct Match {
        enum class Use : std::uint8_t { none, as_it_is, with_true_stars, reprojected };
        Use use = Use::none;
        double error_px = 0;
    };
    [[nodiscard]] double lamp_change_px(const Store& store, const FrameLight& light,
                                        const GroundTruth& truth) const noexcept;
    [[nodiscard]] Match match(const Store& store, const FrameLight& light,
                              const GroundTruth& truth) const noexcept;
    [[nodiscard]] Store& store(std::uint32_t job) noexcept { return stores_[job % stores_.size()]; }
    [[nodiscard]] const Store& claimed() const noexcept { return stores_[claimed_job_ % stores_.size()]; }

    const Clock& clock_;
    BlockRenderer blocks_;
    QualityController controller_; ///< render thread only
    std::unique_ptr<renderer::Workspace> alone_;
    std::array<Store, 2> stores_;
    KeptFrames kept_;
    double last_error_ = 0;                  ///< FrameQuality::error_rms of the frame described last
    Tolerance tolerance_;                    ///< of the expected frame
    double error_px_ = 0;                    ///< of the claimed frame
    std::atomic<std::uint32_t> expected_{0}; ///< jobs begun with the expected frame; 0: none, or claimed
    std::uint32_t claimed_job_ = 0;          ///< number of the claimed job
    std::atomic<std::uint32_t> jobs_{0};     ///< begun so far
    std::atomic<bool> quit_{false};
    std::atomic<const renderer::Renderer*> rendering_with_{nullptr};
    EventCount changed_;   ///< blocks ready, or stopped
    EventCount withdrawn_; ///< a frame that waits to begin is not wanted any more
    std::atomic<std::uint64_t> begun_{0}, used_{0}, discarded_{0}, early_{0}, moved_{0};
    std::thread thread_;
};

} // namespace obscura::emulator
