// SPDX-License-Identifier: Apache-2.0
// Connection of one client: messages in and out, and a thread that runs its calls in order.
#pragma once

#include "core/file_descriptor.hpp"
#include "core/stack_thread.hpp"
#include "service/limits.hpp"
#include "service/message.hpp"
#include "service/peer.hpp"
#include "service/session.hpp"
#include "service/shared_ring.hpp"
#include "service/tokens.hpp"

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace obscura::service {

/// All members are for the server's thread, which never blocks here; calls run on a thread of the connection.
/// A fault of the framing is answered and ends the connection; any other mistake is answered, and the
/// connection lives on. The end of the connection cancels its calls.
class Connection final : public Peer {
public:
    /// `wake` is called on the connection's thread when there is something to send. `host` and `memory`
    /// outlive this.
    Connection(FileDescriptor socket, const Limits& limits, Host& host, const Access& access,
               MemoryAccount& memory, std::function<void()> wake);
    ~Connection() override;

    [[nodiscard]] int socket() const noexcept override { return socket_.get(); }
    [[nodiscard]] short events() const override;
    void serve(short events) override;
    /// Tells of the progress of the call, and ends the connection if a message, or hello, does not come in
    /// time.
    void look_at(Clock::time_point now) override;
    void end() override { hang_up(); }
    [[nodiscard]] bool gone() const noexcept override { return !socket_; }
    [[nodiscard]] bool at_rest() const noexcept override { return at_rest_.load(); }

private:
    class Job;
    /// Time that a client has to read the last message and to end the connection.
    static constexpr std::chrono::seconds farewell{1};

    void tell_progress(Clock::time_point now);
    void receive();
    void take_messages();
    void take_request(std::uint32_t id, std::string text);
    /// The call that a request names. Throws Failure.
    [[nodiscard]] const Call& call_of(const nlohmann::json& request) const;
    /// Lets the job wait in its turn. Throws Failure.
    void enqueue(std::shared_ptr<Job> job);
    /// Reads the head of a job. Throws Failure.
    void read(Job& job) const;
    /// Runs `call`, or lets it wait in its turn. Throws Failure.
    void begin(const Call& call, std::uint32_t id, nlohmann::json request);
    /// Takes the proof of a hello. Throws Failure.
    void prove(const std::string& proof);
    /// Calls `work`; what it throws is answered.
    void answer_failure(std::uint32_t id, const std::function<void()>& work);
    void run_now(const Call& call, std::uint32_t id, const nlohmann::json& request);
    void send();
    void hang_up();
    /// Answers `failure` and ends the connection once that has been sent.
    void end_with(std::uint32_t id, const Failure& failure);
    void queue(Outgoing message);
    void run_jobs();
    [[nodiscard]] Outgoing run(Job& job);
    [[nodiscard]] Answer open_memory(std::size_t slots, std::uint64_t bytes);
    [[nodiscard]] Calls own_calls();
    [[nodiscard]] Answer hello_answer();
    [[nodiscard]] Answer status() const;
    /// Cancels the request, or all for 0. Returns how many were.
    std::size_t cancel(std::uint32_t id);

    const Limits& limits_;
    Host& host_;
    const std::function<void()> wake_;
    FileDescriptor socket_;
    const std::unique_ptr<Session> session_;
    const Calls calls_;
    Access access_;
    MemoryAccount& memory_;
    std::string challenge_; ///< that the next hello proves its token with; empty: none
    /// A hello that has to wait; nothing more is read meanwhile.
    struct Held {
        Clock::time_point until;
        std::uint32_t id;
        nlohmann::json request;
    };
    std::optional<Held> held_;

    std::string input_;
    std::optional<Clock::time_point> begun_; ///< of the message whose first bytes are in input_
    const Clock::time_point connected_ = Clock::now();
    bool greeted_ = false;
    std::string api_; ///< hash of the table of calls; empty: nobody has asked
    /// Nothing is read as requests any more; the connection ends when the client ends it, or then.
    std::optional<Clock::time_point> ends_;

    MemoryAccount::Share ring_share_;
    std::shared_ptr<SharedRing> ring_; ///< of the thread that runs calls; null: the client wants none

    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::deque<std::shared_ptr<Job>> waiting_;
    std::shared_ptr<Job> current_; ///< null: none
    Clock::time_point told_{};     ///< when the last news of it were sent, or it began
    std::deque<Outgoing> out_;
    std::size_t sent_ = 0;      ///< bytes of the first of them
    bool answering_ = false;    ///< an answer of a job is among them, the only one that may have arrays
    std::size_t before_it_ = 0; ///< messages before that answer
    bool ending_ = false;
    std::atomic<bool> at_rest_{false};
    StackThread thread_; ///< last, so that all else is there when it starts
};

} // namespace obscura::service
