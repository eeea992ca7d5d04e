// SPDX-License-Identifier: Apache-2.0
// A USB display and a video node that umockdev answers for in place of the kernel, and that can be unplugged.
#pragma once

#include "tests/support/catch.hpp"
#include "tools/stimulator-sim/gud_device.hpp"

#include <fmt/format.h>
#include <linux/usb/ch9.h>
#include <linux/usbdevice_fs.h>
#include <linux/videodev2.h>
#include <umockdev.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace obscura::test {

template<typename T>
struct Unref {
    void operator()(T* object) const { g_object_unref(object); }
};
template<typename T>
using Object = std::unique_ptr<T, Unref<T>>;
using Data = Object<UMockdevIoctlData>;

/// A made-up /sys and /dev, and the thread on which its devices answer.
class Testbed {
public:
    Testbed() : bed_(umockdev_testbed_new()) {
        pump_ = std::thread([this] {
            while (!stopping_) {
                while (g_main_context_iteration(nullptr, FALSE)) {
                }
                std::this_thread::sleep_for(std::chrono::microseconds(200));
            }
        });
    }
    ~Testbed() {
        stopping_ = true;
        pump_.join();
    }
    Testbed(const Testbed&) = delete;
    Testbed& operator=(const Testbed&) = delete;

    void add(const std::string& description) {
        GError* error = nullptr;
        const bool added = umockdev_testbed_add_from_string(bed_.get(), description.c_str(), &error) != FALSE;
        INFO((error != nullptr ? error->message : ""));
        REQUIRE(added);
    }
    void attach(const char* node, UMockdevIoctlBase* handler) {
        GError* error = nullptr;
        REQUIRE(umockdev_testbed_attach_ioctl(bed_.get(), node, handler, &error));
    }
    /// The node of a device stays unless it is taken away as well.
    void remove(const std::string& place, const std::string& node) {
        umockdev_testbed_detach_ioctl(bed_.get(), node.c_str(), nullptr);
        umockdev_testbed_remove_device(bed_.get(), ("/sys" + place).c_str());
        std::filesystem::remove(root() + node);
    }
    [[nodiscard]] std::string root() const {
        gchar* text = umockdev_testbed_get_root_dir(bed_.get());
        std::string root = text;
        g_free(text);
        return root;
    }

private:
    Object<UMockdevTestbed> bed_;
    std::atomic<bool> stopping_{false};
    std::thread pump_;
};

inline void complete(UMockdevIoctlClient* client, long result, int error = 0) {
    umockdev_ioctl_client_complete(client, result, error);
}

/// A GUD display behind usbfs.
class UsbDisplay {
public:
    static constexpr std::uint16_t vendor = 0x1d50, product = 0x614d;
    static constexpr std::int32_t width = 96, height = 80;

    UsbDisplay(Testbed& bed, std::string serial)
        : bed_(bed), serial_(std::move(serial)), display_(settings()) {
        g_signal_connect(handler_.get(), "handle-ioctl", G_CALLBACK(&UsbDisplay::on_ioctl), this);
    }
    void plug(std::uint16_t product_id = product) {
        std::array<std::uint8_t, 18 + 9 + 9 + 7> d{
            18, 1, 0x10, 0x02, 0, 0,    0, 64,   0,
            0,  0, 0,    0,    1, 0,    0, 3,    1,   // device; serial number is string 3
            9,  2, 25,   0,    1, 1,    0, 0x80, 125, // configuration
            9,  4, 0,    0,    1, 0xFF, 0, 0,    0,   // interface, vendor-specific
            7,  5, 1,    2,    0, 2,    0};           // bulk OUT 1, 512 bytes
        d[8] = vendor & 0xFF, d[9] = vendor >> 8, d[10] = product_id & 0xFF, d[11] = product_id >> 8;
        std::string hex;
        for (const std::uint8_t byte : d)
            hex += fmt::format("{:02X}", byte);
        bed_.add(fmt::format(
            "P: {}\nN: bus/usb/001/002\nE: DEVTYPE=usb_device\nE: SUBSYSTEM=usb\nE: BUSNUM=001\n"
            "E: DEVNUM=002\nE: DEVNAME=/dev/bus/usb/001/002\nE: MAJOR=189\nE: MINOR=1\nA: busnum=1\\n\n"
            "A: devnum=2\\n\nA: speed=480\\n\nA: bConfigurationValue=1\\n\nA: idVendor={:04x}\\n\n"
            "A: idProduct={:04x}\\n\nH: descriptors={}\n",
            place, vendor, product_id, hex));
        {
            const std::lock_guard lock(mutex_);
            plugged_ = true;
        }
        bed_.attach(node, handler_.get());
    }
    void unplug() {
        {
            const std::lock_guard lock(mutex_);
            plugged_ = false;
            display_.reset();
        }
        bed_.remove(place, node);
    }
    std::vector<std::uint8_t> screen() {
        const std::lock_guard lock(mutex_);
        return {display_.screen().begin(), display_.screen().end()};
    }

private:
    static constexpr const char* place = "/devices/pci0000:00/0000:00:01.0/usb1/1-1";
    static constexpr const char* node = "/dev/bus/usb/001/002";

