// SPDX-License-Identifier: Apache-2.0
// Host side of a GUD display session: set-up, updates and status over USB.
#pragma once

#include "core/camera/region.hpp"
#include "transports/stimulator/gud.hpp"
#include "transports/stimulator/usb.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace obscura::transports {

/// Requested mode and format of a display; zero or empty leaves the choice to the device.
struct DisplayWish {
    std::int32_t width = 0, height = 0;
    double refresh_hz = 0;
    std::optional<gud::Format> format; ///< default: R8, else XRGB8888, else RGB888
    std::uint8_t connector = 0;
};

/// One update of the display: a rectangle and its pixels.
struct DisplayUpdate {
    Region rect;
    std::span<const std::uint8_t> bytes; ///< pixels of `rect` row by row, or their LZ4 block
    bool compressed = false;
};

/// Host side of GUD. The display is on from construction to turn_off(). Thread-bound.
class DisplayLink {
public:
    /// Reads the descriptors, chooses mode and format, sets them and turns the display on, in the order of
    /// the kernel's driver. Throws HardwareError with one line: the device's answer and what is allowed.
    /// `device` must outlive the link.
    DisplayLink(UsbDevice& device, const DisplayWish& wish);

    [[nodiscard]] const gud::Mode& mode() const { return mode_; }
    [[nodiscard]] gud::Format format() const { return format_; }
    [[nodiscard]] std::int32_t width() const { return mode_.hdisplay; }
    [[nodiscard]] std::int32_t height() const { return mode_.vdisplay; }
    [[nodiscard]] std::size_t frame_bytes() const {
        return static_cast<std::size_t>(width()) * static_cast<std::size_t>(height()) *
               static_cast<std::size_t>(gud::bytes_per_pixel(format_));
    }
    [[nodiscard]] bool whole_frames_only() const { return (descriptor_.flags & gud::full_update) != 0; }
    [[nodiscard]] bool takes_lz4() const {
        return !whole_frames_only() && (descriptor_.compression & gud::compression_lz4) != 0;
    }
    /// Bytes of one update before compression.
    [[nodiscard]] std::size_t max_update_bytes() const;
    [[nodiscard]] bool has_frame_status() const { return has_frame_status_; }

    /// Sends an update through `slot`, which must be free, as must be the other one unless the device takes
    /// whole frames only: a buffer request may not overtake the bytes of the one before.
    [[nodiscard]] UsbStatus send(std::size_t slot, const DisplayUpdate& update);
    /// Recovers from a failed transfer: clears a halt of the endpoint and, for devices that take whole
    /// frames, makes the next send() begin with a buffer request, by which GUD synchronises again.
    void resynchronise();
    /// True while the device answers.
    [[nodiscard]] bool alive();
    /// Requests Obscura's frame status extension; nullopt if the device lacks it or its answer is invalid,
    /// after which it is not requested again.
    [[nodiscard]] std::optional<gud::FrameStatus> frame_status();
    /// Turns the display off if the device still answers.
    void turn_off() noexcept;
    /// Request that the device refused last, with the reason: "set_buffer: invalid parameter".
    [[nodiscard]] const std::string& last_refusal() const { return refusal_; }

private:
    std::size_t get(gud::Request request, std::uint16_t value, std::span<std::uint8_t> into,
                    std::string_view what);
    UsbStatus set(gud::Request request, std::uint16_t value, std::span<const std::uint8_t> data,
                  std::string_view what);
    void require(UsbStatus status, std::string_view what) const;
    [[noreturn]] void fail(const std::string& why) const;
    [[nodiscard]] gud::Status status();
    void choose_format(const DisplayWish& wish);
    void choose_mode(const DisplayWish& wish);

    UsbDevice& device_;
    gud::Descriptor descriptor_;
    gud::Mode mode_;
    gud::Format format_ = gud::Format::r8;
    bool has_frame_status_ = false;
    bool announce_whole_frame_ = false;
    std::string refusal_;
};

} // namespace obscura::transports
