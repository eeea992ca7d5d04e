// SPDX-License-Identifier: Apache-2.0
// Threads of a connection: calls in their order, and streams beside them.
#include "service/connection_job.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <system_error>
#include <utility>
#include <vector>

namespace obscura::service {

using nlohmann::json;

namespace {

json error_head(const Failure& failure) {
    json head{{"code", name_of(failure.code)}, {"message", failure.what()}};
    for (const auto& [name, text] :
         {std::pair{"field", &failure.field}, {"allowed", &failure.allowed}, {"hint", &failure.hint}})
        if (!text->empty()) head[name] = *text;
    return head;
}

/// What `work` returns, or the error that it throws.
template<typename Work>
std::optional<Outgoing> answer_of(std::uint32_t id, const Work& work) {
    try {
        return work();
    } catch (const Failure& failure) {
        return error_message(id, failure);
    } catch (const std::bad_alloc&) {
        return error_message(id, Failure(FailureCode::too_large, "not enough memory"));
    } catch (const std::exception& error) {
        return error_message(id, Failure(FailureCode::internal, error.what()));
    }
}

} // namespace

Outgoing error_message(std::uint32_t id, const Failure& failure) {
    return make_message(MessageKind::error, id, error_head(failure));
}

void check_permission(const Call& call, Permission permission) {
    if (call.permission > permission)
        throw Failure(FailureCode::forbidden,
                      fmt::format("{} needs the permission \"{}\", the connection has \"{}\"", call.name,
                                  name_of(call.permission), name_of(permission)));
}

const std::string& name_of_call(const json& request) {
    const auto name = request.find("call");
    if (name != request.end() && name->is_string()) return name->get_ref<const std::string&>();
    Failure failure(FailureCode::bad_message, "the field \"call\" is missing, or is no string");
    failure.field = "call";
    throw failure;
}

template<typename Use>
void Connection::each_job(const Use& use) const {
    for (const std::shared_ptr<Job>& job : waiting_)
        use(*job);
    if (current_) use(*current_);
    for (const Stream& stream : streams_)
        if (!stream.ended) use(*stream.job);
}

void Connection::run_jobs() {
    const auto stream_ended = [this] {
        return std::any_of(streams_.begin(), streams_.end(), [](const Stream& s) { return s.ended; });
    };
    std::unique_lock lock(mutex_);
    while (true) {
        changed_.wait(lock,
                      [&] { return ending_ || !waiting_.empty() || outbox_.has_sent() || stream_ended(); });
        free_sent(lock);
        reap_streams(lock, false);
        if (ending_) break;
        if (waiting_.empty()) continue;
        std::shared_ptr<Job> job = std::move(waiting_.front());
        waiting_.pop_front();
        current_ = job;
        told_ = Clock::now();
        lock.unlock();
        std::optional<Outgoing> answer = run(job);
        lock.lock();
        current_.reset();
        lock.unlock();
        job.reset(); // its request may be large
        lock.lock();
        if (!answer) continue;
        await_turn(lock, this);
        if (ending_) break;
        outbox_.add(std::move(*answer), this);
        lock.unlock();
        wake_();
        lock.lock();
    }
    // What takes long to free is freed here: neither on the server's thread nor with the lock.
    std::deque<std::shared_ptr<Job>> given_up = std::exchange(waiting_, {});
    reap_streams(lock, true);
    free_sent(lock);
    lock.unlock();
    given_up.clear();
    calls_.clear();
    session_.reset();
    wake_();
}

std::optional<Outgoing> Connection::run(const std::shared_ptr<Job>& job) {
    return answer_of(job->id, [&]() -> std::optional<Outgoing> {
        if (job->stop) throw cancelled();
        prepare(*job);
        if (!job->call.load()->beside) return perform(*job);
        start_stream(job);
        return {};
    });
}

void Connection::prepare(Job& job) {
    if (!session_) {
        session_ = context_.host.open();
        calls_ = all_calls(this, *session_);
    }
    if (!job.text.empty()) job.request = read_head(std::exchange(job.text, {}), limits_);
    const Call& call = find_call(calls_, name_of_call(job.request));
    check_permission(call, job.granted);
    if (call.overtakes)
        throw Failure(FailureCode::too_large, fmt::format("{}: the head is too large", call.name));
    job.call = &call;
}

Outgoing Connection::perform(Job& job) {
    return message_of(MessageKind::answer, job, service::bind(*job.call.load(), job.request).run(job));
}

Outgoing Connection::message_of(MessageKind kind, Job& job, Answer answer) {
    if (!answer.arrays.empty()) {
        const std::lock_guard lock(ring_mutex_);
        if (ring_)
            if (const auto place = ring_->write(job.id, answer.arrays)) {
                answer.head["memory"] = {{"slot", place->slot}, {"sequence", place->sequence}};
                answer.head["arrays"] = list_arrays(answer.arrays);
                answer.arrays.clear();
            }
    }
    if (!answer.descriptors.empty()) {
        const std::string_view name = job.call.load()->name;
        if (!access_.passes_files)
            throw Failure(FailureCode::forbidden,
                          fmt::format("{}: files are handed over at a Unix socket only", name));
        if (answer.descriptors.size() > max_descriptors)
            throw Failure(FailureCode::too_large,
                          fmt::format("{}: more than {} files", name, max_descriptors));
        answer.head["descriptors"] = answer.descriptors.size();
    }
    Outgoing message = make_message(kind, job.id, std::move(answer.head), std::move(answer.arrays));
    message.keep = std::move(answer.keep);
    if (!message.arrays.empty()) message.share = std::move(job.share);
    message.descriptors = std::move(answer.descriptors);
    return message;
}

void Connection::start_stream(const std::shared_ptr<Job>& job) {
    std::unique_lock lock(mutex_);
    if (streams_.size() >= limits_.streams)
        throw Failure(FailureCode::busy, fmt::format("{} streams are open already", limits_.streams));
    job->lane = job.get();
    Stream& stream = streams_.emplace_back(Stream{job});
    current_.reset(); // each_job() finds it once
    lock.unlock();
    try {
        stream.thread =
            std::make_unique<StackThread>(limits_.stack_bytes, [this, &stream] { run_stream(stream); });
    } catch (const std::system_error&) {
        lock.lock();
        streams_.pop_back();
        throw Failure(FailureCode::busy, "the server has no thread left");
    }
}

void Connection::run_stream(Stream& stream) {
    Job& job = *stream.job;
    Outgoing answer = *answer_of(job.id, [&]() -> std::optional<Outgoing> { return perform(job); });
    std::unique_lock lock(mutex_);
    await_turn(lock, job.lane);
    if (!ending_) outbox_.add(std::move(answer));
    stream.ended = true; // from now on it may be gone once the lock is
    lock.unlock();
    changed_.notify_all();
    wake_();
}

void Connection::reap_streams(std::unique_lock<std::mutex>& lock, bool all) {
    for (auto stream = streams_.begin(); stream != streams_.end();) {
        if (!all && !stream->ended) {
            ++stream;
            continue;
        }
        std::list<Stream> ended;
        ended.splice(ended.begin(), streams_, stream++);
        lock.unlock();
        ended.front().thread->join();
        ended.clear();
        lock.lock();
    }
}

void Connection::free_sent(std::unique_lock<std::mutex>& lock) {
    if (!outbox_.has_sent()) return;
    std::vector<Outgoing> sent = outbox_.take_sent();
    lock.unlock();
    sent.clear();
    lock.lock();
}

void Connection::await_turn(std::unique_lock<std::mutex>& lock, const void* lane) {
    changed_.wait(lock, [&] { return ending_ || !outbox_.holds(lane); });
    free_sent(lock);
}

void Connection::await_credit(Job& job) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ending_ || job.stop || (job.credits > 0 && !outbox_.holds(job.lane)); });
    free_sent(lock);
    if (ending_ || job.stop) throw cancelled();
}

