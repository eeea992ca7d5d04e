// The USB seam on libusb.
#pragma once

#include "transports/stimulator/usb.hpp"

#include <memory>

namespace obscura::transports {

/// Every list() starts libusb afresh: a long-lived context learns of a plugged device from udevd only, which
/// is not running everywhere, while a new one reads the bus. A kernel driver that holds the interface is
/// detached for as long as the device is open.
[[nodiscard]] std::unique_ptr<UsbBus> make_libusb_bus();

} // namespace obscura::transports
