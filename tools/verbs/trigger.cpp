// SPDX-License-Identifier: Apache-2.0
// Verb `obscura trigger`: sends trigger datagrams to a daemon whose trigger source is "udp".
#include "core/error.hpp"
#include "core/file_descriptor.hpp"
#include "core/time.hpp"
#include "sync/clock_reading.hpp"
#include "sync/sources/udp.hpp"
#include "sync/udp_input.hpp"
#include "tools/support/interrupt.hpp"
#include "tools/verbs/verb.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <string>

namespace obscura::tools {
namespace {

class Trigger final : public Verb {
public:
    void declare(CommandLine& line) override {
        line.summary = "sends triggers to a camera over UDP";
        line.description =
            "Each trigger starts a frame of a daemon with [trigger] source = \"udp\", as an edge on a wire "
            "would. A trigger is a datagram of 16 bytes, big endian: the letters OBTR, a 32-bit number that "
            "counts from 1 (a gap: lost triggers), and the edge's instant in ns of TAI (64 bits; 0: the "
            "datagram's arrival).";
        line.option("--udp", &address_, "HOST:PORT", "IPv4 address and port that the daemon listens on");
        line.number("--rate", &rate_hz_, "HZ", "Triggers per second", 0.001, 100'000);
        line.number("--frames", &frames_, "N", "Number of triggers; 0: until interrupted", 0, 4e9);
        line.number("--first", &first_, "N", "Number of the first trigger", 1, 4e9);
        line.flag(
            "--stamp", stamp_,
            "Give each trigger the instant of its sending by CLOCK_TAI; on another machine only with both "
            "clocks synchronised");
        line.examples = {"obscura trigger", "obscura trigger --udp 192.168.1.20:5002 --rate 10 --frames 100"};
    }

    int run() override {
        const FileDescriptor socket = connect();
        catch_interrupts();
        timespec next{};
        clock_gettime(CLOCK_MONOTONIC, &next);
        const std::int64_t begin_ns = sync::to_ns(next);
        std::uint32_t sent = 0;
        for (; (frames_ == 0 || sent < frames_) && !interrupted(); ++sent) {
            const std::int64_t at_ns =
                begin_ns + static_cast<std::int64_t>(static_cast<double>(sent) / rate_hz_ * 1e9);
            next = {at_ns / ns_per_s, at_ns % ns_per_s};
            while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr) == EINTR &&
                   !interrupted()) {
            }
            if (interrupted()) break;
            send(socket, first_ + sent);
        }
        // The answer that nothing listens comes after the datagram.
        constexpr int patience_ms = 20;
        pollfd poll{socket.get(), 0, 0};
        if (::poll(&poll, 1, patience_ms) > 0) refuse(pending_error(socket));
        fmt::print("{} trigger{} sent to {}\n", sent, sent == 1 ? "" : "s", address_);
        return exit_ok;
    }

private:
    [[nodiscard]] FileDescriptor connect() const {
        sockaddr_in to{};
        try {
            to = sync::parse_udp_address(address_);
        } catch (const std::invalid_argument& error) {
            throw UsageError(fmt::format("obscura trigger: --udp: {}", error.what()));
        }
        FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
        if (!socket || ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
            refuse(errno);
        return socket;
    }

    void send(const FileDescriptor& socket, std::uint32_t number) const {
        sync::UdpTriggerMessage message{.sequence = number};
        if (stamp_) {
            timespec now{};
            clock_gettime(CLOCK_TAI, &now);
            message.tai_ns = sync::to_ns(now);
        }
        const auto bytes = sync::encode(message);
        if (::send(socket.get(), bytes.data(), bytes.size(), 0) < 0) refuse(errno);
    }

    static int pending_error(const FileDescriptor& socket) {
        int error = 0;
        socklen_t size = sizeof error;
        ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
        return error;
    }

    [[noreturn]] void refuse(int error) const {
        throw HardwareError(fmt::format("obscura trigger: {}: {}{}", address_, std::strerror(error),
                                        error == ECONNREFUSED ? ": nothing listens there" : ""));
    }

    std::string address_ = sync::UdpKind{}.listen;
    double rate_hz_ = 1;
    std::uint32_t frames_ = 1, first_ = 1;
    bool stamp_ = false;
};

} // namespace

std::unique_ptr<Verb> make_trigger() {
    return std::make_unique<Trigger>();
}

} // namespace obscura::tools