void Connection::push(Job& job, Answer frame) {
    await_credit(job);
    frame.head["event"] = "frame";
    Outgoing message = message_of(MessageKind::event, job, std::move(frame));
    {
        const std::lock_guard lock(mutex_);
        --job.credits;
        outbox_.add(std::move(message), job.lane);
    }
    wake_();
}

std::uint32_t Connection::grant(std::uint32_t id, std::uint32_t credits) {
    std::uint32_t now = 0;
    {
        const std::lock_guard lock(mutex_);
        each_job([&](Job& job) {
            if (job.id == id) now = job.credits = std::min(limits_.credits, job.credits + credits);
        });
    }
    changed_.notify_all();
    return now;
}

std::size_t Connection::cancel(std::uint32_t id) {
    std::size_t found = 0;
    {
        const std::lock_guard lock(mutex_);
        each_job([&](Job& job) {
            if (id != 0 && job.id != id) return;
            job.stop = true;
            ++found;
        });
    }
    changed_.notify_all();
    return found;
}

Answer Connection::status() const {
    const std::lock_guard lock(mutex_);
    json head{{"waiting", waiting_.size()},
              {"streams", std::count_if(streams_.begin(), streams_.end(),
                                        [](const Stream& stream) { return !stream.ended; })}};
    if (current_) {
        if (const Call* const call = current_->call.load()) head["call"] = call->name;
        head["request"] = current_->id;
        head["done"] = current_->done.load();
        head["total"] = current_->total.load();
    }
    return {std::move(head)};
}

} // namespace obscura::service
