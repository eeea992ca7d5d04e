// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/connection.hpp"

#include "core/error.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <new>
#include <utility>

namespace obscura::service::compatible {
namespace {

/// Bytes that are received of one client before the others have their turn.
constexpr std::size_t most_at_once = 1 << 18;

/// The command of a message; empty: none is named.
std::string name_in(const Fields& message) {
    const Value* const name = find(message, "");
    const auto* const text = name == nullptr ? nullptr : name->as<std::string>();
    return text == nullptr ? std::string() : *text;
}

} // namespace

/// A command in progress. The client cannot ask how far it is.
class Connection::Job final : public Work {
public:
    explicit Job(const std::atomic<bool>& stop) : stop_(stop) {}
    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return stop_; }
    void progress(std::uint64_t /*done*/, std::uint64_t /*total*/) override {}

private:
    const std::atomic<bool>& stop_;
};

Connection::Connection(FileDescriptor socket, const DoorLimits& limits, Host& host,
                       std::function<void()> wake)
    : limits_(limits),
      wake_(std::move(wake)),
      socket_(std::move(socket)),
      session_(host.open()),
      decoder_(limits),
      outbox_(limits),
      thread_([this] { run_requests(); }) {}

Connection::~Connection() {
    hang_up(false);
    thread_.join();
}

void Connection::end() {
    hang_up(false);
}

short Connection::events() const {
    const std::lock_guard lock(mutex_);
    int events = 0;
    if (waiting_.size() >= limits_.requests || waiting_bytes_ >= limits_.request_bytes) paused_ = true;
    if (ends_ || !paused_) events |= POLLIN;
    if (outbox_.ready(Clock::now())) events |= POLLOUT;
    return static_cast<short>(events);
}

void Connection::serve(short events) {
    // Also after an error: what came before it can still be read.
    if ((events & (POLLIN | POLLERR | POLLHUP)) != 0) receive();
    if (!gone()) send(Clock::now());
}

void Connection::look_at(Clock::time_point now) {
    if (ends_) {
        bool sent = false;
        {
            const std::lock_guard lock(mutex_);
            sent = outbox_.waiting() == 0;
        }
        if (sent) ::shutdown(socket_.get(), SHUT_WR);
        if (now >= *ends_) hang_up(closed_);
        return;
    }
    if (begun_ && now - *begun_ > limits_.message_ms)
        return end_with(Failure(FailureCode::bad_message, fmt::format("a message takes longer than {} ms",
                                                                      limits_.message_ms.count())));
    send(now); // what was held and is due
}

void Connection::receive() {
    const std::size_t before = input_.size();
    input_.resize(before + most_at_once);
    const ssize_t bytes = ::recv(socket_.get(), input_.data() + before, most_at_once, MSG_DONTWAIT);
    const bool blocked = bytes < 0 && (errno == EAGAIN || errno == EINTR);
    input_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(bytes, 0)));
    if (bytes <= 0 && !blocked) return hang_up(false);
    if (ends_)
        // Were it left unread, the end of the connection would take the last line from the client.
        input_.clear();
    else
        take_messages();
}

void Connection::take_messages() {
    std::size_t at = 0;
    bool any = false;
    try {
        while (!closed_) {
            at += decoder_.read(std::string_view(input_).substr(at));
            if (!decoder_.complete()) break;
            Request request{0, decoder_.bytes(), decoder_.take()};
            begun_.reset();
            any = true;
            closed_ = name_in(request.message) == "close";
            const std::lock_guard lock(mutex_);
            request.number = outbox_.request_read();
            waiting_bytes_ += request.bytes;
            if (!closed_) waiting_.push_back(std::move(request));
        }
    } catch (const Failure& failure) {
        end_with(failure);
    } catch (const std::bad_alloc&) {
        end_with(Failure(FailureCode::too_large, "not enough memory"));
    }
    if (any) changed_.notify_all();
    if (closed_) return hang_up(true);
    if (ends_) return;
    input_.erase(0, at);
    if (input_.capacity() > 4 * most_at_once && input_.size() < most_at_once) input_.shrink_to_fit();
    if (!begun_ && (!input_.empty() || decoder_.begun())) begun_ = Clock::now();
}

