// SPDX-License-Identifier: Apache-2.0
#include "transports/v4l2/v4l2_calls.hpp"

#include "core/time.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace obscura::transports {

namespace {

template<typename Call>
auto until_done(Call call) {
    for (;;) {
        const auto result = call();
        if (result >= 0) return result;
        if (errno != EINTR) return static_cast<decltype(result)>(-errno);
    }
}

class SystemV4l2Calls final : public V4l2Calls {
public:
    int open(const char* path) override {
        return until_done([&] { return ::open(path, O_RDWR | O_NONBLOCK | O_CLOEXEC); });
    }
    int close(int fd) override {
        // Do not repeat: Linux closes the descriptor even if a signal interrupts close().
        return ::close(fd) == 0 ? 0 : -errno;
    }
    bool is_character_device(int fd) override {
        struct stat status {};
        return ::fstat(fd, &status) == 0 && S_ISCHR(status.st_mode);
    }
    int ioctl(int fd, unsigned long request, void* argument) override {
        return until_done([&] { return ::ioctl(fd, request, argument); });
    }
    ssize_t write(int fd, const void* data, std::size_t size) override {
        return until_done([&] { return ::write(fd, data, size); });
    }
    void* map(int fd, std::int64_t offset, std::size_t size, int& error) override {
        void* address = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, offset);
        if (address != MAP_FAILED) return address;
        error = errno;
        return nullptr;
    }
    void unmap(void* address, std::size_t size) override { ::munmap(address, size); }
    int wait_writable(int fd, std::int64_t timeout_ns) override {
        pollfd wait{fd, POLLOUT, 0};
        const timespec timeout{timeout_ns / ns_per_s, timeout_ns % ns_per_s};
        const int ready = ::ppoll(&wait, 1, &timeout, nullptr);
        if (ready < 0) return errno == EINTR ? 0 : -errno;
        // Errors count as ready: the next call on the descriptor returns the error.
        return ready;
    }
};

} // namespace

V4l2Calls& system_v4l2_calls() {
    static SystemV4l2Calls calls;
    return calls;
}

} // namespace obscura::transports
