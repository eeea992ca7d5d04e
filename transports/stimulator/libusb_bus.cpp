// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/libusb_bus.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"

#include <fmt/format.h>
#include <libusb.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

namespace obscura::transports {
namespace {

// Time-outs below those of Linux's own GUD driver (5 s and 3 s), so that a failed device is recovered within
// 2 s; a display that needs more than a second for a control request is unusable here.
constexpr unsigned control_timeout_ms = 1000;
constexpr unsigned bulk_timeout_ms = 1500;
constexpr std::uint8_t vendor_in = 0xC1, vendor_out = 0x41; // vendor request to an interface

UsbStatus from_libusb(int code) {
    switch (code) {
    case LIBUSB_ERROR_PIPE:
        return UsbStatus::stall;
    case LIBUSB_ERROR_TIMEOUT:
        return UsbStatus::timeout;
    case LIBUSB_ERROR_NO_DEVICE:
    case LIBUSB_ERROR_NOT_FOUND:
        return UsbStatus::gone;
    default:
        return code >= 0 ? UsbStatus::ok : UsbStatus::error;
    }
}

UsbStatus from_transfer(libusb_transfer_status status) {
    switch (status) {
    case LIBUSB_TRANSFER_COMPLETED:
        return UsbStatus::ok;
    case LIBUSB_TRANSFER_STALL:
        return UsbStatus::stall;
    case LIBUSB_TRANSFER_TIMED_OUT:
    case LIBUSB_TRANSFER_CANCELLED:
        return UsbStatus::timeout;
    case LIBUSB_TRANSFER_NO_DEVICE:
        return UsbStatus::gone;
    default:
        return UsbStatus::error;
    }
}

using Context = std::shared_ptr<libusb_context>;

Context new_context() {
    libusb_context* raw = nullptr;
    if (const int code = libusb_init(&raw); code < 0)
        throw HardwareError(fmt::format("USB is not available: {}", libusb_strerror(code)));
    return {raw, libusb_exit};
}

struct HandleCloser {
    void operator()(libusb_device_handle* handle) const { libusb_close(handle); }
};
using Handle = std::unique_ptr<libusb_device_handle, HandleCloser>;

/// List of the devices of a bus; holds a reference to each.
class DeviceList {
public:
    explicit DeviceList(libusb_context* context) : count_(libusb_get_device_list(context, &list_)) {}
    ~DeviceList() {
        if (count_ >= 0) libusb_free_device_list(list_, 1);
    }
    DeviceList(const DeviceList&) = delete;
    DeviceList& operator=(const DeviceList&) = delete;
    [[nodiscard]] libusb_device** begin() const { return list_; }
    [[nodiscard]] libusb_device** end() const { return list_ + (count_ > 0 ? count_ : 0); }

private:
    libusb_device** list_ = nullptr;
    ssize_t count_;
};

struct Endpoint {
    std::uint8_t interface = 0;
    std::uint8_t address = 0;
};

/// Finds the first vendor-specific interface with a bulk OUT endpoint, as devices number endpoints freely.
bool find_endpoint(libusb_device* device, Endpoint& found) {
    libusb_config_descriptor* config = nullptr;
    if (libusb_get_active_config_descriptor(device, &config) < 0) return false;
    const std::unique_ptr<libusb_config_descriptor, void (*)(libusb_config_descriptor*)> hold(
        config, libusb_free_config_descriptor);
    for (int i = 0; i < config->bNumInterfaces; ++i) {
        if (config->interface[i].num_altsetting < 1) continue;
        const libusb_interface_descriptor& alt = config->interface[i].altsetting[0];
        if (alt.bInterfaceClass != LIBUSB_CLASS_VENDOR_SPEC) continue;
        for (int e = 0; e < alt.bNumEndpoints; ++e) {
            const libusb_endpoint_descriptor& endpoint = alt.endpoint[e];
            const bool bulk = (endpoint.bmAttributes & 3) == LIBUSB_TRANSFER_TYPE_BULK;
            if (bulk && (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
                found = {alt.bInterfaceNumber, endpoint.bEndpointAddress};
                return true;
            }
        }
    }
    return false;
}

const char* speed_of(libusb_device* device) {
    switch (libusb_get_device_speed(device)) {
    case LIBUSB_SPEED_LOW:
        return "1.5 Mbit/s";
    case LIBUSB_SPEED_FULL:
        return "12 Mbit/s";
    case LIBUSB_SPEED_HIGH:
        return "480 Mbit/s";
    case LIBUSB_SPEED_SUPER:
        return "5 Gbit/s";
    case LIBUSB_SPEED_SUPER_PLUS:
        return "10 Gbit/s";
    default:
        return "unknown speed";
    }
}

class LibusbDevice final : public UsbDevice {
public:
    LibusbDevice(Context context, Handle handle, Endpoint endpoint, std::string description)
        : context_(std::move(context)),
          handle_(std::move(handle)),
          endpoint_(endpoint),
          description_(std::move(description)) {
        for (Transfer& t : transfers_)
            t.transfer = libusb_alloc_transfer(0);
    }

    ~LibusbDevice() override {
        for (std::size_t slot = 0; slot < slots; ++slot) {
            LibusbDevice::cancel(slot);
            // Leak a transfer that the kernel did not return: freeing it would be a use after free.
            if (transfers_[slot].done != 0) libusb_free_transfer(transfers_[slot].transfer);
        }
        libusb_release_interface(handle_.get(), endpoint_.interface);
    }

    UsbResult control_in(std::uint8_t request, std::uint16_t value, std::span<std::uint8_t> data) override {
        return control(vendor_in, request, value, data.data(), data.size());
    }

    UsbResult control_out(std::uint8_t request, std::uint16_t value,
                          std::span<const std::uint8_t> data) override {
        // libusb copies the bytes of an OUT request and does not write to them.
        return control(vendor_out, request, value, const_cast<std::uint8_t*>(data.data()), data.size());
    }

    UsbStatus submit(std::size_t slot, std::span<const std::uint8_t> data) override {
        Transfer& t = transfers_.at(slot);
        assert(t.done != 0);
        libusb_fill_bulk_transfer(t.transfer, handle_.get(), endpoint_.address,
                                  const_cast<std::uint8_t*>(data.data()), static_cast<int>(data.size()),
                                  on_done, &t, bulk_timeout_ms);
        t.done = 0;
        const int code = libusb_submit_transfer(t.transfer);
        if (code < 0) {
            t.done = 1;
            t.result = {from_libusb(code), 0};
        }
        return from_libusb(code);
    }

    UsbResult wait(std::size_t slot, int wait_ms) override {
        Transfer& t = transfers_.at(slot);
        const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(wait_ms);
        while (t.done == 0) {
            const auto left =
                std::chrono::duration_cast<std::chrono::microseconds>(end - std::chrono::steady_clock::now());
            timeval tv{0, 0};
            if (left.count() > 0) {
                tv.tv_sec = static_cast<time_t>(left.count() / 1000000);
                tv.tv_usec = static_cast<suseconds_t>(left.count() % 1000000);
            }
            libusb_handle_events_timeout_completed(context_.get(), &tv, &t.done);
            if (left.count() <= 0) break;
        }
        return t.done != 0 ? t.result : UsbResult{UsbStatus::pending, 0};
    }

    void cancel(std::size_t slot) override {
        Transfer& t = transfers_.at(slot);
        if (t.done != 0) return;
        libusb_cancel_transfer(t.transfer);
        (void)wait(slot, 1000);
    }

    UsbStatus clear_halt() override {
        return from_libusb(libusb_clear_halt(handle_.get(), endpoint_.address));
    }

    [[nodiscard]] std::string description() const override { return description_; }

private:
    struct Transfer {
        libusb_transfer* transfer = nullptr;
        int done = 1; // completion flag that libusb polls
        UsbResult result{UsbStatus::ok, 0};
    };

    static void LIBUSB_CALL on_done(libusb_transfer* transfer) {
        auto& t = *static_cast<Transfer*>(transfer->user_data);
        t.result = {from_transfer(transfer->status), static_cast<std::size_t>(transfer->actual_length)};
        t.done = 1;
    }

    UsbResult control(std::uint8_t type, std::uint8_t request, std::uint16_t value, std::uint8_t* data,
                      std::size_t size) {
        const int code = libusb_control_transfer(handle_.get(), type, request, value, endpoint_.interface,
                                                 data, static_cast<std::uint16_t>(size), control_timeout_ms);
        return {from_libusb(code), code >= 0 ? static_cast<std::size_t>(code) : 0};
    }

    Context context_;
    Handle handle_;
    Endpoint endpoint_;
    std::string description_;
    std::array<Transfer, slots> transfers_;
};

/// True if sysfs lists a device of these numbers, or if sysfs is not available. Far cheaper than a new
/// context, so that a missing device can be polled often.
bool may_be_there(std::uint16_t vendor_id, std::uint16_t product_id) {
    std::error_code error;
    const std::vector<std::filesystem::path> devices = paths_in("/sys/bus/usb/devices", error);
    if (error) return true;
    const auto number = [](const std::filesystem::path& file) {
        unsigned value = 0x10000;
        std::ifstream(file) >> std::hex >> value;
        return value;
    };
    return std::any_of(devices.begin(), devices.end(), [&](const std::filesystem::path& device) {
        return number(device / "idVendor") == vendor_id && number(device / "idProduct") == product_id;
    });
}

class LibusbBus final : public UsbBus {
public:
    std::vector<UsbIdentity> list(std::uint16_t vendor_id, std::uint16_t product_id) override {
        std::vector<UsbIdentity> found;
        // Create a new context: without udev an existing one does not learn of devices connected since.
        context_.reset();
        if (!may_be_there(vendor_id, product_id)) return found;
        context_ = new_context();
        for (libusb_device* device : DeviceList(context_.get())) {
            libusb_device_descriptor d{};
            if (libusb_get_device_descriptor(device, &d) < 0 || d.idVendor != vendor_id ||
                d.idProduct != product_id)
                continue;
            UsbIdentity identity{
                d.idVendor, d.idProduct, libusb_get_bus_number(device), libusb_get_device_address(device),
                {},         {}};
            libusb_device_handle* raw = nullptr;
            if (const int code = libusb_open(device, &raw); code < 0) {
                identity.problem = libusb_strerror(code);
            } else {
                const Handle handle(raw);
                std::array<unsigned char, 256> text{};
                if (d.iSerialNumber != 0) {
                    const int n = libusb_get_string_descriptor_ascii(raw, d.iSerialNumber, text.data(),
                                                                     static_cast<int>(text.size()));
                    for (int i = 0; i < n; ++i) // a serial number goes into messages: printable only
                        identity.serial += text[static_cast<std::size_t>(i)] >= 0x20 &&
                                                   text[static_cast<std::size_t>(i)] < 0x7F
                                               ? static_cast<char>(text[static_cast<std::size_t>(i)])
                                               : '?';
                }
            }
            found.push_back(std::move(identity));
        }
        return found;
    }

    std::unique_ptr<UsbDevice> open(const UsbIdentity& identity) override {
        const Context context = context_ ? std::exchange(context_, nullptr) : new_context();
        const std::string name = fmt::format("{:04x}:{:04x}{}{} at bus {} address {}", identity.vendor_id,
                                             identity.product_id, identity.serial.empty() ? "" : " serial ",
                                             identity.serial, identity.bus, identity.address);
        for (libusb_device* device : DeviceList(context.get())) {
            libusb_device_descriptor d{};
            if (libusb_get_bus_number(device) != identity.bus ||
                libusb_get_device_address(device) != identity.address ||
                libusb_get_device_descriptor(device, &d) < 0 || d.idVendor != identity.vendor_id ||
                d.idProduct != identity.product_id)
                continue;
            libusb_device_handle* raw = nullptr;
            if (const int code = libusb_open(device, &raw); code < 0)
                throw HardwareError(fmt::format(
                    "stimulator {}: cannot be opened: {}{}", name, libusb_strerror(code),
                    code == LIBUSB_ERROR_ACCESS ? "; the udev rule gives it to group 'obscura'" : ""));
            Handle handle(raw);
            Endpoint endpoint;
            if (!find_endpoint(device, endpoint))
                throw HardwareError(fmt::format(
                    "stimulator {}: has no vendor-specific interface with a bulk OUT endpoint", name));
            libusb_set_auto_detach_kernel_driver(raw, 1);
            if (const int code = libusb_claim_interface(raw, endpoint.interface); code < 0)
                throw HardwareError(fmt::format("stimulator {}: interface {} cannot be claimed: {}", name,
                                                endpoint.interface, libusb_strerror(code)));
            return std::make_unique<LibusbDevice>(context, std::move(handle), endpoint,
                                                  fmt::format("{}, {}", name, speed_of(device)));
        }
        throw HardwareError(fmt::format("stimulator {}: has left the bus", name));
    }

private:
    Context context_; ///< context of the last list(), used by the following open()
};

} // namespace

std::unique_ptr<UsbBus> make_libusb_bus() {
    return std::make_unique<LibusbBus>();
}

} // namespace obscura::transports
