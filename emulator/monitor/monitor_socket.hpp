// SPDX-License-Identifier: Apache-2.0
// Monitor socket: a local SOCK_SEQPACKET server that answers packets of JSON with packets of JSON.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "core/time.hpp"
#include "emulator/monitor/monitor_verbs.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// Serves any number of requests on each connection, one answer for each. Never blocks: a client that does
/// not read its answers is disconnected, and at most `max_clients` are served. Where that many are there and
/// another one waits, a client goes that has asked nothing for `idle_ns`, or nothing at all for `mute_ns`.
/// Thread-bound.
class MonitorSocket {
public:
    static constexpr std::size_t max_clients = 8;
    /// Less than the timeout of clients that wait meanwhile, more than the poll interval of those that watch.
    static constexpr std::int64_t idle_ns = 2 * ns_per_s;
    /// Clients ask as soon as they are connected.
    static constexpr std::int64_t mute_ns = ns_per_s / 5;
    /// Makes the answer to one request, of at most monitor_answer_bytes; must not throw.
    using Answer = std::function<MonitorAnswer(std::string_view request)>;

    /// Opens nothing yet.
    MonitorSocket(std::filesystem::path path, Answer answer);
    ~MonitorSocket();
    MonitorSocket(const MonitorSocket&) = delete;
    MonitorSocket& operator=(const MonitorSocket&) = delete;

    /// Creates folder and socket; the socket is for the user and the group of this process. A socket that is
    /// left over at that path is replaced, one that is served is not. Throws HardwareError.
    void start();
    /// Removes the socket.
    void stop();
    /// Accepts clients and answers what they have asked by `now` (CLOCK_MONOTONIC).
    void serve(Time now);

    [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }
    [[nodiscard]] std::size_t clients() const noexcept { return clients_.size(); }

private:
    struct Client {
        FileDescriptor socket;
        Time asked;       ///< its last request, or when it was accepted
        bool mute = true; ///< it has asked nothing yet

        [[nodiscard]] Time may_go() const noexcept { return asked + (mute ? mute_ns : idle_ns); }
    };
    void accept_clients(Time now);
    [[nodiscard]] bool make_room(Time now);
    [[nodiscard]] bool answer_client(Client& client, Time now);

    const std::filesystem::path path_;
    const Answer answer_;
    FileDescriptor listener_;
    std::vector<Client> clients_;
    std::vector<char> request_;
};

} // namespace obscura::emulator
