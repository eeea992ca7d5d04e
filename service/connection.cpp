// SPDX-License-Identifier: Apache-2.0
#include "service/connection.hpp"

#include "core/error.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/uio.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <new>
#include <span>
#include <utility>
#include <vector>

namespace obscura::service {
namespace {

using nlohmann::json;

/// Bytes that are received of one client before the others have their turn.
constexpr std::size_t most_at_once = 1 << 14;
/// Heads beyond this are read on the connection's own thread: a MiB takes some 50 ms, for which other clients
/// would wait.
constexpr std::size_t most_read_here = 1 << 14;
/// Messages that a client may leave unread before nothing more is read of it.
constexpr std::size_t most_unread = 256;
/// Shortest time between two progress events.
constexpr std::chrono::milliseconds progress_period{200};

json error_head(const Failure& failure) {
    json head{{"code", name_of(failure.code)}, {"message", failure.what()}};
    for (const auto& [name, text] :
         {std::pair{"field", &failure.field}, {"allowed", &failure.allowed}, {"hint", &failure.hint}})
        if (!text->empty()) head[name] = *text;
    return head;
}

Outgoing error_message(std::uint32_t id, const Failure& failure) {
    return make_message(MessageKind::error, id, error_head(failure));
}

void check_permission(const Call& call, Permission permission) {
    if (call.permission > permission)
        throw Failure(FailureCode::forbidden,
                      fmt::format("{} needs the permission \"{}\"", call.name, name_of(call.permission)));
}

/// Parts of the message behind its first `sent` bytes; at most as many as one call sends.
std::vector<iovec> parts_of(const Outgoing& message, std::size_t sent) {
    std::vector<iovec> parts;
    const auto add = [&](std::span<const std::byte> bytes) {
        const std::size_t skipped = std::min(sent, bytes.size());
        sent -= skipped;
        bytes = bytes.subspan(skipped);
        // sendmsg() takes the parts as writable, and only reads them.
        if (!bytes.empty()) parts.push_back({const_cast<std::byte*>(bytes.data()), bytes.size()});
    };
    add(std::as_bytes(std::span(message.start)));
    static constexpr std::byte zeros[8]{};
    std::uint64_t offset = 0;
    for (const Array& array : message.arrays) {
        const std::span<const std::byte> bytes = bytes_of(array);
        const std::size_t between = padding(offset);
        add(std::span(zeros).first(between));
        add(bytes);
        offset += between + bytes.size();
    }
    constexpr std::size_t most_parts = 64;
    parts.resize(std::min(parts.size(), most_parts));
    return parts;
}

} // namespace

/// A request, from its arrival to its answer.
class Connection::Job final : public Work {
public:
    Job(std::uint32_t the_id, MemoryAccount& memory, const Call& the_call, json the_request)
        : id(the_id), call(&the_call), request(std::move(the_request)), memory_(memory) {}
    /// Of a head that has not been read, of a client with that permission.
    Job(std::uint32_t the_id, MemoryAccount& memory, std::string the_text, Permission the_permission)
        : id(the_id), text(std::move(the_text)), permission(the_permission), memory_(memory) {}

    const std::uint32_t id;
    std::atomic<const Call*> call{nullptr}; ///< null: the head has not been read
    json request;
    std::string text; ///< of that head
    const Permission permission = Permission::view;
    std::atomic<bool> stop{false};
    std::atomic<std::uint64_t> done{0}, total{0};

    MemoryAccount::Share share;

