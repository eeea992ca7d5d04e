// SPDX-License-Identifier: Apache-2.0
// USB bus on libusb.
#pragma once

#include "transports/stimulator/usb.hpp"

#include <memory>

namespace obscura::transports {

/// Each list() creates a new libusb context: an existing context learns of new devices through udevd only,
/// which does not run on every system, while a new one scans the bus. A kernel driver that holds the
/// interface is detached while the device is open.
[[nodiscard]] std::unique_ptr<UsbBus> make_libusb_bus();

} // namespace obscura::transports
