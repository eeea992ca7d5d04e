// SPDX-License-Identifier: Apache-2.0
#include "tools/stimulator-sim/functionfs.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/realtime.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/usb/functionfs.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

namespace obscura::tools {
namespace {

constexpr int wake_signal = SIGUSR2;
constexpr std::size_t piece = 128 * 1024; // bytes of one read; a multiple of every packet size
constexpr std::size_t max_control_data = 512;
constexpr char interface_name[] = "Optical stimulator";

std::uint64_t now_ns() {
    return static_cast<std::uint64_t>(MonotonicClock().now().ns);
}

#pragma pack(push, 1)
// Descriptors in the order FunctionFS expects: Documentation/usb/functionfs-desc.rst.
struct Endpoints {
    usb_interface_descriptor interface {};
    usb_endpoint_descriptor_no_audio out{};
};
struct SuperSpeedEndpoints {
    Endpoints plain;
    usb_ss_ep_comp_descriptor companion{};
};
struct Descriptors {
    usb_functionfs_descs_head_v2 head{};
    __le32 full_count = 2, high_count = 2, super_count = 3;
    Endpoints full, high;
    SuperSpeedEndpoints super;
};
struct Strings {
    usb_functionfs_strings_head head{};
    __le16 language = 0x0409;
    char name[sizeof(interface_name)]{};
};
#pragma pack(pop)

Endpoints endpoints(std::uint16_t packet) {
    Endpoints e;
    e.interface.bLength = sizeof(e.interface);
    e.interface.bDescriptorType = USB_DT_INTERFACE;
    e.interface.bNumEndpoints = 1;
    e.interface.bInterfaceClass = USB_CLASS_VENDOR_SPEC;
    e.interface.iInterface = 1;
    e.out.bLength = sizeof(e.out);
    e.out.bDescriptorType = USB_DT_ENDPOINT;
    e.out.bEndpointAddress = 1 | USB_DIR_OUT;
    e.out.bmAttributes = USB_ENDPOINT_XFER_BULK;
    e.out.wMaxPacketSize = packet;
    return e;
}

template<typename T>
void write_all(int fd, const T& data, const std::filesystem::path& file) {
    if (::write(fd, &data, sizeof(data)) != static_cast<ssize_t>(sizeof(data)))
        throw HardwareError(fmt::format("{}: {}", file.string(), std::strerror(errno)));
}

} // namespace

OpenFile& OpenFile::operator=(OpenFile&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
}

OpenFile::~OpenFile() {
    if (fd_ >= 0) ::close(fd_);
}

int OpenFile::release() {
    return std::exchange(fd_, -1);
}

FunctionFsDisplay::FunctionFsDisplay(std::filesystem::path directory, GudDeviceSettings settings)
    : directory_(std::move(directory)), display_(std::move(settings)) {
    const std::filesystem::path file = directory_ / "ep0";
    ep0_ = OpenFile(::open(file.c_str(), O_RDWR | O_CLOEXEC));
    if (!ep0_)
        throw HardwareError(fmt::format("{}: {}; it must be a mounted FunctionFS instance", file.string(),
                                        std::strerror(errno)));
    Descriptors d;
    d.head.magic = FUNCTIONFS_DESCRIPTORS_MAGIC_V2;
    d.head.length = sizeof(d);
    d.head.flags = FUNCTIONFS_HAS_FS_DESC | FUNCTIONFS_HAS_HS_DESC | FUNCTIONFS_HAS_SS_DESC;
    d.full = endpoints(64);
    d.high = endpoints(512);
    d.super.plain = endpoints(1024);
    d.super.companion.bLength = sizeof(d.super.companion);
    d.super.companion.bDescriptorType = USB_DT_SS_ENDPOINT_COMP;
    d.super.companion.bMaxBurst = 15;
    write_all(ep0_.get(), d, file);
    Strings s;
    s.head.magic = FUNCTIONFS_STRINGS_MAGIC;
    s.head.length = sizeof(s);
    s.head.str_count = 1;
    s.head.lang_count = 1;
    std::memcpy(s.name, interface_name, sizeof(interface_name));
    write_all(ep0_.get(), s, file);

    display_.on_update = [this](const GudUpdate& update) {
        if (on_update) on_update(display_, update);
    };
    struct sigaction action {};
    action.sa_handler = [](int) {}; // the signal only ends a blocking read()
    sigaction(wake_signal, &action, nullptr);
}

FunctionFsDisplay::~FunctionFsDisplay() {
    quit_ = true;
    while (reader_.joinable()) {
        interrupt_reader();
        bool ended = false;
        {
            std::unique_lock lock(mutex_);
            // A signal that arrives just before the read is lost: repeat until the thread reports its end.
            ended = changed_.wait_for(lock, std::chrono::milliseconds(20),
                                      [this] { return reads_begun_ == ~0ull; });
        }
        if (ended) reader_.join();
    }
}

void FunctionFsDisplay::say(const std::string& line) const {
    if (on_event) on_event(line);
}

void FunctionFsDisplay::with_display(const std::function<void(const GudDevice&)>& use) {
    const std::lock_guard lock(mutex_);
    use(display_);
}

void FunctionFsDisplay::interrupt_reader() {
    restart_ = true;
    changed_.notify_all();
    if (reader_.joinable()) pthread_kill(reader_.native_handle(), wake_signal);
}

void FunctionFsDisplay::run(const std::function<bool()>& stop) {
    reader_ = std::thread([this] { read_pictures(); });
    while (!stop()) {
        pollfd waiting{ep0_.get(), POLLIN, 0};
        if (::poll(&waiting, 1, 100) <= 0) continue;
        std::array<usb_functionfs_event, 4> events{};
        const ssize_t size = ::read(ep0_.get(), events.data(), sizeof(events));
        if (size < 0) {
            // A request interrupted by a disconnect blocks ep0 (ESHUTDOWN, EL2HLT, ...) until the next event
            // cancels it (EIDRM), which may be the next connect.
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            continue;
        }
        for (std::size_t i = 0; i < static_cast<std::size_t>(size) / sizeof(events[0]); ++i) {
            switch (events[i].type) {
            case FUNCTIONFS_ENABLE: {
                const std::lock_guard lock(mutex_);
                enabled_ = true;
                changed_.notify_all();
                say("plugged in");
                break;
            }
            case FUNCTIONFS_DISABLE:
            case FUNCTIONFS_UNBIND: {
                {
                    const std::lock_guard lock(mutex_);
                    if (enabled_) say("unplugged");
                    enabled_ = false;
                    display_.reset();
                    changed_.notify_all();
                }
                // The reader's transfer ends with ESHUTDOWN by itself. Send no signal here: Linux 6.1 forgets
                // a transfer that is interrupted while its endpoint is being disabled, and crashes when it
                // completes.
                break;
            }
            case FUNCTIONFS_SETUP:
                setup(events[i].u.setup);
                break;
            default:
                break;
            }
        }
    }
}

void FunctionFsDisplay::stall(bool device_to_host) const {
    // FunctionFS stalls a request on a read or write in the direction opposite to the request's.
    std::uint8_t none = 0;
    const ssize_t result = device_to_host ? ::read(ep0_.get(), &none, 0) : ::write(ep0_.get(), &none, 0);
    if (result >= 0 || errno != EL2HLT) say(fmt::format("stall failed: {}", std::strerror(errno)));
}

void FunctionFsDisplay::setup(const usb_ctrlrequest& request) {
    const bool device_to_host = (request.bRequestType & USB_DIR_IN) != 0;
    const bool vendor = (request.bRequestType & USB_TYPE_MASK) == USB_TYPE_VENDOR;
    if (device_to_host) {
        std::optional<std::vector<std::uint8_t>> answer;
        std::string complaint;
        if (vendor) {
            const std::lock_guard lock(mutex_);
            answer = display_.control_in(request.bRequest, request.wValue, request.wLength, now_ns());
            if (!answer) complaint = display_.complaint();
        }
        if (!answer) {
            stall(true);
            say(fmt::format("stalled request 0x{:02x}: {}", request.bRequest, complaint));
        } else if (::write(ep0_.get(), answer->data(), answer->size()) < 0) {
            say(fmt::format("ep0: {}", std::strerror(errno)));
        }
        return;
    }
    std::array<std::uint8_t, max_control_data> data{};
    if (!vendor || !display_.knows_control_out(request.bRequest) || request.wLength > data.size()) {
        stall(false);
        say(fmt::format("stalled request 0x{:02x} with {} bytes", request.bRequest, +request.wLength));
        return;
    }
    const ssize_t size = ::read(ep0_.get(), data.data(), request.wLength);
    if (size != request.wLength) {
        say(fmt::format("request 0x{:02x} broke off: {}", request.bRequest,
                        size < 0 ? std::strerror(errno) : "too short"));
        return;
    }
    const auto what = static_cast<gud::Request>(request.bRequest);
    bool restart = what == gud::Request::set_state_commit || what == gud::Request::set_display_enable;
    if (what == gud::Request::set_buffer) {
        // A complete transfer that is not yet processed ends by itself; an aborted transfer does not.
        std::unique_lock lock(mutex_);
        const std::uint64_t current = reads_begun_;
        restart =
            !changed_.wait_for(lock, std::chrono::milliseconds(display_.settings().full_update ? 0 : 200),
                               [&] { return !reading_ || reads_begun_ != current; });
    }
    if (restart) interrupt_reader();
    const std::lock_guard lock(mutex_);
    const std::string before = display_.complaint();
    display_.control_out(request.bRequest, request.wValue, std::span(data).first(request.wLength));
    if (display_.complaint() != before) say("refused: " + display_.complaint());
    changed_.notify_all();
}

bool FunctionFsDisplay::read_exactly(int fd, std::vector<std::uint8_t>& bytes) {
    std::size_t got = 0;
    while (got < bytes.size()) {
        const std::size_t wanted = std::min(piece, bytes.size() - got);
        const ssize_t n = ::read(fd, bytes.data() + got, wanted);
        if (n < 0 && errno == EINTR && !quit_ && !restart_) continue;
        if (n <= 0) {
            if (got > 0 && errno != EINTR)
                say(fmt::format("picture broke off after {} of {} bytes: {}", got, bytes.size(),
                                std::strerror(errno)));
            return false;
        }
        got += static_cast<std::size_t>(n);
        if (static_cast<std::size_t>(n) < wanted) break; // a short packet ends the transfer
    }
    if (got < bytes.size()) {
        say(fmt::format("picture has {} of {} bytes", got, bytes.size()));
        return false;
    }
    return true;
}

void FunctionFsDisplay::read_pictures() {
    name_this_thread("pictures");
    OpenFile ep1;
    std::vector<std::uint8_t> bytes;
    while (!quit_) {
        std::optional<gud::SetBuffer> next;
        {
            std::unique_lock lock(mutex_);
            changed_.wait_for(lock, std::chrono::milliseconds(100), [&] {
                if (quit_ || !enabled_) return quit_.load();
                next = display_.begin_bulk();
                return next.has_value();
            });
            if (!next) continue;
            reading_ = true;
            restart_ = false;
            ++reads_begun_;
        }
        if (!ep1) ep1 = OpenFile(::open((directory_ / "ep1").c_str(), O_RDWR | O_CLOEXEC));
        bytes.resize(next->transfer_length());
        const bool arrived = ep1 && read_exactly(ep1.get(), bytes);
        const std::lock_guard lock(mutex_);
        reading_ = false;
        if (arrived) {
            if (!display_.finish_bulk(*next, bytes, now_ns())) say("refused: " + display_.complaint());
        } else {
            if (!quit_ && enabled_ && !display_.settings().full_update) display_.bulk_failed();
            ep1 = OpenFile();
        }
        changed_.notify_all();
    }
    const std::lock_guard lock(mutex_);
    reads_begun_ = ~0ull;
    changed_.notify_all();
}

} // namespace obscura::tools
