// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/control/control_server.hpp"

#include "core/error.hpp"
#include "core/realtime/realtime.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>

#include <cerrno>
#include <cstring>

namespace obscura::transports::gige {
namespace {

sockaddr_in socket_address(std::uint32_t ip, int port) {
    sockaddr_in a{};
    a.sin_family = AF_INET;
    a.sin_addr.s_addr = htonl(ip);
    a.sin_port = htons(static_cast<std::uint16_t>(port));
    return a;
}

FileDescriptor bind_socket(const NetworkInterface& network, std::uint32_t ip, int port, bool broadcast) {
    FileDescriptor fd(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (fd.get() < 0)
        throw HardwareError(fmt::format("gige: cannot open a control socket: {}", std::strerror(errno)));
    const int on = 1;
    // Broadcasts go to every camera of the host. The unicast address is exclusive, so that a second camera
    // there fails with EADDRINUSE.
    if (broadcast) {
        setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
        // Without CAP_NET_RAW older kernels refuse this; discovery then also answers to other interfaces.
        setsockopt(fd.get(), SOL_SOCKET, SO_BINDTODEVICE, network.name.c_str(),
                   static_cast<socklen_t>(network.name.size()));
    }
    const sockaddr_in a = socket_address(ip, port);
    if (bind(fd.get(), reinterpret_cast<const sockaddr*>(&a), sizeof a) != 0) {
        const int cause = errno;
        throw HardwareError(fmt::format("gige.port: cannot bind UDP {}:{} on {}: {}{}", dotted(ip), port,
                                        network.name, std::strerror(cause),
                                        cause == EADDRINUSE ? " (another camera there?)" : ""));
    }
    return fd;
}

} // namespace

ControlServer::ControlServer(ControlPort& port, const NetworkInterface& network, const Clock& clock,
                             int udp_port, const ThreadSettings& thread)
    : port_(port), network_(network), clock_(clock), udp_port_(udp_port), thread_settings_(thread) {}

void ControlServer::start() {
    sockets_[0] = bind_socket(network_, network_.address, udp_port_, false);
    sockets_[1] = bind_socket(network_, INADDR_BROADCAST, udp_port_, true);
    if (network_.broadcast != INADDR_BROADCAST && network_.broadcast != network_.address)
        sockets_[2] = bind_socket(network_, network_.broadcast, udp_port_, true);
    epoll_ = FileDescriptor(epoll_create1(EPOLL_CLOEXEC));
    timer_ = FileDescriptor(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK));
    stop_event_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    release_event_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    work_event_ = FileDescriptor(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    const auto watch = [this](int fd) {
        epoll_event e{};
        e.events = EPOLLIN;
        e.data.fd = fd;
        if (fd >= 0 && epoll_ctl(epoll_.get(), EPOLL_CTL_ADD, fd, &e) != 0)
            throw HardwareError(fmt::format("gige: epoll: {}", std::strerror(errno)));
    };
    for (const FileDescriptor& s : sockets_)
        watch(s.get());
    watch(timer_.get());
    watch(stop_event_.get());
    watch(release_event_.get());
    watch(work_event_.get());
    work_.open();
    armed_ = {INT64_MAX};
    thread_ = std::thread([this] { loop(); });
}

void ControlServer::signal(const FileDescriptor& event) {
    const std::uint64_t one = 1;
    while (write(event.get(), &one, sizeof one) < 0 && errno == EINTR) {
    }
}

void ControlServer::release_control() {
    if (thread_.joinable()) signal(release_event_);
}

bool ControlServer::run(const std::function<void()>& work) {
    return work_.run(work, [this] { signal(work_event_); });
}

void ControlServer::announce_disk() noexcept {
    constexpr std::int64_t max_write_ns = 60 * ns_per_s;
    heartbeat_.allow_silence_until(MonotonicClock().now() + max_write_ns);
}

void ControlServer::stop() {
    if (!thread_.joinable()) return;
    signal(stop_event_);
    thread_.join();
    work_.close();
    heartbeat_.rest();
    port_.release("is left: the camera stops");
    for (FileDescriptor& s : sockets_)
        s = {};
}

void ControlServer::loop() {
    enter_thread(heartbeat_.name().c_str(), thread_settings_);
    for (;;) {
        heartbeat_.beat();
        constexpr int max_wait_ms = Heartbeat::max_wait_ns / ns_per_ms;
        std::array<epoll_event, 8> events{};
        const int n = epoll_wait(epoll_.get(), events.data(), static_cast<int>(events.size()), max_wait_ms);
        for (int i = 0; i < n; ++i) {
            const int fd = events[static_cast<std::size_t>(i)].data.fd;
            if (fd == stop_event_.get()) return;
            if (fd == release_event_.get()) {
                std::uint64_t requests = 0;
                if (read(fd, &requests, sizeof requests) > 0 && port_.controlled())
                    port_.release("has lost control by obscura release");
                continue;
            }
            if (fd == work_event_.get()) {
                std::uint64_t handed_over = 0;
                if (read(fd, &handed_over, sizeof handed_over) > 0) work_.serve();
                heartbeat_.beat();
                continue;
            }
            if (fd == timer_.get()) {
                std::uint64_t expirations = 0;
                if (read(fd, &expirations, sizeof expirations) < 0 && errno != EAGAIN) continue;
                armed_ = {INT64_MAX};
                port_.on_timer(clock_.now());
                Peer to;
                if (const auto late = port_.take_due_reply(clock_.now(), to); !late.empty()) {
                    const sockaddr_in a = socket_address(to.ip, to.port);
                    sendto(sockets_[0].get(), late.data(), late.size(), MSG_NOSIGNAL,
                           reinterpret_cast<const sockaddr*>(&a), sizeof a);
                }
            } else {
                serve(fd, fd != sockets_[0].get());
            }
        }
        arm_heartbeat();
    }
}

void ControlServer::serve(int fd, bool broadcast) {
    // Read a bounded number per round, so that a flood cannot delay the timer and the stop event.
    for (int i = 0; i < 64; ++i) {
        std::array<std::uint8_t, 2048> datagram;
        sockaddr_in from{};
        socklen_t from_bytes = sizeof from;
        const ssize_t n = recvfrom(fd, datagram.data(), datagram.size(), MSG_TRUNC,
                                   reinterpret_cast<sockaddr*>(&from), &from_bytes);
        if (n < 0) return;
        heartbeat_.beat(); // a round of commands that each take their time is no hung thread
        if (static_cast<std::size_t>(n) > datagram.size()) continue;
        const Peer peer{ntohl(from.sin_addr.s_addr), ntohs(from.sin_port)};
        const auto reply =
            port_.handle({datagram.data(), static_cast<std::size_t>(n)}, peer, broadcast, clock_.now());
        // Answer from the camera's own address always; a full socket buffer costs the client a retry.
        if (!reply.empty())
            sendto(sockets_[0].get(), reply.data(), reply.size(), MSG_NOSIGNAL,
                   reinterpret_cast<const sockaddr*>(&from), from_bytes);
    }
}

void ControlServer::arm_heartbeat() {
    // The deadline moves with every command, so set the timer only when it has expired or must expire sooner.
    const Time due = port_.deadline();
    if (due.ns == INT64_MAX || due >= armed_) return;
    itimerspec spec{};
    spec.it_value.tv_sec = due.ns / ns_per_s;
    spec.it_value.tv_nsec = due.ns % ns_per_s;
    timerfd_settime(timer_.get(), TFD_TIMER_ABSTIME, &spec, nullptr);
    armed_ = due;
}

} // namespace obscura::transports::gige
