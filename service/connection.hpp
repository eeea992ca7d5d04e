// SPDX-License-Identifier: Apache-2.0
// Connection of one client: messages in and out, and threads that run its calls.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "core/realtime/stack_thread.hpp"
#include "service/limits.hpp"
#include "service/message.hpp"
#include "service/outbox.hpp"
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
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

namespace obscura::service {

/// What the connections of a server have in common; outlives them.
struct ConnectionContext {
    const Limits& limits;
    Host& host;
    MemoryAccount& memory;
    std::string api; ///< hash of the table of calls, see Connection::api_of()
};

/// Public members are for the server's thread, which never blocks here: sessions, which may take long to open
/// and to end, are of the thread that runs the calls in their order; it starts with the first of them.
/// Streams run on threads beside it. A fault of the framing is answered and ends the connection; any other
/// mistake is answered, and the connection lives on. The end of the connection cancels its calls.
class Connection final : public Peer {
public:
    /// `wake` is called on the connection's threads when there is something to send.
    Connection(FileDescriptor socket, const ConnectionContext& context, Access access,
               std::function<void()> wake);
    ~Connection() override;

    /// Hash of the table of calls of a host: clients see whether it is the one that they were written for.
    [[nodiscard]] static std::string api_of(Host& host);

    [[nodiscard]] int socket() const noexcept override { return socket_.get(); }
    [[nodiscard]] short events() const override;
    void serve(short events) override;
    /// Tells of the progress of the call, and ends the connection if a message, or hello, does not come in
    /// time.
    void look_at(Clock::time_point now) override;
    void end() override { hang_up(); }
    [[nodiscard]] bool gone() const noexcept override { return !socket_; }
    [[nodiscard]] Clock::time_point may_end_from(const IdleRules& rules) const override;
    [[nodiscard]] bool at_rest() const noexcept override { return !thread_ || thread_->ended(); }

private:
    class Job;
    /// A call that runs beside the others.
    struct Stream {
        std::shared_ptr<Job> job;
        std::unique_ptr<StackThread> thread{};
        bool ended = false;
    };
    /// Time that a client has to read the last message and to end the connection.
    static constexpr std::chrono::seconds linger_timeout{1};

    // Server's thread

    void tell_progress(Clock::time_point now);
    void receive();
    void take_messages();
    void take_request(std::uint32_t id, std::string text);
    /// Lets the request wait in its turn. Throws Failure.
    void enqueue(std::uint32_t id, std::string text, nlohmann::json request);
    /// Runs one of the calls of any connection, or lets it wait in its turn. Throws Failure.
    void begin(const Call& call, std::uint32_t id, nlohmann::json request);
    /// Calls `work`; what it throws is answered.
    void answer_failure(std::uint32_t id, const std::function<void()>& work);
    void send();
    void hang_up();
    /// Answers `failure` and ends the connection once that has been sent.
    void end_with(std::uint32_t id, const Failure& failure);
    void queue(Outgoing message);

    // Calls of any connection

    [[nodiscard]] static Calls own_calls(Connection* self);
    [[nodiscard]] static Calls all_calls(Connection* self, Session& session);
    /// Takes the proof of a hello. Throws Failure.
    void prove(const std::string& proof);
    [[nodiscard]] Answer hello_answer();
    [[nodiscard]] Answer open_memory(std::size_t slots, std::uint64_t bytes);
    [[nodiscard]] Answer status() const;
    /// Cancels the request, or all for 0. Returns how many were.
    std::size_t cancel(std::uint32_t id);
    /// Grants a stream credits. Returns those that it has.
    std::uint32_t grant(std::uint32_t id, std::uint32_t credits);

    // Threads of calls

    void run_jobs();
    /// Reads the head of a job and finds its call. Throws Failure.
    void prepare(Job& job);
    /// Starts the thread of a call that runs beside others. Throws Failure.
    void start_stream(const std::shared_ptr<Job>& job);
    void run_stream(Stream& stream);
    /// The answer; none: it has become a stream.
    [[nodiscard]] std::optional<Outgoing> run(const std::shared_ptr<Job>& job);
    [[nodiscard]] Outgoing perform(Job& job);
    /// Message of an answer, or of a frame.
    [[nodiscard]] Outgoing message_of(MessageKind kind, Job& job, Answer answer);
    /// Waits until the lane's message before has left, and frees what has.
    void await_turn(std::unique_lock<std::mutex>& lock, const void* lane);
    void await_credit(Job& job);
    void push(Job& job, Answer frame);
    /// Waits for the threads of streams that have ended, or of all.
    void reap_streams(std::unique_lock<std::mutex>& lock, bool all);
    /// Frees what has been sent, without the lock.
    void free_sent(std::unique_lock<std::mutex>& lock);
    /// Calls `use` with each job that has not been answered. With the mutex.
    template<typename Use>
    void each_job(const Use& use) const;

    const ConnectionContext& context_;
    const Limits& limits_ = context_.limits;
    const std::function<void()> wake_;
    FileDescriptor socket_;
    const Calls own_; ///< calls of any connection
    Access access_;
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
    Clock::time_point heard_ = connected_; ///< of its last request
    /// Nothing is read as requests any more; the connection ends when the client ends it, or then.
    std::optional<Clock::time_point> ends_;
    bool shut_ = false; ///< nothing is sent any more

    // Used by the thread that runs calls in their order:
    std::unique_ptr<Session> session_; ///< null: nothing has been asked of it
    Calls calls_;                      ///< all, once there is a session
    MemoryAccount::Share ring_share_;

    mutable std::mutex ring_mutex_;
    std::shared_ptr<SharedRing> ring_; ///< null: the client wants none

    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    std::deque<std::shared_ptr<Job>> waiting_;
    std::shared_ptr<Job> current_; ///< null: none
    Clock::time_point told_{};     ///< when the last news of it were sent, or it began
    std::list<Stream> streams_;
    Outbox outbox_;
    bool ending_ = false;
    mutable std::optional<StackThread> thread_; ///< of the server's thread; none: no call has come
};

} // namespace obscura::service
