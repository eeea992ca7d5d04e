// SPDX-License-Identifier: Apache-2.0
// Settings of the V4L2 transport: section [v4l2], its checks and its maker.
#pragma once

#include "core/realtime/realtime.hpp"
#include "core/text/enum_names.hpp"
#include "core/time.hpp"
#include "transports/transport_settings.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports {

/// Pixel formats of the node. In the Y formats every pixel is a little-endian 16-bit word that carries the
/// digital number of the ADC, least significant bit aligned; a number deeper than the format loses its low
/// bits. In y16 the depth is the ADC's and unused high bits are 0. Drivers that treat y10, y12 and y14 as
/// packed (v4l2loopback does) are refused.
enum class V4l2Format : std::uint8_t { grey, y10, y12, y14, y16 };
/// Names of the Linux pixel formats.
constexpr auto enum_names(V4l2Format /*type*/) {
    return std::array{EnumName{V4l2Format::grey, "GREY"}, EnumName{V4l2Format::y10, "Y10"},
                      EnumName{V4l2Format::y12, "Y12"}, EnumName{V4l2Format::y14, "Y14"},
                      EnumName{V4l2Format::y16, "Y16"}};
}

/// I/O method of the driver. `automatic` selects mmap if the driver returns buffers in order, else write();
/// only mmap carries the trigger time stamps.
enum class V4l2Io : std::uint8_t { automatic, mmap, write };
/// Names in the configuration.
constexpr auto enum_names(V4l2Io /*type*/) {
    return std::array{EnumName{V4l2Io::automatic, "auto"}, EnumName{V4l2Io::mmap, "mmap"},
                      EnumName{V4l2Io::write, "write"}};
}

/// Section [v4l2]: video node, pixel format and I/O method.
struct V4l2Settings {
    static constexpr std::string_view kind = "v4l2";

    bool enabled = false;
    std::string device = "/dev/video10";
    V4l2Format format = V4l2Format::y16;
    V4l2Io io = V4l2Io::automatic;
    std::int32_t buffers = 8;     ///< requested from the driver in mmap mode
    std::size_t queue_frames = 4; ///< frames that may wait; further ones are dropped and counted
    /// The first four pixels carry the low bytes of frame_id, lowest first.
    bool frame_counter = false;
    /// True: start() throws if the node cannot be used. False: the thread waits for the node.
    bool required = false;
};

/// Resources of a V4L2 output besides its settings.
struct V4l2Context {
    /// Size of the image announced at start; 0: that of the first frame. A later frame of another size
    /// changes the format.
    std::int32_t width = 0, height = 0;
    int bits_per_pixel = 16;  ///< ADC depth of the announced image
    double frame_rate_hz = 0; ///< announced to the driver; 0: not announced
    ThreadSettings thread{};
    std::int64_t buffer_wait_ns = 100 * ns_per_ms; ///< longest wait for a free buffer of the driver
    /// Interval between attempts to open a missing node: doubles from the first to the last.
    std::int64_t retry_first_ns = 50 * ns_per_ms, retry_last_ns = 500 * ns_per_ms;
};

/// Section bound to `settings`. Its check does not open the node.
[[nodiscard]] config::Section section_of(V4l2Settings& settings);
/// The video node: two cameras must not feed the same.
[[nodiscard]] std::vector<Identity> identities_of(const V4l2Settings& settings);
/// Capacity of the queue.
[[nodiscard]] std::size_t frames_held_by(const V4l2Settings& settings);
/// A V4l2Output, not started.
[[nodiscard]] std::unique_ptr<Transport> make_transport(const V4l2Settings& settings,
                                                        const TransportContext& context);

} // namespace obscura::transports
