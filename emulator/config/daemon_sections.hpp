// SPDX-License-Identifier: Apache-2.0
// The daemon's own sections: [daemon] [render] [deadline] [threads] [simulator] [outputs] [monitor]
// [models] [control].
#pragma once

#include "config/section.hpp"
#include "core/realtime/log.hpp"
#include "emulator/camera/scene_clock.hpp"
#include "emulator/render/policies.hpp"
#include "emulator/render/render_scheduling.hpp"
#include "service/permission.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

namespace obscura::emulator {

/// Whether threads get SCHED_FIFO and memory is locked.
enum class RealtimeMode : std::uint8_t {
    off,
    automatic, ///< where it is permitted
    required,  ///< the daemon does not start without
};
constexpr auto enum_names(RealtimeMode /*type*/) {
    return std::array{EnumName{RealtimeMode::off, "off"}, EnumName{RealtimeMode::automatic, "auto"},
                      EnumName{RealtimeMode::required, "required"}};
}

/// [daemon]
struct DaemonSection {
    LogLevel log_level = LogLevel::info;
    RealtimeMode realtime = RealtimeMode::automatic;
    std::int32_t pool_frames = 12;
    std::uint64_t seed = 1;
    std::int64_t run = -1; ///< run word; -1: random
    SceneTime scene_time = SceneTime::nominal;
    double scene_start_s = 0;
    double scene_rate = 1;
    std::string scene_times; ///< file; empty: none
    bool drop_capabilities = true;
    bool autostart = false;
    std::int32_t memory_limit_mib = 0;
};

/// Whether frames are rendered before their trigger.
enum class RenderAhead : std::uint8_t {
    off,
    automatic, ///< where the next frame is known
};
constexpr auto enum_names(RenderAhead /*type*/) {
    return std::array{EnumName{RenderAhead::off, "off"}, EnumName{RenderAhead::automatic, "auto"}};
}

/// [render]
struct RenderSection {
    std::int32_t samples_per_pixel = 4;
    double target_error = 0;
    std::int32_t max_samples_per_pixel = 64;
    std::int32_t max_instants = 256;
    std::int32_t threads = 0;
    std::int32_t band_rows = 64;
    RenderAhead ahead = RenderAhead::automatic;
    double ahead_ms = 0;
    double ahead_tolerance_px = 0.02;
};

/// [deadline]: rows that are not ready when the chip would have read them.
struct DeadlineSection {
    LatePolicy policy = LatePolicy::late;
    double grace_us = 0;
    double spin_us = 100;
    QualityPolicy quality = QualityPolicy::hold;
    double floor = 0.1;
    double reserve_us = 1000;
};

/// [threads]: SCHED_FIFO priorities (0: SCHED_OTHER) and cores ("2-3,5"; empty: any). Rendering is an
/// ordinary class with a high share by default: a thread that computes for tens of milliseconds under
/// SCHED_RR or SCHED_FIFO starves everything else on its core.
struct ThreadsSection {
    std::int32_t trigger_priority = 80, release_priority = 75, transmit_priority = 70, detector_priority = 65;
    std::int32_t pipeline_priority = 0, display_priority = 0;
    std::string trigger_cores, release_cores, transmit_cores, detector_cores, pipeline_cores, display_cores;
    RenderClass render_class = RenderClass::other;
    std::int32_t render_nice = -10, render_priority = 1;
    std::string render_cores;
    double render_share = 0.93, tiles_share = 0.1;
};

/// [simulator]: another program moves the scene, and time itself with trigger.source = "lockstep".
struct SimulatorSection {
    bool enabled = false;
    std::string listen = "127.0.0.1:5003";
    std::string token_file; ///< of clients; empty: none is wanted
    double max_extrapolation_ms = 100;
};

/// [outputs]: GPIO lines that show what the camera is doing; empty: none.
struct OutputsSection {
    std::string trigger_ready, exposure;
    bool active_low = false;
};

/// [monitor]: the local socket for those who look, as `obscura status`.
struct MonitorSection {
    std::string socket = "auto"; ///< path, or see monitor_paths.hpp
    bool frames = true;

    /// Whether frames are kept for those who ask.
    [[nodiscard]] bool keeps_frames() const;
};

/// Whether models run as machine code.
enum class NativeModels : std::uint8_t {
    off,
    automatic, ///< where the processor has the instructions
};
constexpr auto enum_names(NativeModels /*type*/) {
    return std::array{EnumName{NativeModels::off, "off"}, EnumName{NativeModels::automatic, "auto"}};
}

/// [models]: models written in SuMoL that scenes use.
struct ModelsSection {
    std::string folder = "auto"; ///< see models_folder()
    NativeModels native = NativeModels::automatic;
    double max_ns_per_evaluation = 500; ///< 0: any
};
/// The folder of the appliance's models: for "auto" the folder `models` in the state folder of the service,
/// STATE_DIRECTORY as systemd sets it, and none where there is no service; empty: none.
[[nodiscard]] std::filesystem::path models_folder(const ModelsSection& section);

/// [control]: where programs call the daemon; empty: nowhere.
struct ControlSection {
    std::string listen;     ///< "127.0.0.1:5153"
    std::string token_file; ///< of clients that come over TCP; empty: none is wanted
    service::Permission token_permission = service::Permission::scene;
    std::string unix_socket; ///< absolute path
    std::string admin_group; ///< empty: none
    std::int32_t clients = 16;
    std::string scenes; ///< folder; empty: that of the scene file

    [[nodiscard]] bool enabled() const { return !listen.empty() || !unix_socket.empty(); }
};

[[nodiscard]] config::Section section_of(DaemonSection& section);
[[nodiscard]] config::Section section_of(RenderSection& section);
[[nodiscard]] config::Section section_of(DeadlineSection& section);
[[nodiscard]] config::Section section_of(ThreadsSection& section);
[[nodiscard]] config::Section section_of(SimulatorSection& section);
[[nodiscard]] config::Section section_of(OutputsSection& section);
[[nodiscard]] config::Section section_of(MonitorSection& section);
[[nodiscard]] config::Section section_of(ModelsSection& section);
[[nodiscard]] config::Section section_of(ControlSection& section);

} // namespace obscura::emulator
