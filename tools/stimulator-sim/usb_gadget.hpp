// SPDX-License-Identifier: Apache-2.0
// USB gadget in configfs: identity, FunctionFS function, and binding to a USB device controller.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace obscura::tools {

struct GadgetSettings {
    std::string name = "obscura-stimulator-sim";
    std::uint16_t vendor_id = 0x1d50, product_id = 0x614d;
    std::string serial = "SIM-0001";
    std::filesystem::path configfs = "/sys/kernel/config";
    std::string controller; ///< name in /sys/class/udc; empty: the first
};

/// Gadget with one mounted FunctionFS function, created by the constructor and removed by the destructor.
/// Needs root, libcomposite and usb_f_fs.
class UsbGadget {
public:
    /// Throws HardwareError.
    explicit UsbGadget(GadgetSettings settings);
    ~UsbGadget();
    UsbGadget(const UsbGadget&) = delete;
    UsbGadget& operator=(const UsbGadget&) = delete;

    /// Mount point of FunctionFS.
    [[nodiscard]] const std::filesystem::path& functionfs() const { return mount_; }
    /// Connects the gadget to the controller; the function must have written its descriptors before. Throws
    /// HardwareError.
    void bind();
    /// Disconnects the gadget.
    void unbind() noexcept;

private:
    void remove() noexcept;
    GadgetSettings settings_;
    std::filesystem::path gadget_, mount_;
    bool mounted_ = false;
};

} // namespace obscura::tools