    static tools::GudDeviceSettings settings() {
        tools::GudDeviceSettings s;
        s.width = width;
        s.height = height;
        return s;
    }
    static gboolean on_ioctl(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer self) {
        static_cast<UsbDisplay*>(self)->answer(client);
        return TRUE;
    }

    void answer(UMockdevIoctlClient* client) {
        const std::lock_guard lock(mutex_);
        UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
        const gulong request = umockdev_ioctl_client_get_request(client);
        if (!plugged_ && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_REAPURB)
            return complete(client, -1, ENODEV);
        switch (request) {
        case USBDEVFS_GET_CAPABILITIES: {
            std::uint32_t can = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
            const Data data(umockdev_ioctl_data_resolve(argument, 0, sizeof can, nullptr));
            umockdev_ioctl_data_update(data.get(), 0, reinterpret_cast<guint8*>(&can), sizeof can);
            return complete(client, 0);
        }
        case USBDEVFS_SUBMITURB:
            return submit(client, argument);
        case USBDEVFS_REAPURB:
        case USBDEVFS_REAPURBNDELAY: {
            if (done_.empty()) return complete(client, -1, plugged_ ? EAGAIN : ENODEV);
            const Data pointer(umockdev_ioctl_data_resolve(argument, 0, sizeof(void*), nullptr));
            umockdev_ioctl_data_set_ptr(pointer.get(), 0, done_.front());
            done_.pop_front();
            return complete(client, 0);
        }
        case USBDEVFS_GETDRIVER:
            return complete(client, -1, ENODATA);
        case USBDEVFS_DISCARDURB:
            return complete(client, -1, EINVAL);
        default: // claiming and releasing
            return complete(client, 0);
        }
    }
    void submit(UMockdevIoctlClient* client, UMockdevIoctlData* argument) {
        UMockdevIoctlData* held =
            umockdev_ioctl_data_resolve(argument, 0, offsetof(usbdevfs_urb, iso_frame_desc), nullptr);
        if (held == nullptr) return complete(client, -1, EFAULT);
        auto* urb = reinterpret_cast<usbdevfs_urb*>(held->data);
        const Data bytes(umockdev_ioctl_data_resolve(held, offsetof(usbdevfs_urb, buffer),
                                                     static_cast<gulong>(urb->buffer_length), nullptr));
        const std::span<std::uint8_t> data(bytes->data, static_cast<std::size_t>(urb->buffer_length));
        const int moved = urb->type == USBDEVFS_URB_TYPE_CONTROL ? control(data)
                          : urb->type == USBDEVFS_URB_TYPE_BULK  ? bulk(data)
                                                                 : -EPIPE;
        urb->status = std::min(moved, 0);
        urb->actual_length = std::max(moved, 0);
        done_.push_back(held);
        complete(client, 0);
    }
    int control(std::span<std::uint8_t> data) {
        usb_ctrlrequest setup{};
        std::memcpy(&setup, data.data(), sizeof setup);
        const std::span<std::uint8_t> payload = data.subspan(sizeof setup, setup.wLength);
        std::vector<std::uint8_t> reply;
        if (setup.bRequestType == USB_DIR_IN && setup.bRequest == USB_REQ_GET_DESCRIPTOR &&
            setup.wValue >> 8 == USB_DT_STRING) {
            reply = {0, USB_DT_STRING};
            if ((setup.wValue & 0xFF) == 0)
                reply.insert(reply.end(), {0x09, 0x04});
            else
                for (const char c : serial_)
                    reply.insert(reply.end(), {static_cast<std::uint8_t>(c), 0});
            reply[0] = static_cast<std::uint8_t>(reply.size());
        } else if (setup.bRequestType == 0xC1) {
            const auto answer = display_.control_in(setup.bRequest, setup.wValue, payload.size(), 1000);
            if (!answer) return -EPIPE;
            reply = *answer;
        } else if (setup.bRequestType == 0x41 && display_.knows_control_out(setup.bRequest)) {
            display_.control_out(setup.bRequest, setup.wValue, payload);
            return static_cast<int>(payload.size());
        } else {
            return -EPIPE;
        }
        const std::size_t count = std::min(reply.size(), payload.size());
        std::copy_n(reply.begin(), count, payload.begin());
        return static_cast<int>(count);
    }
    int bulk(std::span<const std::uint8_t> data) {
        const auto next = display_.begin_bulk();
        return next && display_.finish_bulk(*next, data, 1000) ? static_cast<int>(data.size()) : -EPIPE;
    }

