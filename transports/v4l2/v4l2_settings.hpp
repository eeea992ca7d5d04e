// What can be set on the V4L2 transport.
#pragma once

#include "core/realtime.hpp"
#include "core/time.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::transports {

/// The formats it can offer. In the Y formats every pixel is a little-endian 16-bit word that carries the
/// digital number as the ADC gave it, least significant bit aligned; one deeper than the format loses its low
/// bits. In y16 the depth is the ADC's and unused high bits are 0. Drivers that count y10, y12 and y14 as
/// packed (v4l2loopback does) are refused.
enum class V4l2Format : std::uint8_t { grey, y10, y12, y14, y16 };

/// How images get to the driver. `automatic` takes mmap where the driver gives buffers back in order, else
/// write(); only mmap can carry time stamps of ours.
enum class V4l2Io : std::uint8_t { automatic, mmap, write };

/// By the names GREY, Y10, Y12, Y14, Y16, and auto, mmap, write. Throw ConfigError.
[[nodiscard]] V4l2Format v4l2_format_named(std::string_view name);
[[nodiscard]] V4l2Io v4l2_io_named(std::string_view name);

/// Which video node to feed and in what form.
struct V4l2Settings {
    std::string device = "/dev/video10";
    V4l2Format format = V4l2Format::y16;
    V4l2Io io = V4l2Io::automatic;
    /// The image to announce at start; 0: the first frame decides. Any later frame of another size changes
    /// the format.
    std::int32_t width = 0, height = 0;
    int bits_per_pixel = 16;      ///< ADC depth of the announced image
    double frame_rate_hz = 0;     ///< told to the driver; 0: not told
    bool frame_counter = false;   ///< the first four pixels carry the low bytes of frame_id, lowest first
    bool required = false;        ///< start() throws when the node cannot be used, else it is waited for
    int buffers = 8;              ///< asked of the driver in mmap mode
    std::size_t queue_frames = 4; ///< frames that may wait; further ones are dropped and counted
    std::int64_t buffer_wait_ns = 100 * ns_per_ms; ///< for a buffer of a driver that has none free
    /// Between attempts to open a node that is not there: doubles from the first to the last.
    std::int64_t retry_first_ns = 50 * ns_per_ms, retry_last_ns = 500 * ns_per_ms;
    ThreadSettings thread{};
};

} // namespace obscura::transports
