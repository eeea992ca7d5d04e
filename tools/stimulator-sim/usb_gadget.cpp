// SPDX-License-Identifier: Apache-2.0
#include "tools/stimulator-sim/usb_gadget.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"

#include <fmt/format.h>
#include <sys/mount.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

namespace obscura::tools {
namespace {

namespace fs = std::filesystem;

void put(const fs::path& file, const std::string& text) {
    std::ofstream out(file);
    out << text << std::flush;
    if (!out)
        throw HardwareError(fmt::format("{}: cannot be written: {}", file.string(), std::strerror(errno)));
}

void make(const fs::path& directory) {
    std::error_code error;
    fs::create_directories(directory, error);
    if (error) throw HardwareError(fmt::format("{}: {}", directory.string(), error.message()));
}

} // namespace

UsbGadget::UsbGadget(GadgetSettings settings)
    : settings_(std::move(settings)),
      gadget_(settings_.configfs / "usb_gadget" / settings_.name),
      mount_(fs::path("/run") / settings_.name) {
    if (!is_folder_at(settings_.configfs / "usb_gadget"))
        throw HardwareError(fmt::format("{}: is not there; load libcomposite and mount configfs",
                                        (settings_.configfs / "usb_gadget").string()));
    try {
        make(gadget_);
        put(gadget_ / "idVendor", fmt::format("0x{:04x}", settings_.vendor_id));
        put(gadget_ / "idProduct", fmt::format("0x{:04x}", settings_.product_id));
        put(gadget_ / "bcdDevice", "0x0100");
        make(gadget_ / "strings/0x409");
        put(gadget_ / "strings/0x409/serialnumber", settings_.serial);
        put(gadget_ / "strings/0x409/manufacturer", "Obscura");
        put(gadget_ / "strings/0x409/product", "Optical stimulator (reference)");
        make(gadget_ / "configs/c.1/strings/0x409");
        put(gadget_ / "configs/c.1/MaxPower", "250");
        make(gadget_ / ("functions/ffs." + settings_.name));
        std::error_code error;
        fs::create_directory_symlink(gadget_ / ("functions/ffs." + settings_.name),
                                     gadget_ / "configs/c.1/display", error);
        if (error && error != std::errc::file_exists)
            throw HardwareError(fmt::format("{}: {}", (gadget_ / "configs/c.1").string(), error.message()));
        make(mount_);
        if (::mount(settings_.name.c_str(), mount_.c_str(), "functionfs", 0, nullptr) != 0)
            throw HardwareError(fmt::format("{}: functionfs: {}", mount_.string(), std::strerror(errno)));
        mounted_ = true;
    } catch (...) {
        remove();
        throw;
    }
}

UsbGadget::~UsbGadget() {
    remove();
}

void UsbGadget::bind() {
    std::string controller = settings_.controller;
    if (controller.empty()) {
        std::error_code error;
        for (const std::filesystem::path& entry : paths_in("/sys/class/udc", error)) {
            controller = entry.filename().string();
            break;
        }
        if (controller.empty())
            throw HardwareError(
                "/sys/class/udc: this machine has no USB device controller (dummy_hcd is a simulated one)");
    }
    put(gadget_ / "UDC", controller);
}

void UsbGadget::unbind() noexcept {
    std::ofstream(gadget_ / "UDC") << "\n" << std::flush;
}

void UsbGadget::remove() noexcept {
    // Remove in reverse order of the constructor: configfs folders one by one, their files go with them.
    unbind();
    std::error_code ignored;
    if (mounted_) ::umount2(mount_.c_str(), MNT_DETACH);
    fs::remove(mount_, ignored);
    fs::remove(gadget_ / "configs/c.1/display", ignored);
    for (const char* folder : {"configs/c.1/strings/0x409", "configs/c.1", "strings/0x409"})
        fs::remove(gadget_ / folder, ignored);
    fs::remove(gadget_ / ("functions/ffs." + settings_.name), ignored);
    fs::remove(gadget_, ignored);
}

} // namespace obscura::tools