    Testbed& bed_;
    const std::string serial_;
    Object<UMockdevIoctlBase> handler_{umockdev_ioctl_base_new()};
    std::mutex mutex_; // of everything below
    tools::GudDevice display_;
    bool plugged_ = false;
    std::deque<UMockdevIoctlData*> done_;
};

/// A video output node that takes images by write().
class VideoNode {
public:
    explicit VideoNode(Testbed& bed) : bed_(bed) {
        g_signal_connect(handler_.get(), "handle-ioctl", G_CALLBACK(&VideoNode::on_ioctl), this);
        g_signal_connect(handler_.get(), "handle-write", G_CALLBACK(&VideoNode::on_write), this);
        bed.add("P: /devices/virtual/video4linux/video10\nN: video10\nE: SUBSYSTEM=video4linux\n"
                "E: DEVNAME=/dev/video10\nE: MAJOR=81\nE: MINOR=10\nA: name=mock\n");
        bed.attach(path, handler_.get());
        unplug();
    }
    // umockdev cannot make the same node twice, so it is put aside.
    void plug(std::uint32_t capabilities = V4L2_CAP_VIDEO_OUTPUT) {
        capabilities_ = capabilities;
        gone_ = false;
        std::filesystem::rename(bed_.root() + "/dev/aside", bed_.root() + path);
    }
    void unplug() {
        gone_ = true;
        std::filesystem::rename(bed_.root() + path, bed_.root() + "/dev/aside");
    }
    std::vector<std::vector<std::uint8_t>> images() {
        const std::lock_guard lock(mutex_);
        return images_;
    }
    static constexpr const char* path = "/dev/video10";

private:
    static gboolean on_ioctl(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer self) {
        auto& node = *static_cast<VideoNode*>(self);
        UMockdevIoctlData* argument = umockdev_ioctl_client_get_arg(client);
        if (node.gone_) {
            complete(client, -1, ENODEV);
            return TRUE;
        }
        switch (umockdev_ioctl_client_get_request(client)) {
        case VIDIOC_QUERYCAP: {
            v4l2_capability can{};
            std::strcpy(reinterpret_cast<char*>(can.driver), "mock");
            can.device_caps = node.capabilities_ | V4L2_CAP_READWRITE;
            can.capabilities = can.device_caps | V4L2_CAP_DEVICE_CAPS;
            const Data data(umockdev_ioctl_data_resolve(argument, 0, sizeof can, nullptr));
            umockdev_ioctl_data_update(data.get(), 0, reinterpret_cast<guint8*>(&can), sizeof can);
            break;
        }
        case VIDIOC_S_FMT: { // takes what is asked for
            const Data data(umockdev_ioctl_data_resolve(argument, 0, sizeof(v4l2_format), nullptr));
            break;
        }
        case VIDIOC_S_PARM:
            break;
        default:
            complete(client, -1, ENOTTY);
            return TRUE;
        }
        complete(client, 0);
        return TRUE;
    }
    static gboolean on_write(UMockdevIoctlBase* /*base*/, UMockdevIoctlClient* client, gpointer self) {
        auto& node = *static_cast<VideoNode*>(self);
        const UMockdevIoctlData* data = umockdev_ioctl_client_get_arg(client);
        if (node.gone_) {
            complete(client, -1, ENODEV);
            return TRUE;
        }
        const std::lock_guard lock(node.mutex_);
        node.images_.emplace_back(data->data, data->data + data->data_len);
        complete(client, data->data_len);
        return TRUE;
    }

    Testbed& bed_;
    Object<UMockdevIoctlBase> handler_{umockdev_ioctl_base_new()};
    std::atomic<std::uint32_t> capabilities_{0};
    std::atomic<bool> gone_{true};
    std::mutex mutex_;
    std::vector<std::vector<std::uint8_t>> images_;
};

} // namespace obscura::test
