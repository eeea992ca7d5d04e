// SPDX-License-Identifier: Apache-2.0
// One camera of the daemon with its frame pipeline, row release, transports, simulator and output lines.
#pragma once

#include "core/realtime/log.hpp"
#include "emulator/camera/camera.hpp"
#include "emulator/camera/frame_overlays.hpp"
#include "emulator/camera/output_lines.hpp"
#include "emulator/camera/releaser.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/record/recent_timing.hpp"
#include "emulator/record/timing_log.hpp"
#include "emulator/simulator/simulator_server.hpp"
#include "emulator/unit/assemble.hpp"
#include "emulator/unit/autostart.hpp"
#include "emulator/unit/pixel_probe.hpp"
#include "emulator/unit/statistics.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "images/writers/row_file.hpp"
#include "images/writers/shared_cards.hpp"
#include "sync/ptp_monitor.hpp"
#include "transports/transport.hpp"
#include "transports/watch/watch.hpp"

#include <nlohmann/json_fwd.hpp>

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Frames that transports lost which deliver every one, see Transport::delivers_all().
struct UndeliveredFrames {
    std::uint64_t frames = 0;
    std::string by{}; ///< kinds of those transports, "file, stimulator"
};

/// Asked several times a second while the start takes time, with the step and the share of it that is done;
/// false ends it.
using GoOn = std::function<bool(const char* step, double share)>;

/// Owns the parts of one camera. Trigger sources outside of it reach it through camera(). Thread-bound to the
/// main thread.
class CameraUnit {
public:
    /// Loads files and allocates; opens no device or socket. `log` and `ptp`, if any, must outlive the unit.
    /// Throws Error.
    CameraUnit(const emulator::DaemonConfig& config, const ThreadPlan& threads, LogRing& log,
               const sync::PtpMonitor* ptp);
    ~CameraUnit();
    CameraUnit(const CameraUnit&) = delete;
    CameraUnit& operator=(const CameraUnit&) = delete;

    /// Makes the tiles of terrains that the first frame needs and measures how fast it is rendered, before
    /// start(). `go_on` is called several times a second with the share that is done; false ends it. Returns
    /// whether it is done. Throws Error.
    bool load_tiles(const GoOn& go_on);
    /// Starts the transports. Throws Error; stop() then stops those that have started.
    void start();
    /// Starts the acquisition if no client can control it; or if that is configured, while none does.
    void begin();
    void stop();

    /// Sets the trigger source of steps of this camera's simulator; null: steps are refused.
    void step_with(sync::SoftwareTrigger* source);
    /// First half of a reload, which may fail: builds a changed scene while frames continue; `meanwhile` is
    /// called several times a second, and ends it by returning false. Returns the reason of a refusal, or
    /// empty. Throws Error.
    [[nodiscard]] std::string prepare(const emulator::DaemonConfig& next,
                                      const std::function<bool()>& meanwhile);
    /// Second half of a reload, which cannot fail: scene and late policy change from the next frame on.
    void apply_reload(const emulator::DaemonConfig& next);
    /// Discards the scene that prepare() built.
    void dismiss() { next_renderer_.reset(); }

    /// "ADDRESS:PORT" of the transport that serves the control port; "none" without a control port. Valid
    /// after start().
    [[nodiscard]] const std::string& address() const noexcept { return address_; }
    /// "ADDRESS:PORT" of the client that controls it; empty: none. Between start() and stop().
    [[nodiscard]] std::string controller() const;
    void tick();
    /// Sets the correction of the kernel's TAI offset.
    void set_tai_correction(TaiCorrection correction) noexcept {
        imaging_->clock.set_tai_correction(correction);
    }
    /// See Daemon::write_timing_to().
    void write_timing_to(const std::filesystem::path& file);
    /// Thread-safe; allocates.
    [[nodiscard]] UndeliveredFrames undelivered() const;
    /// Frames whose row in that file is missing.
    [[nodiscard]] std::uint64_t lost_timing_rows() const noexcept {
        return timing_file_ ? timing_file_->lost_rows() : 0;
    }

    /// Runs `work` where no client of a transport changes the camera meanwhile, with the address of the
    /// client that controls it (empty: none), and returns once it has run. Rethrows what it throws. Between
    /// start() and stop(); thread-safe.
    void run_between_commands(const transports::Transport::ControlWork& work);
    /// Where simulators send poses and steps; null: no port.
    [[nodiscard]] SimulatorServer* simulator() noexcept { return simulator_.get(); }

    /// Frames for viewers; null: neither calls nor monitor.frames.
    [[nodiscard]] transports::WatchTransport* watch() const noexcept { return watch_; }

    /// Injected faults of its transports; null: there are none. Between start() and stop().
    [[nodiscard]] transports::FaultRules* fault_rules() const noexcept;
    /// Features of the control protocol of its transports; null: there is none. Between start() and stop().
    [[nodiscard]] transports::DeviceFeatures* device_features() const noexcept;
    /// Time stamps of the newest frames.
    [[nodiscard]] const RecentTiming& recent_timing() const noexcept { return recent_timing_; }