void Connection::send(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    while (const Packet* const packet = outbox_.next(now)) {
        std::array<iovec, 2> parts{};
        std::size_t count = 0, skipped = outbox_.sent();
        for (const std::string* part : {&packet->start, &packet->body}) {
            const std::size_t from = std::min(skipped, part->size());
            skipped -= from;
            // sendmsg() does not write there.
            if (from < part->size())
                parts[count++] = {const_cast<char*>(part->data()) + from, part->size() - from};
        }
        msghdr message{};
        message.msg_iov = parts.data();
        message.msg_iovlen = count;
        const ssize_t bytes = ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (bytes < 0) {
            // A client that has gone is noticed when nothing is left to read.
            if (errno != EAGAIN && errno != EINTR) outbox_.clear();
            return;
        }
        outbox_.advance(static_cast<std::size_t>(bytes));
    }
}

void Connection::hang_up(bool finish) {
    if (!finish) stop_ = true;
    socket_ = FileDescriptor();
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
        if (!finish) waiting_.clear();
        outbox_.clear();
    }
    changed_.notify_all();
}

void Connection::end_with(const Failure& failure) {
    stop_ = true;
    {
        const std::lock_guard lock(mutex_);
        waiting_.clear();
        outbox_.clear();
        outbox_.add_line(fmt::format("[error] {}", failure.what()), true);
    }
    ends_ = Clock::now() + limits_.farewell_ms;
    input_.clear();
    begun_.reset();
}

void Connection::run_requests() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
        if (waiting_.empty()) break;
        const Request request = std::move(waiting_.front());
        waiting_.pop_front();
        waiting_bytes_ -= request.bytes;
        const bool resumes =
            paused_ && waiting_.size() <= limits_.requests / 2 && waiting_bytes_ <= limits_.request_bytes / 2;
        if (resumes) paused_ = false;
        lock.unlock();
        if (resumes) wake_();
        run(request);
        lock.lock();
    }
    lock.unlock();
    at_rest_ = true;
    wake_();
}

void Connection::run(const Request& request) {
    const std::string name = name_in(request.message);
    const Command* const command = find_command(name);
    Job job(stop_);
    Reply reply;
    const auto fail = [&](std::string_view what) {
        Reply failed;
        failed.lines.push_back(fmt::format("[error] {}", what));
        answer(request, command, name, std::move(failed), true);
    };
    try {
        if (command == nullptr)
            throw Failure(FailureCode::unknown_call,
                          fmt::format("no call '{}'", config::printable(name, 60)));
        session_->run(*command, Arguments(*command, request.message), job, reply);
        answer(request, command, name, std::move(reply), false);
    } catch (const Failure& failure) {
        fail(failure.what());
    } catch (const std::bad_alloc&) {
        fail(fmt::format("{}: not enough memory", name));
    } catch (const std::exception& error) {
        fail(fmt::format("{}: {}", name, error.what()));
    }
}

void Connection::answer(const Request& request, const Command* command, std::string_view name, Reply reply,
                        bool failed) {
    Packet packet;
    Fields fields = std::move(reply.fields);
    fields.insert(fields.begin(), {"", Value(name)});
    packet.start =
        reply.bytes_name.empty() ? encode(fields) : encode(fields, reply.bytes_name, reply.body.size());
    packet.body = std::move(reply.body);
    const Awaited awaited = command == nullptr ? Awaited::no : command->awaited;
    {
        const std::lock_guard lock(mutex_);
        if (ending_) return;
        for (const std::string& line : reply.lines)
            outbox_.add_line(line, line.starts_with("[error]"));
        if (awaited != Awaited::never)
            outbox_.add_answer(request.number, std::move(packet), awaited == Awaited::yes, failed,
                               Clock::now());
        if (!outbox_.ready(Clock::now())) return;
    }
    wake_();
}

} // namespace obscura::service::compatible
