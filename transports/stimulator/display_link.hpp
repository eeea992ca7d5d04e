// A session with one GUD display: bring-up, updates and status, over the USB seam.
#pragma once

#include "core/region.hpp"
#include "transports/stimulator/gud.hpp"
#include "transports/stimulator/usb.hpp"

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace obscura::transports {

/// What is wanted of a display; zero or empty leaves the choice to the device.
struct DisplayWish {
    std::int32_t width = 0, height = 0;
    double refresh_hz = 0;
    std::optional<gud::Format> format; ///< default: R8, else XRGB8888, else RGB888
    std::uint8_t connector = 0;
};

/// Where an update of the display stands.
struct DisplayUpdate {
    Region rect;
    std::span<const std::uint8_t> bytes; ///< pixels of `rect` row by row, or their LZ4 block
    bool compressed = false;
};

/// Host side of GUD. The display is on from construction to turn_off(). One thread.
class DisplayLink {
public:
    /// Asks the device what it is, chooses mode and format, sets them and turns the display on, in the order
    /// the kernel's driver does. Throws HardwareError with one line that says what the device answered and
    /// what would have been allowed. `device` must outlive the link.
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
    /// After a failed transfer: ends a halt of the endpoint and, for devices that take whole frames, makes
    /// the next send() say so with a buffer request first, which is how GUD finds its place again.
    void resynchronise();
    /// Whether the device still answers.
    [[nodiscard]] bool alive();
    /// Obscura's extension; nothing when the device has it not or answered nonsense, which is the last time
    /// it is asked.
    [[nodiscard]] std::optional<gud::FrameStatus> frame_status();
    /// Turns the display off, as far as the device still listens.
    void turn_off() noexcept;
    /// What the device refused last: "set_buffer: invalid parameter".
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
