// SPDX-License-Identifier: Apache-2.0
// A V4L2 output driver for tests, behind the transport's system calls: three temperaments and every fault.
#pragma once

#include "transports/v4l2/v4l2_calls.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

namespace obscura::test {

/// One node. Thread-safe. Complains (complaints) about calls that break the rules of the interface.
class FakeV4l2Driver final : public transports::V4l2Calls {
public:
    enum class Kind : std::uint8_t {
        strict,         ///< queue semantics as videobuf2 has them
        newer_loopback, ///< v4l2loopback 0.15: buffers can always be dequeued, oldest first
        older_loopback  ///< v4l2loopback 0.12: DQBUF returns the buffer queued last
    };
    struct Image {
        std::vector<std::uint8_t> bytes;
        std::int64_t stamp_us = -1; ///< -1: written, without one
        std::uint32_t index = 0, flags = 0;
    };

    // The driver's nature; set before use.
    Kind kind = Kind::strict;
    std::string path = "/dev/video-fake";
    std::uint32_t capabilities = 0; ///< device_caps; 0: output, streaming and read/write
    bool character_device = true;
    std::uint32_t stride_extra = 0; ///< bytes that the driver adds to each row
    std::uint32_t buffers_most = 8;
    std::uint32_t buffer_page = 1; ///< lengths of buffers and sizeimage are multiples of it
    bool consumes = true;          ///< strict: queued buffers are shown at once
    /// May falsify what S_FMT answers.
    std::function<void(std::uint32_t& format, std::uint32_t& width, std::uint32_t& height,
                       std::uint32_t& stride, std::uint32_t& size, std::uint32_t& field)>
        change_format;
    /// Called before each call with its name; a value below 0 is returned instead of doing it.
    std::function<int(const std::string& call)> fault;
    std::size_t write_most = SIZE_MAX; ///< bytes that write() takes
    std::int64_t give_back_index = -1; ///< what DQBUF returns instead of the right one

    // What happens to it while in use.
    void remove();
    void give_back();

    // What was seen.
    [[nodiscard]] std::vector<Image> images() const;
    [[nodiscard]] std::size_t image_count() const;
    [[nodiscard]] std::vector<std::string> complaints() const;
    [[nodiscard]] int open_descriptors() const;
    [[nodiscard]] int open_mappings() const;
    [[nodiscard]] int calls(const std::string& name) const;
    [[nodiscard]] std::pair<std::uint32_t, std::uint32_t> frame_interval() const;

    int open(const char* name) override;
    int close(int fd) override;
    [[nodiscard]] bool is_character_device(int fd) override;
    int ioctl(int fd, unsigned long request, void* argument) override;
    ssize_t write(int fd, const void* data, std::size_t size) override;
    void* map(int fd, std::int64_t offset, std::size_t size, int& error) override;
    void unmap(void* address, std::size_t size) override;
    int wait_writable(int fd, std::int64_t timeout_ns) override;

private:
    struct Buffer {
        std::vector<std::uint8_t> memory;
        bool queued = false, shown = false, mapped = false;
    };
    int enter(const std::string& call, int fd);
    int queue(void* argument);
    int dequeue(void* argument);

    mutable std::mutex mutex_;
    bool present_ = true;
    int next_fd_ = 100;
    std::map<int, bool> descriptors_; ///< whether the node still stands behind it
    bool streaming_ = false;
    std::uint32_t stride_ = 0, height_ = 0, size_ = 0;
    std::vector<Buffer> buffers_;
    std::deque<std::uint32_t> order_; ///< strict: in the queue; loopback: order in which they are given back
    std::vector<std::vector<std::uint8_t>> graveyard_; ///< memory that may still be mapped
    int mappings_ = 0;
    std::vector<Image> images_;
    std::vector<std::string> complaints_;
    std::map<std::string, int> calls_;
    std::pair<std::uint32_t, std::uint32_t> interval_{};
};

} // namespace obscura::test
