// The configfs side of a USB gadget: who the device is, and to which controller it is plugged.
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
    std::string controller; ///< of /sys/class/udc; empty: the first
};

/// Creates the gadget with one FunctionFS function and mounts that; the destructor takes everything away
/// again. Needs root, libcomposite and usb_f_fs.
class UsbGadget {
public:
    /// Throws HardwareError.
    explicit UsbGadget(GadgetSettings settings);
    ~UsbGadget();
    UsbGadget(const UsbGadget&) = delete;
    UsbGadget& operator=(const UsbGadget&) = delete;

    /// Where FunctionFS is mounted.
    [[nodiscard]] const std::filesystem::path& functionfs() const { return mount_; }
    /// Plugs in: after the function has written its descriptors. Throws HardwareError.
    void bind();
    /// Unplugs.
    void unbind() noexcept;

private:
    void remove() noexcept;
    GadgetSettings settings_;
    std::filesystem::path gadget_, mount_;
    bool mounted_ = false;
};

} // namespace obscura::tools
