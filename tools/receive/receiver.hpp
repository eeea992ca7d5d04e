// SPDX-License-Identifier: Apache-2.0
// GigE Vision client on libaravis: controls a camera and receives its frames.
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
    std::int64_t packet_delay_ns = -1; ///< delay between packets; -1: the camera's setting
    std::size_t buffers = 16;          ///< frame buffers of the stream
};

/// Received frame. `data` is valid until the next call of the receiver.
struct ReceivedFrame {
    std::uint64_t block_id = 0;
    bool complete = false;
    std::int32_t width = 0, height = 0;
    std::uint32_t pixel_format = 0;   ///< PFNC code
    std::uint64_t device_ns = 0;      ///< time stamp of the frame by the camera's clock
    std::int64_t first_packet_ns = 0; ///< CLOCK_REALTIME, resolution 1 us
    std::int64_t complete_ns = 0;     ///< CLOCK_REALTIME
    std::span<const std::uint8_t> data;
};

/// Offset between CLOCK_REALTIME of the client and the camera's clock.
struct ClockReading {
    std::int64_t client_ns = 0;     ///< client time of the reading
    std::int64_t offset_ns = 0;     ///< client minus camera
    std::int64_t round_trip_ns = 0; ///< shortest exchange; the offset's uncertainty is half of it
};

/// Packets of a stream as the client sees them.
struct StreamStatistics {
    /// Never came: of incomplete frames all from the first gap on, as libaravis counts.
    std::uint64_t missing_packets = 0;
    std::uint64_t asked_packets = 0; ///< asked for, each time
    /// Came after they had been asked for: sent again, or only late.
    std::uint64_t late_packets = 0;
    std::uint64_t duplicate_packets = 0; ///< came once more
    std::uint64_t refusals = 0;          ///< answers that hold no packet
    std::uint64_t underruns = 0;         ///< frames for which no buffer was free
};

/// What the camera made of the packets that the client asked for; a camera that is no Obscura does not tell.
struct CameraStatistics {
    std::uint64_t asked_packets = 0, resent_packets = 0, asked_before_sent = 0, refused_packets = 0;
};

/// Client that controls one camera from construction to destruction. It receives over an ordinary UDP socket:
/// the packet socket that libaravis would use as root delivers packets up to 5 ms late. Thread-bound, but for
/// execute().
class Receiver {
public:
    /// Throws HardwareError when no camera answers or another client controls it.
    explicit Receiver(const ReceiverSettings& settings);
    ~Receiver();
    Receiver(const Receiver&) = delete;
    Receiver& operator=(const Receiver&) = delete;

    /// Write and read GenICam features. Throw HardwareError with the camera's answer,
    /// and with the range or the entries that are allowed.
    void set(const char* feature, std::string_view value);
    void set(const char* feature, double value);
    void set(const char* feature, std::int64_t value);
    [[nodiscard]] std::string get_text(const char* feature) const;
    /// Value of an integer feature; nullopt if the camera does not have it.
    [[nodiscard]] std::optional<std::int64_t> find_integer(const char* feature) const;
    /// Value of a floating-point feature; nullopt if the camera does not have it.
    [[nodiscard]] std::optional<double> find_real(const char* feature) const;
    void set_flag(const char* feature, bool value);
    /// Minimum of a floating-point feature.
    [[nodiscard]] double least(const char* feature) const;
    /// Executes a command feature. Thread-safe, because libaravis serialises register accesses.
    void execute(const char* feature);

    /// Opens the stream and starts the acquisition.
    void start();
    void stop();
    /// Returns the next frame, complete or not; nullopt if none arrives within `timeout_s`.
    std::optional<ReceivedFrame> receive(double timeout_s);
    /// Chunk of the frame that receive() returned last, valid as long as it; empty if the frame has none of
    /// that id.
    [[nodiscard]] std::span<const std::uint8_t> chunk(std::uint32_t id) const;
    /// Ends the acquisition and the reception; the stream's statistics are final then.
    void end_stream();
    [[nodiscard]] StreamStatistics statistics() const;
    /// Statistics of the camera since start(). Waits until the camera has dealt with `asked` packets, 0.2 s
    /// at most. Returns nullopt if the camera does not tell, or does not answer.
    [[nodiscard]] std::optional<CameraStatistics> camera_statistics(std::uint64_t asked) const;

    /// Compares the clocks through the time-stamp latch `attempts` times and keeps the quickest exchange.
    /// Returns nullopt if the camera has no latch.
    [[nodiscard]] std::optional<ClockReading> read_clock(int attempts = 32) const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Unpacks pixels to 16-bit digital numbers and sets `bits` to the bit depth of the format. Returns an empty
/// vector for formats other than Mono8 to Mono16, Mono10p and Mono12p.
[[nodiscard]] std::vector<std::uint16_t> unpack_pixels(std::uint32_t pixel_format, std::size_t pixels,
                                                       std::span<const std::uint8_t> data, int& bits);

} // namespace obscura::tools
