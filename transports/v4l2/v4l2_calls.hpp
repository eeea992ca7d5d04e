// SPDX-License-Identifier: Apache-2.0
// System calls of the V4L2 transport behind an interface, so that a test can replace the driver.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>

namespace obscura::transports {

/// Each call returns the result of the system call, or -errno. Interrupted calls are repeated.
class V4l2Calls {
public:
    virtual ~V4l2Calls() = default;

    /// Opens for reading and writing with O_NONBLOCK.
    virtual int open(const char* path) = 0;
    virtual int close(int fd) = 0;
    [[nodiscard]] virtual bool is_character_device(int fd) = 0;
    virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
    virtual ssize_t write(int fd, const void* data, std::size_t size) = 0;
    /// Maps shared, readable and writable. On failure returns null and sets `error` to errno.
    virtual void* map(int fd, std::int64_t offset, std::size_t size, int& error) = 0;
    virtual void unmap(void* address, std::size_t size) = 0;
    /// Returns 1 when `fd` can take an image, 0 after `timeout_ns`.
    virtual int wait_writable(int fd, std::int64_t timeout_ns) = 0;
};

/// The system calls of this machine.
[[nodiscard]] V4l2Calls& system_v4l2_calls();

} // namespace obscura::transports
