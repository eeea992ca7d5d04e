// SPDX-License-Identifier: Apache-2.0
#include "service/compatible/connection.hpp"

#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <exception>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace obscura::service::compatible {
namespace {

/// Bytes that are received of one client before the others have their turn.
constexpr std::size_t max_batch = 1 << 15;
/// Bytes that wait for the thread, at most one receipt more.
constexpr std::size_t max_received = 1 << 20;

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

Connection::Connection(FileDescriptor socket, const CompatibleLimits& limits, Host& host,
                       MemoryAccount& memory, std::function<void()> wake)
    : limits_(limits),
      host_(host),
      memory_(memory),
      wake_(std::move(wake)),
      socket_(std::move(socket)),
      outbox_(limits) {}

Connection::~Connection() {
    hang_up(false);
    if (thread_.joinable()) thread_.join();
}

void Connection::end() {
    hang_up(false);
}

short Connection::events() const {
    const std::lock_guard lock(mutex_);
    int events = 0;
    if (ends_ || received_bytes_ < max_received) events |= POLLIN;
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
        if (now >= *ends_) hang_up(false);
        return;
    }
    std::string broken;
    bool closed = false;
    {
        const std::lock_guard lock(mutex_);
        broken = broken_;
        closed = closed_;
        // What has come and waits for the thread is not the client's delay.
        if (received_.empty() && begun_ && now - *begun_ > limits_.message_ms)
            broken = fmt::format("a message takes longer than {} ms", limits_.message_ms.count());
    }
    if (!broken.empty()) return end_with(broken);
    if (closed) return hang_up(true);
    send(now); // what was held and is due
}

void Connection::receive() {
    std::string bytes(max_batch, '\0');
    const ssize_t count = ::recv(socket_.get(), bytes.data(), bytes.size(), MSG_DONTWAIT);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (count <= 0) return hang_up(ends_with_close(last_bytes_));
    // Were it left unread, the end of the connection would take the last line from the client.
    if (ends_) return;
    bytes.resize(static_cast<std::size_t>(count));
    last_bytes_ += std::string_view(bytes).substr(bytes.size() - std::min(bytes.size(), close_bytes));
    last_bytes_.erase(0, last_bytes_.size() - std::min(last_bytes_.size(), close_bytes));
    try {
        take(std::move(bytes));
    } catch (const std::bad_alloc&) {
        end_with("not enough memory");
    } catch (const std::system_error& error) {
        end_with(fmt::format("the server has no thread left: {}", error.what()));
    }
}

void Connection::take(std::string bytes) {
    if (!thread_.joinable()) {
        at_rest_ = false;
        try {
            thread_ = std::thread([this] { run_requests(); });
        } catch (...) {
            at_rest_ = true;
            throw;
        }
    }
    {
        const std::lock_guard lock(mutex_);
        received_bytes_ += bytes.size();
        if (!received_.empty() && received_.back().size() + bytes.size() <= max_batch)
            received_.back() += bytes;
        else
            received_.push_back(std::move(bytes));
    }
    changed_.notify_all();
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
        outbox_.clear();
    }
    changed_.notify_all();
}

void Connection::end_with(std::string_view what) {
    stop_ = true;
    {
        const std::lock_guard lock(mutex_);
        outbox_.clear();
        outbox_.add_line(fmt::format("[error] {}", what), true);
    }
    changed_.notify_all();
    ends_ = Clock::now() + limits_.linger_timeout_ms;
}

void Connection::run_requests() {
    std::string broken;
    try {
        const std::unique_ptr<Session> session = host_.open(memory_);
        RequestReader reader(limits_, memory_);
        while (read_ahead(reader))
            run(*session, reader.take());
    } catch (const std::bad_alloc&) {
        broken = "not enough memory";
    } catch (const std::exception& error) {
        broken = error.what();
    }
    std::vector<Packet> spent;
    {
        const std::lock_guard lock(mutex_);
        broken_ = std::move(broken);
        spent = outbox_.take_spent();
    }
    spent.clear();
    at_rest_ = true;
    wake_();
}

bool Connection::read_ahead(RequestReader& reader) {
    while (!stop_) {
        std::vector<Packet> spent; // freed without the lock
        std::vector<std::string> pieces;
        bool resumes = false;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] {
                return ending_ || stop_ || !received_.empty() || !reader.waiting.empty() ||
                       reader.can_read() || outbox_.has_spent();
            });
            spent = outbox_.take_spent();
            if (reader.wants_bytes()) {
                pieces.swap(received_);
                resumes = std::exchange(received_bytes_, 0) >= max_received;
            }
            if (ending_ && pieces.empty() && reader.waiting.empty() && !reader.can_read()) return false;
        }
        spent.clear();
        if (resumes) wake_();
        for (std::string& piece : pieces)
            reader.add(std::move(piece));
        read(reader);
        if (!reader.waiting.empty()) return !stop_;
        if (reader.closed()) return false;
    }
    return false;
}

void Connection::read(RequestReader& reader) {
    if (!reader.can_read()) return;
    const std::size_t count = reader.read();
    const std::lock_guard lock(mutex_);
    std::uint64_t number = outbox_.requests_read(count);
    for (std::size_t i = reader.waiting.size() - count; i < reader.waiting.size(); ++i)
        reader.waiting[i].number = number++;
    closed_ = reader.closed();
    if (!reader.begun())
        begun_.reset();
    else if (!begun_ || count > 0)
        begun_ = Clock::now();
    if (closed_) wake_();
}

void Connection::run(Session& session, const ReadRequest& request) {
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
        if (command == nullptr) throw Failure(FailureCode::unknown_call, explain_unknown_command(name));
        session.run(*command, Arguments(*command, request.message), job, reply);
        answer(request, command, name, std::move(reply), false);
    } catch (const Failure& failure) {
        fail(failure.what());
    } catch (const std::bad_alloc&) {
        fail(fmt::format("{}: not enough memory", name));
    } catch (const std::exception& error) {
        fail(fmt::format("{}: {}", name, error.what()));
    }
}

void Connection::answer(const ReadRequest& request, const Command* command, std::string_view name,
                        Reply reply, bool failed) {
    Packet packet;
    Fields fields = std::move(reply.fields);
    fields.insert(fields.begin(), {"", Value(name)});
    packet.start =
        reply.bytes_name.empty() ? encode(fields) : encode(fields, reply.bytes_name, reply.body.size());
    packet.body = std::move(reply.body);
    packet.share = std::move(reply.share);
    const Awaited awaited = command == nullptr ? Awaited::no : command->awaited;
    {
        const std::lock_guard lock(mutex_);
        if (ending_ || stop_) return;
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