    [[nodiscard]] const std::atomic<bool>& cancelled() const noexcept override { return stop; }
    void reserve(std::uint64_t bytes) override {
        share = {};
        share = memory_.take(bytes);
    }
    void progress(std::uint64_t now_done, std::uint64_t now_total) override {
        if (now_done == 0) begun_ = Clock::now().time_since_epoch();
        done = now_done, total = now_total;
    }
    /// How far the call is; none: it has not said.
    [[nodiscard]] std::optional<json> news(Clock::time_point now) const {
        const std::uint64_t now_done = done, now_total = total;
        if (now_total == 0) return {};
        json head{{"event", "progress"}, {"done", now_done}, {"total", now_total}};
        const double spent_s = std::chrono::duration<double>(now.time_since_epoch() - begun_.load()).count();
        if (now_done > 0)
            head["left_s"] =
                spent_s * static_cast<double>(now_total - now_done) / static_cast<double>(now_done);
        return head;
    }

private:
    MemoryAccount& memory_;
    std::atomic<Clock::duration> begun_{Clock::now().time_since_epoch()};
};

Connection::Connection(FileDescriptor socket, const Limits& limits, Host& host, const Access& access,
                       MemoryAccount& memory, std::function<void()> wake)
    : limits_(limits),
      host_(host),
      wake_(std::move(wake)),
      socket_(std::move(socket)),
      session_(host.open()),
      calls_([this] {
          Calls all = own_calls();
          for (Call& call : session_->calls())
              all.push_back(std::move(call));
          return all;
      }()),
      access_(access),
      memory_(memory),
      thread_(limits.stack_bytes, [this] { run_jobs(); }) {}

Connection::~Connection() {
    hang_up();
    thread_.join();
}

short Connection::events() const {
    const std::lock_guard lock(mutex_);
    int events = POLLRDHUP;
    if (out_.size() < most_unread && !held_) events |= POLLIN;
    if (!out_.empty()) events |= POLLOUT;
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

void Connection::tell_progress(Clock::time_point now) {
    const std::lock_guard lock(mutex_);
    // A client that does not read needs no news.
    if (!current_ || !out_.empty() || now - told_ < progress_period) return;
    std::optional<json> head = current_->news(now);
    if (!head) return;
    out_.push_back(make_message(MessageKind::event, current_->id, std::move(*head)));
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
        answer_failure(held.id, [&] { begin(find_call(calls_, "hello"), held.id, std::move(held.request)); });
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
    input_.resize(before + most_at_once);
    const ssize_t bytes = ::recv(socket_.get(), input_.data() + before, most_at_once, MSG_DONTWAIT);
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
    if (input_.capacity() > 4 * most_at_once && input_.size() < most_at_once) input_.shrink_to_fit();
    if (input_.empty())
        begun_.reset();
    else if (!begun_)
        begun_ = Clock::now();
}

void Connection::take_request(std::uint32_t id, std::string text) {
    answer_failure(id, [&] {
        if (text.size() > most_read_here && greeted_)
            return enqueue(std::make_shared<Job>(id, memory_, std::move(text),
                                                 access_.permission.value_or(Permission::view)));
        json request = read_head(text, limits_);
        const Call& call = call_of(request);
        if (!greeted_ && call.name != "hello" && call.name != "challenge")
            throw Failure(FailureCode::no_hello, "the first request of a connection is hello");
        const bool proves = call.name == "hello" && access_.tokens != nullptr && request.contains("proof");
        const Clock::time_point now = Clock::now();
        if (proves && access_.tokens->delay(now).count() > 0) {
            held_ = Held{now + access_.tokens->delay(now), id, std::move(request)};
            return;
        }
        begin(call, id, std::move(request));
    });
}

const Call& Connection::call_of(const json& request) const {
    const auto name = request.find("call");
    if (name != request.end() && name->is_string())
        return find_call(calls_, name->get_ref<const std::string&>());
    Failure failure(FailureCode::bad_message, "the field \"call\" is missing, or is no string");
    failure.field = "call";
    throw failure;
}

void Connection::begin(const Call& call, std::uint32_t id, json request) {
    check_permission(call, access_.permission.value_or(Permission::view));
    if (call.overtakes)
        run_now(call, id, request);
    else
        enqueue(std::make_shared<Job>(id, memory_, call, std::move(request)));
}

void Connection::enqueue(std::shared_ptr<Job> job) {
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

void Connection::run_now(const Call& call, std::uint32_t id, const json& request) {
    Job work(id, memory_, call, {});
    queue(make_message(MessageKind::answer, id, bind(call, request).run(work).head));
}

void Connection::queue(Outgoing message) {
    const std::lock_guard lock(mutex_);
    out_.push_back(std::move(message));
}

void Connection::send() {
    const std::lock_guard lock(mutex_);
    while (!out_.empty()) {
        std::vector<iovec> parts = parts_of(out_.front(), sent_);
        msghdr message{};
        message.msg_iov = parts.data();
        message.msg_iovlen = parts.size();
        alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int))]{};
        if (sent_ == 0 && out_.front().descriptor >= 0) {
            message.msg_control = control;
            message.msg_controllen = sizeof control;
            cmsghdr* const rights = CMSG_FIRSTHDR(&message);
            rights->cmsg_level = SOL_SOCKET;
            rights->cmsg_type = SCM_RIGHTS;
            rights->cmsg_len = CMSG_LEN(sizeof(int));
            std::memcpy(CMSG_DATA(rights), &out_.front().descriptor, sizeof(int));
        }
        const ssize_t bytes = ::sendmsg(socket_.get(), &message, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (bytes < 0) return; // a broken connection is an event of its own
        sent_ += static_cast<std::size_t>(bytes);
        if (!parts_of(out_.front(), sent_).empty()) continue;
        out_.pop_front();
        sent_ = 0;
        if (answering_ && before_it_-- == 0) {
            answering_ = false;
            changed_.notify_all();
        }
    }
    if (ends_) ::shutdown(socket_.get(), SHUT_WR);
}

void Connection::hang_up() {
    (void)cancel(0);
    socket_ = FileDescriptor();
    {
        const std::lock_guard lock(mutex_);
        ending_ = true;
        out_.clear();
    }
    changed_.notify_all();
}

void Connection::end_with(std::uint32_t id, const Failure& failure) {
    (void)cancel(0);
    queue(error_message(id, failure));
    ends_ = Clock::now() + farewell;
    input_.clear();
    begun_.reset();
}

void Connection::run_jobs() {
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock, [this] { return ending_ || !waiting_.empty(); });
        if (ending_) break;
        current_ = std::move(waiting_.front());
        waiting_.pop_front();
        told_ = Clock::now();
        lock.unlock();
        Outgoing answer = run(*current_);
        lock.lock();
        current_.reset();
        changed_.wait(lock, [this] { return ending_ || !answering_; });
        if (ending_) break;
        answering_ = true;
        before_it_ = out_.size();
        out_.push_back(std::move(answer));
        wake_();
    }
    waiting_.clear();
    current_.reset();
    lock.unlock();
    at_rest_ = true;
    wake_();
}

