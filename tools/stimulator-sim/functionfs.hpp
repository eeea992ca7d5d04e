// SPDX-License-Identifier: Apache-2.0
// GUD display served through FunctionFS, the kernel's interface for USB devices in user space.
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

/// GUD display on a mounted FunctionFS instance. The thread that calls run() serves control requests on ep0;
/// a thread of its own reads pictures from ep1.
class FunctionFsDisplay {
public:
    /// Writes descriptors and strings; from then on the gadget can be bound to a controller. Throws
    /// HardwareError. `directory` is the mount point.
    FunctionFsDisplay(std::filesystem::path directory, GudDeviceSettings settings);
    ~FunctionFsDisplay();

    /// Serves requests until `stop` returns true; it is called ten times a second.
    void run(const std::function<bool()>& stop);

    /// Called for each update received, on the thread of ep1, with the display locked.
    std::function<void(const GudDevice& display, const GudUpdate& update)> on_update;
    /// Called with one line for each refused request, and when the host connects or disconnects.
    std::function<void(const std::string& line)> on_event;
    /// Calls `use` with the display locked. Thread-safe.
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
    std::mutex mutex_; // guards the members from changed_ to reads_begun_
    std::condition_variable changed_;
    GudDevice display_;
    bool enabled_ = false;
    bool reading_ = false;
    std::uint64_t reads_begun_ = 0;
    std::atomic<bool> quit_{false}, restart_{false};
    std::thread reader_;
};

} // namespace obscura::tools
