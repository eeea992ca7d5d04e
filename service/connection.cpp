// SPDX-License-Identifier: Apache-2.0
#include "service/connection.hpp"

#include "service/connection_job.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <new>
#include <system_error>
#include <utility>

namespace obscura::service {
namespace {

using nlohmann::json;

/// Bytes that are received of one client, and sent to it, before the others have their turn. Small messages
/// come in smaller pieces: each of them costs more than its bytes.
constexpr std::size_t max_batch = 1 << 16, few_at_once = 1 << 13, max_sent_batch = 1 << 18;
/// Heads beyond this are read on the connection's own thread: a MiB takes some 50 ms, for which other clients
/// would wait.
constexpr std::size_t max_local_read_bytes = 1 << 12;
/// Messages that a client may leave unread before nothing more is read of it.
constexpr std::size_t max_unread = 256;
/// Shortest time between two progress events.
constexpr std::chrono::milliseconds progress_period{200};

} // namespace

Connection::Connection(FileDescriptor socket, const ConnectionContext& context, Access access,
                       std::function<void()> wake)
    : context_(context),
      wake_(std::move(wake)),
      socket_(std::move(socket)),
      own_(own_calls(this)),
      access_(std::move(access)) {}

Connection::~Connection() {
    hang_up();
    if (thread_) thread_->join();
}

short Connection::events() const {
    const std::lock_guard lock(mutex_);
    int events = POLLRDHUP;
    if (outbox_.size() < max_unread && !held_) events |= POLLIN;
    if (!outbox_.empty() && !shut_) events |= POLLOUT;
    return static_cast<short>(events);
}

void Connection::serve(short events) {
    if ((events & (POLLERR | POLLHUP | POLLNVAL)) != 0) return hang_up();
    if ((events & POLLIN) != 0)
        receive();
    else if ((events & POLLRDHUP) != 0)
        hang_up();
    if (!gone()) send();
}

Connection::Clock::time_point Connection::may_end_from(const IdleRules& rules) const {
    const std::lock_guard lock(mutex_);
    // A stream has its credits as requests.
    if (current_ || !waiting_.empty()) return Clock::time_point::max();
    return service::may_end_from(rules, heard_, !greeted_);
}

void Connection::tell_progress(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    // A client that does not read needs no news.
    if (!current_ || !outbox_.empty() || now - told_ < progress_period) return;
    std::optional<json> head = current_->news(now);
    if (!head) return;
    outbox_.add(make_message(MessageKind::event, current_->id, std::move(*head)));
    told_ = now;
}

void Connection::look_at(Clock::time_point now) {
    tell_progress(now);
    if (ends_) {
        if (now >= *ends_) hang_up();
        return;
    }
    if (held_) {
        if (now < held_->until) return;
        Held held = std::move(*held_);
        held_.reset();
        answer_failure(held.id, [&] { begin(find_call(own_, "hello"), held.id, std::move(held.request)); });
        take_messages();
        return;
    }
    if (begun_ && now - *begun_ > limits_.message_ms)
        end_with(0, Failure(FailureCode::bad_message,
                            fmt::format("a message takes longer than {} ms", limits_.message_ms.count())));
    else if (!greeted_ && now - connected_ > limits_.hello_ms)
        end_with(0, Failure(FailureCode::no_hello,
                            fmt::format("no hello within {} ms", limits_.hello_ms.count())));
}

void Connection::receive() {
    const std::size_t before = input_.size();
    const std::size_t room = before < max_local_read_bytes ? few_at_once : max_batch;
    input_.resize(before + room);
    const ssize_t bytes = ::recv(socket_.get(), input_.data() + before, room, MSG_DONTWAIT);
    input_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
    if (bytes == 0 || (bytes < 0 && errno != EAGAIN && errno != EINTR)) return hang_up();
    if (ends_)
        input_.clear();
    else
        take_messages();
}

void Connection::take_messages() {
    std::size_t at = 0;
    try {
        while (!ends_ && !held_ && input_.size() - at >= Frame::bytes) {
            const std::string_view rest = std::string_view(input_).substr(at);
            const Frame frame = read_frame(rest, limits_);
            const std::size_t bytes = Frame::bytes + frame.head_bytes + frame.body_bytes;
            if (frame.head_bytes > max_local_read_bytes && !greeted_)
                throw Failure(FailureCode::no_hello, "the first request of a connection is hello");
            if (rest.size() < bytes) break;
            if (frame.kind != MessageKind::request)
                throw Failure(FailureCode::bad_message, "a message that is no request");
            take_request(frame.id, std::string(rest.substr(Frame::bytes, frame.head_bytes)));
            at += bytes;
            begun_.reset();
        }
    } catch (const Failure& failure) {
        end_with(0, failure);
    }
    if (ends_) return;
    input_.erase(0, at);
    if (input_.capacity() > 4 * max_batch && input_.size() < max_batch) input_.shrink_to_fit();
    if (input_.empty())
        begun_.reset();
    else if (!begun_)
        begun_ = Clock::now();
}

void Connection::take_request(std::uint32_t id, std::string text) {
    heard_ = Clock::now();
    answer_failure(id, [&] {
        if (text.size() > max_local_read_bytes) return enqueue(id, std::move(text), {});
        json request = read_head(text, limits_);
        const std::string& name = name_of_call(request);
        const auto own =
            std::find_if(own_.begin(), own_.end(), [&](const Call& call) { return call.name == name; });
        if (!greeted_ && (own == own_.end() || (name != "hello" && name != "challenge")))
            throw Failure(FailureCode::no_hello, "the first request of a connection is hello");
        if (own == own_.end()) return enqueue(id, {}, std::move(request));
        const bool proves = name == "hello" && access_.tokens != nullptr && request.contains("proof");
        const Clock::time_point now = Clock::now();
        if (proves && access_.tokens->delay(access_.peer, now).count() > 0) {
            held_ = Held{now + access_.tokens->delay(access_.peer, now), id, std::move(request)};
            return;
        }
        begin(*own, id, std::move(request));
    });
}

void Connection::begin(const Call& call, std::uint32_t id, json request) {
    if (!call.overtakes) return enqueue(id, {}, std::move(request));
    check_permission(call, access_.permission.value_or(Permission::view));
    Job work(*this, id, {}, {});
    queue(make_message(MessageKind::answer, id, service::bind(call, request).run(work).head));
}

void Connection::enqueue(std::uint32_t id, std::string text, json request) {
    auto job = std::make_shared<Job>(*this, id, std::move(text), std::move(request));
    try {
        if (!thread_) thread_.emplace(limits_.stack_bytes, [this] { run_jobs(); });
    } catch (const std::system_error&) {
        throw Failure(FailureCode::busy, "the server has no thread left");
    }
    {
        const std::lock_guard lock(mutex_);
        if (waiting_.size() >= limits_.requests)
            throw Failure(FailureCode::busy, fmt::format("{} requests wait already", limits_.requests));
        waiting_.push_back(std::move(job));
    }
    changed_.notify_all();
}

void Connection::answer_failure(std::uint32_t id, const std::function<void()>& work) {
    try {
        work();
    } catch (const Failure& failure) {
        queue(error_message(id, failure));
    } catch (const std::bad_alloc&) {
        queue(error_message(id, Failure(FailureCode::too_large, "not enough memory")));
    }
}

void Connection::queue(Outgoing message) {
    const std::lock_guard lock(mutex_);
    outbox_.add(std::move(message));
}

void Connection::send() {
    if (shut_) return;
    bool left = false, all = false;
    {
        const std::lock_guard lock(mutex_);
        left = outbox_.send(socket_.get(), max_sent_batch);
        all = outbox_.empty();
    }
    if (left) changed_.notify_all();
    if (ends_ && all) {
        ::shutdown(socket_.get(), SHUT_WR);
        shut_ = true;
    }
}

void Connection::hang_up() {
    (void)cancel(0);
    socket_ = FileDescriptor();
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
        outbox_.clear();
    }
    changed_.notify_all();
}

void Connection::end_with(std::uint32_t id, const Failure& failure) {
    (void)cancel(0);
    queue(error_message(id, failure));
    ends_ = Clock::now() + linger_timeout;
    input_.clear();
    begun_.reset();
}

} // namespace obscura::service
