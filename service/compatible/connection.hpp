// SPDX-License-Identifier: Apache-2.0
// Connection of one published client: messages in and out, and a thread that runs its commands in order.
#pragma once

#include "core/file_descriptor.hpp"
#include "service/compatible/codec.hpp"
#include "service/compatible/limits.hpp"
#include "service/compatible/outbox.hpp"
#include "service/compatible/session.hpp"
#include "service/peer.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace obscura::service::compatible {

/// All members are for the server's thread, which never blocks here. Reading never waits for writing: the
/// client reads few of its answers (Outbox). It waits while DoorLimits::requests wait to be done.
///
/// A fault of the encoding is told in a line of log and ends the connection; any other mistake is a line, and
/// the connection lives on. After the command `close` what was sent before is done first; a connection that
/// just ends cancels it.
class Connection final : public Peer {
public:
    /// `wake` is called on the connection's thread when there is something to send, or room for requests.
    Connection(FileDescriptor socket, const DoorLimits& limits, Host& host, std::function<void()> wake);
    /// Waits for the command in progress.
    ~Connection() override;

    [[nodiscard]] int socket() const noexcept override { return socket_.get(); }
    [[nodiscard]] short events() const override;
    void serve(short events) override;
    void look_at(Clock::time_point now) override;
    void end() override;
    [[nodiscard]] bool gone() const noexcept override { return !socket_; }
    [[nodiscard]] bool at_rest() const noexcept override { return at_rest_.load(); }

private:
    struct Request {
        std::uint64_t number = 0;
        std::size_t bytes = 0;
        Fields message;
    };
    class Job;

    void receive();
    void take_messages();
    void send(Clock::time_point now);
    /// Closes the socket; what waits is done, or given up.
    void hang_up(bool finish);
    /// Tells what is wrong, and ends the connection once that has been sent.
    void end_with(const Failure& failure);
    void run_requests();
    void run(const Request& request);
    void answer(const Request& request, const Command* command, std::string_view name, Reply reply,
                bool failed);

    const DoorLimits limits_;
    const std::function<void()> wake_;
    FileDescriptor socket_;
    const std::unique_ptr<Session> session_;
    Decoder decoder_;
    std::string input_;
    std::optional<Clock::time_point> begun_; ///< of the message whose first bytes have come
    /// What still comes is thrown away; the connection ends when the client ends it, or then.
    std::optional<Clock::time_point> ends_;
    bool closed_ = false; ///< by the command `close`

    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::deque<Request> waiting_;
    std::size_t waiting_bytes_ = 0;
    mutable bool paused_ = false; ///< nothing is read until half of them are done
    Outbox outbox_;
    bool ending_ = false;
    std::atomic<bool> stop_{false};
    std::atomic<bool> at_rest_{false};
    std::thread thread_; ///< last, so that all else is there when it starts
};

} // namespace obscura::service::compatible
