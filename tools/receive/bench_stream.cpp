// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/bench_stream.hpp"

#include "core/camera/frame.hpp"
#include "core/clock.hpp"
#include "core/error.hpp"
#include "emulator/unit/assemble.hpp"
#include "host/interrupt.hpp"
#include "tools/receive/receiver.hpp"
#include "transports/gige/gige.hpp"

#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <mutex>

namespace obscura::tools {
namespace {

/// Camera control that stores settings only: the benchmark itself submits the frames.
class SettingsOnly final : public CameraControl {
public:
    SettingsOnly(const CameraLimits& limits, const CameraSettings& settings)
        : limits_(limits), settings_(settings) {}

    [[nodiscard]] CameraLimits limits() const override { return limits_; }
    [[nodiscard]] CameraSettings settings() const override {
        const std::lock_guard lock(mutex_);
        return settings_;
    }
    bool apply(const CameraSettings& settings) override {
        const std::lock_guard lock(mutex_);
        if (!explain_invalid(settings, limits_).empty()) return false;
        settings_ = settings;
        return true;
    }
    bool acquisition_start() override { return !acquiring_.exchange(true); }
    void acquisition_stop(bool /*abort*/) override { acquiring_ = false; }
    [[nodiscard]] bool acquiring() const override { return acquiring_; }
    bool software_trigger(Time /*edge*/) override { return false; }

private:
    const CameraLimits limits_;
    mutable std::mutex mutex_;
    CameraSettings settings_;
    std::atomic<bool> acquiring_{false};
};

std::vector<double> send(const emulator::DaemonConfig& config, std::uint64_t frames, double limit_mbit_s) {
    const MonotonicClock clock;
    const CameraSettings settings = emulator::camera_settings(config);
    SettingsOnly control(emulator::camera_limits(config.sensor), settings);
    const std::size_t pixels = static_cast<std::size_t>(settings.region.area());
    // The GigE camera keeps frames for resends; the pool must outlive it.
    const auto& configured = config.transports.get<transports::gige::GigeSettings>();
    FramePool pool(static_cast<std::size_t>(configured.history_frames) + 3, pixels,
                   static_cast<std::size_t>(settings.region.height));
    transports::gige::GigeSettings gige;
    gige.interface = configured.interface;
    gige.port = configured.port;
    gige.packet_size = configured.packet_size;
    gige.history_frames = configured.history_frames;
    gige.throughput_limit_mbit_s = limit_mbit_s;
    transports::gige::GigeCamera camera(gige, control, clock);
    camera.start();
    std::vector<double> ms;
    {
        Receiver receiver({configured.interface, 0, -1, 8});
        receiver.start();
        for (std::uint64_t id = 1; id <= frames && !host::interrupted(); ++id) {
            const FrameRef frame = pool.acquire();
            if (!frame) throw Error(exit_software, "obscura bench: the frame pool ran dry");
            FrameInfo& info = frame->info;
            info.frame_id = info.trigger_id = id;
            info.width = settings.region.width, info.height = settings.region.height;
            info.windows[0].sensor = settings.region;
            info.trigger_edge = clock.now();
            info.tai_offset_ns = clock.tai_offset_ns();
            const auto start = std::chrono::steady_clock::now();
            if (!camera.submit(frame)) continue;
            frame->publish_rows(info.height);
            const auto received = receiver.receive(2.0);
            if (received && received->complete)
                ms.push_back(
                    std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
                        .count());
        }
        receiver.stop();
    }
    camera.stop();
    return ms;
}

} // namespace

StreamFigures bench_stream(const emulator::DaemonConfig& config, std::uint64_t frames) {
    return {send(config, frames, transports::gige::GigeSettings{}.throughput_limit_mbit_s),
            send(config, frames, 0)};
}

} // namespace obscura::tools
