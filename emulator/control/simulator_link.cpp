// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/simulator_link.hpp"

#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <string_view>

namespace obscura::emulator {
namespace {

using service::Failure;
using service::FailureCode;

constexpr std::string_view error_word = "error ";

} // namespace

void SimulatorLink::pose(const std::string& line, const service::Work& work) {
    // A pose is answered only if it is wrong; the state behind it always is.
    send(line + "\nstate\n", work);
    const std::string answer = receive(work);
    if (!answer.starts_with(error_word)) return;
    (void)receive(work);
    throw Failure(FailureCode::bad_argument, answer.substr(error_word.size()));
}

std::string SimulatorLink::step(const std::string& line, const service::Work& work) {
    send(line + "\n", work);
    std::string answer = receive(work);
    if (answer.starts_with(error_word)) throw Failure(FailureCode::not_now, answer.substr(error_word.size()));
    return answer;
}

void SimulatorLink::send(const std::string& text, const service::Work& work) {
    if (!socket_) {
        socket_ = connect_();
        if (!socket_)
            throw Failure(FailureCode::not_now,
                          "the daemon has no simulator port: simulator.enabled is false");
        (void)receive(work); // the greeting
    }
    if (::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size()))
        return;
    socket_ = FileDescriptor();
    throw Failure(FailureCode::not_now, "the daemon is stopping");
}

std::string SimulatorLink::receive(const service::Work& work) {
    constexpr int look_period_ms = 100;
    std::size_t end = input_.find('\n');
    while (end == std::string::npos) {
        if (work.cancelled()) {
            // The port gives up the step of a client that has gone.
            socket_ = FileDescriptor();
            input_.clear();
            throw service::cancelled();
        }
        pollfd polled{socket_.get(), POLLIN, 0};
        if (::poll(&polled, 1, look_period_ms) <= 0) continue;
        std::array<char, 4096> bytes{};
        const ssize_t got = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
        if (got <= 0) {
            socket_ = FileDescriptor();
            input_.clear();
            throw Failure(FailureCode::not_now, "the daemon is stopping");
        }
        input_.append(bytes.data(), static_cast<std::size_t>(got));
        end = input_.find('\n');
    }
    std::string line = input_.substr(0, end);
    input_.erase(0, end + 1);
    return line;
}

} // namespace obscura::emulator
