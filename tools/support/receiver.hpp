// A GigE Vision client on libaravis: controls a camera and receives its frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::tools {

struct ReceiverSettings {
    std::string address;               ///< host name or IPv4 address of the camera
    std::int32_t packet_size = 0;      ///< GevSCPSPacketSize; 0: negotiated
    std::int64_t packet_delay_ns = -1; ///< gap between packets; -1: as the camera has it
    std::size_t buffers = 16;
};

/// A frame as it arrived. `data` is valid until the next call of the receiver.
struct ReceivedFrame {
    std::uint64_t block_id = 0;
    bool complete = false;
    std::int32_t width = 0, height = 0;
    std::uint32_t pixel_format = 0;   ///< PFNC
    std::uint64_t device_ns = 0;      ///< the camera's time stamp of the frame, its clock
    std::int64_t first_packet_ns = 0; ///< CLOCK_REALTIME, microsecond steps
    std::int64_t complete_ns = 0;     ///< CLOCK_REALTIME
    std::span<const std::uint8_t> data;
};

/// How the camera's clock stands to CLOCK_REALTIME.
struct ClockReading {
    std::int64_t client_ns = 0;     ///< when
    std::int64_t offset_ns = 0;     ///< client minus camera
    std::int64_t round_trip_ns = 0; ///< of the best exchange: the offset is good to half of it
};

struct StreamStatistics {
    std::uint64_t resent_packets = 0, missing_packets = 0, underruns = 0;
};

/// One camera under our control, from construction to destruction. Received over an ordinary UDP socket: the
/// packet socket that libaravis would use as root delivers with a lag of up to 5 ms. One thread.
class Receiver {
public:
    /// Throws HardwareError when no camera answers or another client controls it.
    explicit Receiver(const ReceiverSettings& settings);
    ~Receiver();
    Receiver(const Receiver&) = delete;
    Receiver& operator=(const Receiver&) = delete;

    /// GenICam features. Throw HardwareError with the camera's answer.
    void set(const char* feature, std::string_view value);
    void set(const char* feature, double value);
    void set(const char* feature, std::int64_t value);
    [[nodiscard]] std::string get_text(const char* feature) const;
    void set_flag(const char* feature, bool value);
    /// The least value of a floating-point feature.
    [[nodiscard]] double least(const char* feature) const;
    void execute(const char* feature);

    /// Opens the stream and starts the acquisition.
    void start();
    void stop();
    /// The next frame, complete or not; nothing when none came within `timeout_s` or interrupt() was called.
    std::optional<ReceivedFrame> receive(double timeout_s);
    [[nodiscard]] StreamStatistics statistics() const;

    /// Compares the clocks with the time-stamp latch, `attempts` times, and keeps the quickest exchange.
    /// Nothing when the camera has no latch.
    [[nodiscard]] std::optional<ClockReading> read_clock(int attempts = 32) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// The pixels as 16-bit digital numbers; `bits` becomes the depth of the format. Empty when the format is not
/// a monochrome one that is known here.
[[nodiscard]] std::vector<std::uint16_t> unpack_pixels(std::uint32_t pixel_format, std::size_t pixels,
                                                       std::span<const std::uint8_t> data, int& bits);

} // namespace obscura::tools
