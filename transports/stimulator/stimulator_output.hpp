// SPDX-License-Identifier: Apache-2.0
// Stimulator transport: shows every frame on a USB display (GUD) in front of the real camera. Read this
// first.
#pragma once

#include "transports/frame_queue.hpp"
#include "transports/stimulator/display_link.hpp"
#include "transports/stimulator/optical.hpp"
#include "transports/stimulator/refresh.hpp"
#include "transports/stimulator/settings.hpp"
#include "transports/stimulator/usb.hpp"
#include "transports/transport.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <semaphore>
#include <string>
#include <thread>
#include <vector>

namespace obscura::transports {

/// Counters of the stimulator besides those of every transport. A frame is late if the device was still
/// receiving the previous one when this one was complete.
struct StimulatorStatus {
    bool connected = false;
    std::uint64_t connects = 0;       ///< successful set-ups of the display
    std::uint64_t late = 0;           ///< frames that had to wait for the device
    std::uint64_t updates = 0;        ///< rectangles sent
    std::uint64_t unchanged = 0;      ///< windows without change, not sent
    std::uint64_t compressed = 0;     ///< updates sent as LZ4
    std::uint64_t failed = 0;         ///< failed updates
    std::uint64_t clipped_pixels = 0; ///< pixels brighter than the screen's maximum
    /// Reported by devices with the frame status extension: whether it is present, updates shown, updates
    /// refused or broken, and the time of the last one shown (scheduling clock, uncertainty half the round
    /// trip of a request).
    bool has_frame_status = false;
    std::uint64_t device_shown = 0;
    std::uint64_t device_errors = 0;
    Time last_shown;
};

/// Finds the device, sets it up, and shows frames until it disconnects; then searches again. Windows are
/// shown at their position on the sensor; only the changed part is sent. While one update is transferred, the
/// next is computed. It has a thread of its own. A cause of failure is logged once until the state changes.
/// submit() is thread-bound.
class StimulatorOutput final : public Transport {
public:
    /// `bus` must not be null.
    StimulatorOutput(StimulatorSettings settings, const StimulatorContext& context,
                     std::unique_ptr<UsbBus> bus);
    ~StimulatorOutput() override;

    [[nodiscard]] std::string_view kind() const override { return "stimulator"; }
    /// Reads the calibration and starts searching for the device; its absence is no error. Throws InputError.
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] bool delivers_all() const noexcept override { return true; }
    /// With what status() tells.
    [[nodiscard]] TransportStatistics statistics() const override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }
    [[nodiscard]] StimulatorStatus status() const noexcept;

private:
    /// One of the two transfers and its source buffers.
    struct Lane {
        std::vector<std::uint8_t> plain, packed;
        bool busy = false;
        bool ends_frame = false; ///< its completion delivers a frame
        std::uint64_t frame = 0; ///< running number of the frame it belongs to
        std::size_t bytes = 0;
        Time sent;
        TransmitTimestamps* stamps = nullptr; ///< time stamps of that frame
    };
    /// State of one connection.
    struct Session;

    void work();
    [[nodiscard]] std::unique_ptr<Session> connect();
    void serve(Session& session);
    void show(Session& session, const Frame& frame);
    [[nodiscard]] bool compute(Session& session, const Frame& frame, const Region& rect);
    [[nodiscard]] bool copy_rows(Session& session, const Frame& frame, std::int32_t composed_rows);
    void send(Session& session, const Region& rect, bool ends_frame);
    [[nodiscard]] std::span<const std::uint8_t> compress(Session& session, Lane& lane);
    bool finish(Session& session, std::size_t slot, int wait_ms);
    void finish_for_sure(Session& session, std::size_t slot);
    void account(Session& session, Lane& lane, const UsbResult& result);
    void fail(Session& session, UsbStatus status);
    void check(Session& session);
    void warn_of_refresh(Session& session, const Frame& frame);
    void complain(const std::string& line);
    void drop_queue();
    [[nodiscard]] FrameRef take();

    const StimulatorSettings settings_;
    const StimulatorContext context_;
    std::unique_ptr<UsbBus> bus_;
    std::optional<CalibrationTable> table_;
    std::unique_ptr<OpticalStage> stage_; ///< kept over a reconnection
    FrameQueue queue_;                    ///< filled by submit(), emptied by work()
    std::counting_semaphore<> wake_{0};
    Heartbeat heartbeat_{"stimulator"};
    std::atomic<bool> stopping_{false}, connected_{false};
    std::thread thread_;
    std::vector<std::uint16_t> canvas_; ///< latest digital numbers of the full sensor
    bool absent_ = false;               ///< the last scan found no device
    std::string last_complaint_;
    Time last_complaint_at_{};

    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::atomic<std::uint64_t> connects_{0}, late_{0}, updates_{0}, unchanged_{0}, compressed_{0}, failed_{0},
        clipped_{0}, device_shown_{0}, device_errors_{0};
    std::atomic<std::int64_t> last_shown_ns_{0};
    std::atomic<bool> has_frame_status_{false};
};

} // namespace obscura::transports
