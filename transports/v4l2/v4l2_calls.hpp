// The system calls the V4L2 transport makes, behind an interface, so that a test can be the driver.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <cstdint>

namespace obscura::transports {

/// Every call returns what the system call returns, or -errno. Interrupted calls are repeated.
class V4l2Calls {
public:
    virtual ~V4l2Calls() = default;

    /// Opens for reading and writing, without blocking, now or later.
    virtual int open(const char* path) = 0;
    virtual int close(int fd) = 0;
    [[nodiscard]] virtual bool is_character_device(int fd) = 0;
    virtual int ioctl(int fd, unsigned long request, void* argument) = 0;
    virtual ssize_t write(int fd, const void* data, std::size_t size) = 0;
    /// Shared, readable and writable. Null and errno in `error` when it cannot be had.
    virtual void* map(int fd, std::int64_t offset, std::size_t size, int& error) = 0;
    virtual void unmap(void* address, std::size_t size) = 0;
    /// Waits until `fd` can take an image: 1; or until the time is over: 0.
    virtual int wait_writable(int fd, std::int64_t timeout_ns) = 0;
};

/// The real ones.
[[nodiscard]] V4l2Calls& system_v4l2_calls();

} // namespace obscura::transports
