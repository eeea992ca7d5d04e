// Read this first: a transport that shows every frame on a USB display in front of the real camera.
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

/// What it has done besides the counters that all transports have. A frame is late when the device was still
/// taking the one before at the time this one was complete.
struct StimulatorStatus {
    bool connected = false;
    std::uint64_t connects = 0;       ///< times the display came up
    std::uint64_t late = 0;           ///< frames that had to wait for the device
    std::uint64_t updates = 0;        ///< rectangles sent
    std::uint64_t unchanged = 0;      ///< windows that looked as before and were not sent
    std::uint64_t compressed = 0;     ///< updates sent as LZ4
    std::uint64_t failed = 0;         ///< updates that broke
    std::uint64_t clipped_pixels = 0; ///< asked for more light than the screen has
    /// By the device's own account, for devices with the extension: updates it has shown, when it showed the
    /// last one (scheduling clock, good to half the round trip of a request), and whether it says so at all.
    bool has_frame_status = false;
    std::uint64_t device_shown = 0;
    std::uint64_t device_errors = 0;
    Time last_shown;
};

/// Looks for the device, brings it up, and shows frames until it goes away; then looks again. Windows are
/// shown where they lie on the sensor; only what changed of them is sent. While one update travels, the next
/// is computed. One thread of its own. A cause of failure is logged once until something else happens. One
/// thread calls submit().
class StimulatorOutput final : public Transport {
public:
    /// `bus` must not be null.
    StimulatorOutput(StimulatorSettings settings, const StimulatorContext& context,
                     std::unique_ptr<UsbBus> bus);
    ~StimulatorOutput() override;

    [[nodiscard]] std::string_view kind() const override { return "stimulator"; }
    /// Reads the calibration and starts looking for the device; its absence is no error. Throws InputError.
    void start() override;
    void stop() override;
    bool submit(const FrameRef& frame) noexcept override;
    [[nodiscard]] TransportCounters counters() const noexcept override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }
    [[nodiscard]] StimulatorStatus status() const noexcept;

private:
    /// One of the two transfers and the buffers it reads from.
    struct Lane {
        std::vector<std::uint8_t> plain, packed;
        bool busy = false;
        bool ends_frame = false; ///< its completion delivers a frame
        std::uint64_t frame = 0; ///< count of the frame it belongs to
        std::size_t bytes = 0;
        Time sent;
        TransmitTimestamps* stamps = nullptr; ///< of that frame
    };
    /// Everything that lives as long as one connection.
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
    std::vector<std::uint16_t> canvas_; ///< what the whole sensor saw last
    bool absent_ = false;               ///< the last look found no device
    std::string last_complaint_;
    Time last_complaint_at_{};

    std::atomic<std::uint64_t> submitted_{0}, delivered_{0}, dropped_{0}, bytes_{0};
    std::atomic<std::uint64_t> connects_{0}, late_{0}, updates_{0}, unchanged_{0}, compressed_{0}, failed_{0},
        clipped_{0}, device_shown_{0}, device_errors_{0};
    std::atomic<std::int64_t> last_shown_ns_{0};
    std::atomic<bool> has_frame_status_{false};
};

} // namespace obscura::transports
