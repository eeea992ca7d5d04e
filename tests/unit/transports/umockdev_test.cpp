// SPDX-License-Identifier: Apache-2.0
// Discovery, use and loss of a USB display and of a video node through the real system calls, libusb and
// sysfs, which umockdev answers in place of the kernel. To be run by umockdev-wrapper. GPIO lines cannot be
// had that way (a request for one gives a new descriptor); tests/kernel has those.
#include "core/camera/frame.hpp"
#include "tests/support/catch.hpp"
#include "tools/stimulator-sim/gud_device.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/stimulator_output.hpp"
#include "transports/v4l2/v4l2_output.hpp"

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
#include <mutex>
#include <thread>
#include <vector>

namespace umockdev_test {

using namespace obscura;
using namespace obscura::transports;

namespace {

constexpr std::uint16_t vendor = 0x1d50, product = 0x614d;
constexpr std::int32_t width = 96, height = 80;

template<typename T>
struct Unref {
    void operator()(T* object) const { g_object_unref(object); }
};
template<typename T>
using Object = std::unique_ptr<T, Unref<T>>;
using Data = Object<UMockdevIoctlData>;

template<typename F>
bool eventually(F truth) {
    for (int i = 0; i < 120'000; ++i) { // two minutes: only a test that fails waits that long
        if (truth()) return true;
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
}

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

void complete(UMockdevIoctlClient* client, long result, int error = 0) {
    umockdev_ioctl_client_complete(client, result, error);
}

/// A GUD display behind usbfs.
class UsbDisplay {
public:
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

std::uint16_t value(std::uint64_t frame, std::size_t pixel) {
    return static_cast<std::uint16_t>((frame * 7 + pixel) & 255u);
}

/// A whole frame; the transport has it when this returns.
template<typename Output>
void shoot(Output& output, FramePool& pool, std::uint64_t id) {
    const FrameRef frame = pool.acquire();
    REQUIRE(frame);
    frame->info.frame_id = id;
    frame->info.width = width, frame->info.height = height;
    frame->info.bits_per_pixel = 8;
    frame->info.windows[0].sensor = {0, 0, width, height};
    for (std::size_t i = 0; i < frame->pixels().size(); ++i)
        frame->pixels()[i] = value(id, i);
    frame->publish_rows(height);
    output.submit(frame);
    REQUIRE(eventually([&] {
        const auto c = output.counters();
        return c.delivered + c.dropped == c.submitted;
    }));
}

} // namespace

TEST_CASE("libusb finds the display among others, asks its serial number and misses it when it has gone") {
    Testbed bed;
    const auto bus = make_libusb_bus();
    CHECK(bus->list(vendor, product).empty());
    UsbDisplay other(bed, "OTHER");
    other.plug(0x1234);
    CHECK(bus->list(vendor, product).empty());
    other.unplug();
    UsbDisplay display(bed, "MOCK\n7");
    display.plug();
    const auto found = bus->list(vendor, product);
    REQUIRE(found.size() == 1);
    CHECK(found[0].serial == "MOCK?7");
    CHECK(found[0].bus == 1);
    CHECK(found[0].address == 2);
    CHECK(found[0].problem.empty());
    const auto device = bus->open(found[0]);
    CHECK(device->description() == "1d50:614d serial MOCK?7 at bus 1 address 2, 480 Mbit/s");
    display.unplug();
    CHECK(bus->list(vendor, product).empty());
    std::array<std::uint8_t, 1> status{};
    CHECK_FALSE(device->control_in(0, 0, status).ok());
}

TEST_CASE("frames reach the display through libusb, and again when it was pulled out and put back") {
    Testbed bed;
    UsbDisplay display(bed, "MOCK-1");
    StimulatorSettings settings;
    settings.white_dn = 255;
    settings.dither = Dither::none;
    const StimulatorContext context{
        .sensor = {width, height, 8}, .look_ns = 5 * ns_per_ms, .reconnect_ns = 5 * ns_per_ms};
    StimulatorOutput output(settings, context, make_libusb_bus());
    output.start();
    FramePool pool(4, std::size_t{width} * height, height);
    std::uint64_t id = 0;
    for (int turn = 0; turn < 3; ++turn) {
        CHECK_FALSE(output.status().connected);
        display.plug();
        REQUIRE(eventually([&] { return output.status().connected; }));
        for (int i = 0; i < 3; ++i) {
            const auto before = output.counters();
            shoot(output, pool, ++id);
            REQUIRE(output.counters().delivered == before.delivered + 1);
            const std::vector<std::uint8_t> screen = display.screen();
            REQUIRE(screen.size() == std::size_t{width} * height);
            std::size_t wrong = 0;
            for (std::size_t p = 0; p < screen.size(); ++p)
                wrong += screen[p] != value(id, p);
            CHECK(wrong == 0);
        }
        display.unplug();
        REQUIRE(eventually([&] { return !output.status().connected; }));
    }
    output.stop();
    CHECK(pool.in_use() == 0);
}

TEST_CASE("images reach a video node through the system calls, also after it went and came back") {
    Testbed bed;
    VideoNode node(bed);
    V4l2Settings settings;
    settings.device = VideoNode::path;
    settings.format = V4l2Format::grey;
    V4l2Context context;
    context.width = width, context.height = height, context.bits_per_pixel = 8;
    context.retry_first_ns = context.retry_last_ns = 5 * ns_per_ms;
    V4l2Output output(settings, context);
    output.start(); // the node may come later
    FramePool pool(4, std::size_t{width} * height, height);
    std::uint64_t id = 0;
    shoot(output, pool, ++id);
    CHECK(output.counters().dropped == 1);
    for (int turn = 0; turn < 3; ++turn) {
        // Something else by that name first.
        node.plug(V4L2_CAP_VIDEO_CAPTURE);
        shoot(output, pool, ++id);
        node.unplug();
        node.plug();
        const std::size_t before = node.images().size();
        REQUIRE(eventually([&] {
            shoot(output, pool, ++id);
            return node.images().size() > before;
        }));
        const auto image = node.images().back();
        REQUIRE(image.size() == std::size_t{width} * height);
        std::size_t wrong = 0;
        for (std::size_t p = 0; p < image.size(); ++p)
            wrong += image[p] != value(id, p);
        CHECK(wrong == 0);
        node.unplug();
        const auto dropped = output.counters().dropped;
        REQUIRE(eventually([&] {
            shoot(output, pool, ++id);
            return output.counters().dropped > dropped;
        }));
    }
    output.stop();
    CHECK(pool.in_use() == 0);
}

} // namespace umockdev_test
