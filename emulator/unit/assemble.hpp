// SPDX-License-Identifier: Apache-2.0
// Factories from a configuration: frame pipeline, trigger sources, transports.
#pragma once

#include "core/clock.hpp"
#include "emulator/camera/camera.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/config/initial_camera.hpp"
#include "emulator/simulator/simulator_server.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "images/writers/shared_cards.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"
#include "sync/sync.hpp"
#include "transports/transport.hpp"

#include <functional>
#include <memory>
#include <span>
#include <vector>

namespace obscura::emulator {

/// Frame pipeline without triggers and transports: renderer, detector and frame pool. Enough for an offline
/// capture:
///
///     Imaging imaging(config);
///     const FrameRef frame = imaging.pool->acquire();
///     const std::string refusal = imaging.maker->make(imaging.nominal_order(1), *frame);
///
/// gives byte for byte the first frame that obscurad sends with the same configuration and run word.
struct Imaging {
    /// Loads everything that the scene needs. `pool_frames` frames of the whole sensor; `truth`: what they
    /// keep of it; `ahead`: whether frames may be rendered before their orders are complete; `real_time`:
    /// frames are due, and do not wait for tiles of terrains. Throws Error.
    Imaging(const DaemonConfig& config, std::size_t pool_frames, const ThreadPlan& threads = {},
            KeptTruth truth = {}, RenderAhead ahead = RenderAhead::off, bool real_time = false);

    /// Order of frame `frame_id` with the configured camera settings, at nominal trigger edges, which
    /// the scheduling clock counts from 0.
    [[nodiscard]] FrameOrder nominal_order(std::uint64_t frame_id) const;
    /// Prepares for `first` as the first frame made: plans the readouts of the frames before it, as far as
    /// its timing depends on them, and makes those whose image lag reaches it, at the levels that `levels`
    /// has for them (FrameMaker::set_levels()). Throws ConfigError.
    using LevelsOf = std::function<std::span<const QualityLevel>(std::uint64_t frame_id)>;
    void catch_up(std::uint64_t first, const LevelsOf& levels = {});
    /// Makes the tiles that a renderer needs for the whole sensor, at the time that the first frame of an
    /// acquisition shows that began now. See renderer::Renderer::load_tiles().
    bool load_tiles(const renderer::Renderer& of, const std::function<bool(double)>& go_on) const;

    /// Measures how fast this machine renders the first frame of a camera that adapts, and chooses its
    /// reserve by it. False: `go_on` ended it.
    bool measure_speed(const std::function<bool(double)>& go_on);

    MonotonicClock clock;
    CameraConfig camera;
    SceneClock nominal_scene{{}}; ///< of nominal_order()
    PoseRings poses;              ///< rings that a simulator writes to; empty without a simulator
    std::shared_ptr<renderer::Renderer> renderer; ///< shared with those that describe a frame
    std::unique_ptr<sensors::Detector> detector;
    std::unique_ptr<FrameMaker> maker;
    std::unique_ptr<FramePool> pool;

private:
    /// Rows of the whole sensor at the time that the first frame of an acquisition shows that began now, with
    /// an exposure.
    [[nodiscard]] std::vector<RowTime> first_rows(std::int64_t exposure_ns) const;
    [[nodiscard]] renderer::RenderRequest whole_sensor(std::span<const RowTime> rows) const;

    std::int32_t sensor_columns_ = 0, sensor_rows_ = 0;
    bool adapts_ = false;
    std::int64_t min_reserve_ns_ = 0;
};

/// Settings of the configuration that decide what a frame costs, for the timing file.
[[nodiscard]] RenderFacts render_facts(const DaemonConfig& config, const ThreadPlan& threads);

/// The configured quality of rendering, for `threads` threads; without hooks.
[[nodiscard]] renderer::RenderSettings render_settings(const DaemonConfig& config, std::size_t threads);

/// Makes the renderer of `scene`, weighted by the response of the configured sensor, with the configured
/// settings; `wait_for_tiles`: see renderer::RenderSettings. Throws Error.
[[nodiscard]] std::unique_ptr<renderer::Renderer>
make_renderer(const DaemonConfig& config, scene::Scene scene, const ThreadPlan& threads, bool wait_for_tiles);

/// Scene clock as configured. Throws ConfigError for a bad file of scene times.
[[nodiscard]] SceneClockSettings scene_clock_settings(const DaemonConfig& config);

/// Nominal rate of the line that triggers frames after reset (Line0 where none does) behind its divider.
[[nodiscard]] sync::RationalRate nominal_trigger_rate(const DaemonConfig& config);

/// Every transport the configuration enables, none of them started. `ptp_status` gives the state of the PTP
/// clock; empty: there is none. `camera_cards` go into the headers of files; null: none. Throws Error.
[[nodiscard]] std::vector<std::unique_ptr<transports::Transport>>
make_transports(const DaemonConfig& config, CameraControl& control, const Clock& clock,
                const ThreadPlan& threads, std::function<PtpStatus()> ptp_status,
                transports::ControlListener* listener = {},
                std::shared_ptr<const images::SharedCards> camera_cards = {});

/// Frames of the pool that the enabled transports and the pipeline may hold at one time; viewers come on top.
[[nodiscard]] std::size_t frames_needed(const DaemonConfig& config);

} // namespace obscura::emulator
