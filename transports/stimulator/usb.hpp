// SPDX-License-Identifier: Apache-2.0
// USB bus and device interfaces that a GUD host needs, so that tests can replace the hardware.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports {

/// Result of a transfer.
enum class UsbStatus : std::uint8_t {
    ok,
    stall,   ///< the device refused the request or halted the endpoint
    timeout, ///< no answer in time; the transfer was cancelled
    gone,    ///< the device has left the bus
    pending, ///< asynchronous transfer not finished yet
    error,   ///< any other failure, often the first sign of a disconnect
};
[[nodiscard]] constexpr const char* to_string(UsbStatus status) {
    constexpr const char* names[] = {"ok",          "stalled", "timed out",
                                     "device gone", "pending", "transfer error"};
    return names[static_cast<std::size_t>(status)];
}

/// Status of a transfer and the number of bytes transferred, which is valid for a failed transfer too.
struct UsbResult {
    UsbStatus status = UsbStatus::error;
    std::size_t count = 0;
    [[nodiscard]] bool ok() const { return status == UsbStatus::ok; }
};

/// Identity of a device on the bus, before it is opened.
struct UsbIdentity {
    std::uint16_t vendor_id = 0, product_id = 0;
    std::uint8_t bus = 0, address = 0;
    std::string serial;  ///< empty if the device has none or may not be opened
    std::string problem; ///< why it cannot be opened, one line; empty if it can
};

/// Opened device with its display interface claimed. The destructor cancels pending transfers and closes it.
/// Thread-bound.
class UsbDevice {
public:
    static constexpr std::size_t slots = 2; ///< asynchronous transfers that may be in progress

    virtual ~UsbDevice() = default;
    /// Vendor request to the interface, device to host.
    virtual UsbResult control_in(std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) = 0;
    /// Vendor request to the interface, host to device.
    virtual UsbResult control_out(std::uint8_t request, std::uint16_t value,
                                  std::span<const std::uint8_t> data) = 0;
    /// Starts a bulk transfer to the display in the free slot `slot`; `data` must stay valid until wait() has
    /// returned its result.
    virtual UsbStatus submit(std::size_t slot, std::span<const std::uint8_t> data) = 0;
    /// Waits up to `wait_ms` for the transfer of `slot`; `pending` if it is still in progress.
    virtual UsbResult wait(std::size_t slot, int wait_ms) = 0;
    /// Cancels the transfer of `slot` and waits for its end.
    virtual void cancel(std::size_t slot) = 0;
    /// Clears the halt of the bulk endpoint.
    virtual UsbStatus clear_halt() = 0;
    /// Text for messages: "1d50:614d serial X at bus 1 address 2, 480 Mbit/s".
    [[nodiscard]] virtual std::string description() const = 0;
};

/// The USB devices of this machine.
class UsbBus {
public:
    virtual ~UsbBus() = default;
    /// Every connected device of that vendor and product.
    virtual std::vector<UsbIdentity> list(std::uint16_t vendor_id, std::uint16_t product_id) = 0;
    /// Opens a device that list() returned and claims its vendor-specific interface. Throws HardwareError.
    virtual std::unique_ptr<UsbDevice> open(const UsbIdentity& identity) = 0;
};

} // namespace obscura::transports
