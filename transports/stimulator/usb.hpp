// The seam to USB: what a GUD host needs of a bus, so that tests can put a device of their own behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace obscura::transports {

/// How a transfer ended.
enum class UsbStatus : std::uint8_t {
    ok,
    stall,   ///< the device refused the request or halted the endpoint
    timeout, ///< no answer in time; the transfer was taken back
    gone,    ///< the device has left the bus
    pending, ///< asynchronous transfer not finished yet
    error,   ///< anything else, unplugging included: the bus often reports that first
};
[[nodiscard]] constexpr const char* to_string(UsbStatus status) {
    constexpr const char* names[] = {"ok",          "stalled", "timed out",
                                     "device gone", "pending", "transfer error"};
    return names[static_cast<std::size_t>(status)];
}

/// `count` is the number of bytes that were really moved, also when the transfer failed.
struct UsbResult {
    UsbStatus status = UsbStatus::error;
    std::size_t count = 0;
    [[nodiscard]] bool ok() const { return status == UsbStatus::ok; }
};

/// A device on the bus, before it is opened.
struct UsbIdentity {
    std::uint16_t vendor_id = 0, product_id = 0;
    std::uint8_t bus = 0, address = 0;
    std::string serial;  ///< empty when the device has none or may not be asked
    std::string problem; ///< why it cannot be opened, one line; empty when it can
};

/// One opened device with its display interface claimed. Closed by the destructor, which takes outstanding
/// transfers back. All calls from one thread.
class UsbDevice {
public:
    static constexpr std::size_t slots = 2; ///< asynchronous transfers that may be under way

    virtual ~UsbDevice() = default;
    /// Vendor request to the interface, device to host.
    virtual UsbResult control_in(std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) = 0;
    /// Vendor request to the interface, host to device.
    virtual UsbResult control_out(std::uint8_t request, std::uint16_t value,
                                  std::span<const std::uint8_t> data) = 0;
    /// Starts a bulk transfer to the display in the free slot `slot`; `data` must stay until wait() said how
    /// it ended.
    virtual UsbStatus submit(std::size_t slot, std::span<const std::uint8_t> data) = 0;
    /// Waits up to `wait_ms` for the transfer of `slot`; `pending` when it is still under way.
    virtual UsbResult wait(std::size_t slot, int wait_ms) = 0;
    /// Takes the transfer of `slot` back and waits until that is done.
    virtual void cancel(std::size_t slot) = 0;
    /// Ends the halt of the bulk endpoint.
    virtual UsbStatus clear_halt() = 0;
    /// For messages: "1d50:614d serial X at bus 1 address 2, 480 Mbit/s".
    [[nodiscard]] virtual std::string description() const = 0;
};

/// The USB devices of this machine; an interface, so that tests have a bus of their own.
class UsbBus {
public:
    virtual ~UsbBus() = default;
    /// Every device of that vendor and product that is plugged in now.
    virtual std::vector<UsbIdentity> list(std::uint16_t vendor_id, std::uint16_t product_id) = 0;
    /// Opens a device that list() returned and claims its vendor-specific interface. Throws HardwareError.
    virtual std::unique_ptr<UsbDevice> open(const UsbIdentity& identity) = 0;
};

} // namespace obscura::transports