void Connection::read(Job& job) const {
    job.request = read_head(std::exchange(job.text, {}), limits_);
    const Call& call = call_of(job.request);
    check_permission(call, job.permission);
    if (call.overtakes)
        throw Failure(FailureCode::too_large,
                      fmt::format("{}: a head of more than {} bytes", call.name, most_read_here));
    job.call = &call;
}

Outgoing Connection::run(Job& job) {
    try {
        if (job.stop) throw cancelled();
        if (job.call.load() == nullptr) read(job);
        const Call& call = *job.call.load();
        Answer answer = service::bind(call, job.request).run(job);
        if (ring_ && !answer.arrays.empty())
            if (const auto place = ring_->write(job.id, answer.arrays)) {
                answer.head["memory"] = {{"slot", place->slot}, {"sequence", place->sequence}};
                answer.head["arrays"] = list_arrays(answer.arrays);
                answer.arrays.clear();
            }
        Outgoing message =
            make_message(MessageKind::answer, job.id, std::move(answer.head), std::move(answer.arrays));
        message.keep = std::move(answer.keep);
        if (!message.arrays.empty()) message.share = std::move(job.share);
        message.descriptor = answer.descriptor;
        return message;
    } catch (const Failure& failure) {
        return error_message(job.id, failure);
    } catch (const std::bad_alloc&) {
        return error_message(job.id, Failure(FailureCode::too_large, "not enough memory"));
    } catch (const std::exception& error) {
        return error_message(job.id, Failure(FailureCode::internal, error.what()));
    }
}

std::size_t Connection::cancel(std::uint32_t id) {
    const std::lock_guard lock(mutex_);
    std::size_t found = 0;
    const auto stop = [&](Job& job) {
        if (id != 0 && job.id != id) return;
        job.stop = true;
        ++found;
    };
    for (const std::shared_ptr<Job>& job : waiting_)
        stop(*job);
    if (current_) stop(*current_);
    return found;
}

Answer Connection::status() const {
    const std::lock_guard lock(mutex_);
    json head{{"waiting", waiting_.size()}};
    if (current_) {
        if (const Call* const call = current_->call.load()) head["call"] = call->name;
        head["request"] = current_->id;
        head["done"] = current_->done.load();
        head["total"] = current_->total.load();
    }
    return {std::move(head)};
}

} // namespace obscura::service