    /// The scene that a frame was made of; none: it has been replaced since, or the frame is too old.
    /// Thread-safe.
    [[nodiscard]] std::optional<FrameScene> scene_of(const FrameInfo& frame) const;
    /// Thread-safe.
    [[nodiscard]] FrameOverlays& overlays() noexcept { return *overlays_; }

    /// What a pixel probe of a frame needs besides the frame.
    struct ProbeSource {
        std::shared_ptr<const scene::Scene> scene; ///< the same object while the scene is the same
        std::shared_ptr<const ProbeSettings> settings;
        FrameOrigin origin;
    };
    /// Throws service::Failure if the frame is of a scene that is not shown any more.
    [[nodiscard]] ProbeSource probe_source(const FrameInfo& frame);

    /// Scene that is shown, and rings of poses that a simulator sends; empty: there is none.
    [[nodiscard]] const scene::Scene& scene() const { return imaging_->renderer->scene(); }
    [[nodiscard]] const PoseRings& pose_rings() const noexcept { return imaging_->poses; }
    /// Largest distance of the last frame's scene time from those that the scene's files cover, s.
    /// Thread-safe.
    [[nodiscard]] double pose_age_s() const noexcept { return pose_age_s_.load(std::memory_order_relaxed); }
    /// Counters of the simulator port; none: there is none.
    [[nodiscard]] std::optional<SimulatorCounters> simulator_counters() const;

    /// Takes control away from the clients of its transports.
    void release_control();

    [[nodiscard]] std::string summary() const;
    /// Run word of the current or latest acquisition, see FrameMaker::run().
    [[nodiscard]] std::uint32_t run() const noexcept { return imaging_->maker->run(); }
    [[nodiscard]] nlohmann::ordered_json statistics(const SourceState& source) const;
    /// Heartbeats of all threads except the pipeline's (render, detector), for which see Camera::alive().
    [[nodiscard]] Heartbeats heartbeats() const;
    [[nodiscard]] Camera& camera() noexcept { return *camera_; }
    /// What TAI of its times comes from. Thread-safe.
    [[nodiscard]] TaiSource tai_source() const noexcept { return imaging_->clock.tai_source(); }
    [[nodiscard]] const Clock& clock() const noexcept { return imaging_->clock; }
    [[nodiscard]] const FramePool& pool() const noexcept { return *imaging_->pool; }

private:
    /// Logs once for each thing of a scene that frames show it at times its files do not cover, and once the
    /// presets of its materials that are out of range.
    void report_pose_ages();
    /// Logs when rendering begins to fail, and when it works again.
    void report_render_faults();
    /// Logs once what the author of the sensor's model should know, and once that values are replaced.
    void report_sensor_model();

    const bool uncontrolled_; ///< no client can start the acquisition
    const ThreadPlan threads_;
    TimingLog timing_;
    RecentTiming recent_timing_;
    std::optional<images::RowFile> timing_file_;
    bool stopped_ = false;
    std::unique_ptr<Imaging> imaging_;
    std::uint64_t scene_fingerprint_ = 0, next_fingerprint_ = 0;
    std::unique_ptr<renderer::Renderer> next_renderer_; ///< set between prepare() and apply_reload()
    /// A scene that was shown before.
    struct Retired {
        std::shared_ptr<renderer::Renderer> renderer;
        Time since; ///< see shown_since_
    };
    std::vector<Retired> retired_; ///< kept until no frame uses them
    mutable std::mutex scenes_;    ///< of retired_, shown_since_ and Imaging::renderer
    /// Cards of the scene's camera, for files; frames in progress at a reload may get those of the next
    /// scene.
    std::shared_ptr<images::SharedCards> lens_cards_;
    std::unique_ptr<Releaser> releaser_;
    std::unique_ptr<Camera> camera_;
    std::unique_ptr<Autostart>
        autostart_; ///< null: only clients start the acquisition, or no control port is open
    std::vector<std::unique_ptr<transports::Transport>> transports_;
    transports::WatchTransport* watch_ = nullptr; ///< the last one of them
    std::unique_ptr<SimulatorServer> simulator_;
    std::unique_ptr<FrameOverlays> overlays_;
    std::shared_ptr<const ProbeSettings> probe_settings_;
    std::weak_ptr<const scene::Scene> probed_scene_; ///< copy of the scene that is shown
    Time shown_since_; ///< scheduling clock; frames that are prepared later show it
    std::unique_ptr<OutputLines> outputs_;
    std::string address_ = "none";
    std::atomic<double> pose_age_s_{0};
    std::vector<std::string> reported_ages_; ///< AgedPoses::key of what was logged for this scene
    bool presets_judged_ = false;            ///< presets_out_of_range() of this scene was logged
    bool sensor_judged_ = false;             ///< sensor_model_warnings() were logged
    bool replacing_seen_ = false;            ///< that values of the model are replaced was logged
    std::uint64_t faults_seen_ = 0;          ///< RenderFaults::count() at the last look
    Time fault_seen_;                        ///< when it was seen to grow last; 0: rendering works
    std::mutex commands_;                    ///< of run_between_commands() without a control thread
};

} // namespace obscura::emulator
