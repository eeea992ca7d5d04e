// A GUD device on FunctionFS: the kernel's way to be a USB device from a program.
#pragma once

#include "tools/stimulator-sim/gud_device.hpp"

#include <atomic>
#include <condition_variable>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

struct usb_ctrlrequest; // <linux/usb/ch9.h>

namespace obscura::tools {

/// Owns a file descriptor.
class OpenFile {
public:
    explicit OpenFile(int fd = -1) : fd_(fd) {}
    OpenFile(OpenFile&& other) noexcept : fd_(other.release()) {}
    OpenFile& operator=(OpenFile&& other) noexcept;
    ~OpenFile();
    [[nodiscard]] int get() const { return fd_; }
    explicit operator bool() const { return fd_ >= 0; }
    int release();

private:
    int fd_;
};

/// Serves `display` on a mounted FunctionFS instance: requests on ep0 in the thread that calls run(),
/// pictures on ep1 in a thread of its own.
class FunctionFsDisplay {
public:
    /// Writes descriptors and strings; from then on the gadget can be bound to a controller. Throws
    /// HardwareError. `directory` is the mount point.
    FunctionFsDisplay(std::filesystem::path directory, GudDeviceSettings settings);
    ~FunctionFsDisplay();

    /// Until `stop` says so; asked ten times a second.
    void run(const std::function<bool()>& stop);

    /// Called for each update that arrived, on the thread of ep1, with the display locked.
    std::function<void(const GudDevice& display, const GudUpdate& update)> on_update;
    /// Called for what is refused and for plugging, one line each.
    std::function<void(const std::string& line)> on_event;
    /// The display, for the time of `use`.
    void with_display(const std::function<void(const GudDevice&)>& use);

private:
    void setup(const usb_ctrlrequest& request);
    void stall(bool device_to_host) const;
    void read_pictures();
    bool read_exactly(int fd, std::vector<std::uint8_t>& bytes);
    void interrupt_reader();
    void say(const std::string& line) const;

    std::filesystem::path directory_;
    OpenFile ep0_;
    std::mutex mutex_; // of what follows
    std::condition_variable changed_;
    GudDevice display_;
    bool enabled_ = false;
    bool reading_ = false;
    std::uint64_t reads_begun_ = 0;
    std::atomic<bool> quit_{false}, restart_{false};
    std::thread reader_;
};

} // namespace obscura::tools
