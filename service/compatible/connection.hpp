// SPDX-License-Identifier: Apache-2.0
// Connection of one published client: bytes in and out, and a thread that reads its commands and runs them in
// order.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "service/compatible/limits.hpp"
#include "service/compatible/outbox.hpp"
#include "service/compatible/request_reader.hpp"
#include "service/compatible/session.hpp"
#include "service/memory_account.hpp"
#include "service/peer.hpp"

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace obscura::service::compatible {

/// All members are for the server's thread, which never blocks here and does nothing that grows with what a
/// client sends: it receives and sends bytes, at most so many at a time. Messages are read, and whatever is
/// large is freed, on the connection's own thread, which begins with the first byte that comes.
///
/// Reading never waits for writing: the client reads few of its answers (Outbox). It waits while
/// the thread has a MiB to read.
///
/// A fault of the encoding is told in a line of log and ends the connection; any other mistake is a line, and
/// the connection lives on. After the command `close` what was sent before is done first; a connection that
/// just ends cancels it.
class Connection final : public Peer {
public:
    /// `wake` is called on the connection's thread when there is something to send, or room for requests.
    /// `host` and `memory` outlive this.
    Connection(FileDescriptor socket, const CompatibleLimits& limits, Host& host, MemoryAccount& memory,
               std::function<void()> wake);
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
    class Job;

    void receive();
    /// Hands bytes over to the thread. Throws std::system_error, std::bad_alloc.
    void take(std::string bytes);
    void send(Clock::time_point now);
    /// Closes the socket; what waits is done, or given up.
    void hang_up(bool finish);
    /// Tells what is wrong, and ends the connection once that has been sent.
    void end_with(std::string_view what);

    // Called on the connection's thread:
    void run_requests();
    /// Waits for a request. False: none comes any more.
    [[nodiscard]] bool read_ahead(RequestReader& reader);
    /// Reads what has come, and tells the server's thread of it. Throws Failure.
    void read(RequestReader& reader);
    void run(Session& session, const ReadRequest& request);
    void answer(const ReadRequest& request, const Command* command, std::string_view name, Reply reply,
                bool failed);

    const CompatibleLimits limits_;
    Host& host_;
    MemoryAccount& memory_;
    const std::function<void()> wake_;
    FileDescriptor socket_;
    /// What still comes is thrown away; the connection ends when the client ends it, or then.
    std::optional<Clock::time_point> ends_;
    std::string last_bytes_; ///< that came

    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::vector<std::string> received_; ///< pieces, not yet taken by the thread
    std::size_t received_bytes_ = 0;
    std::optional<Clock::time_point> begun_; ///< of the message that is not complete
    bool closed_ = false;                    ///< by the command `close`
    std::string broken_;                     ///< why the connection cannot go on; empty: it can
    Outbox outbox_;
    bool ending_ = false;
    std::atomic<bool> stop_{false};
    std::atomic<bool> at_rest_{true};
    std::thread thread_; ///< last, so that all else is there when it starts
};

} // namespace obscura::service::compatible
