// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/scene_requests.hpp"

#include "core/realtime/log.hpp"
#include "service/call.hpp"

#include <algorithm>
#include <chrono>
#include <exception>
#include <new>
#include <utility>

namespace obscura::emulator {
namespace {

using service::Failure;
using service::FailureCode;

constexpr std::chrono::milliseconds poll_interval{50};

} // namespace

std::string SceneRequests::ask(Wish wish, const std::atomic<bool>& given_up) {
    const auto request = std::make_shared<Request>();
    request->wish = std::move(wish);
    {
        const std::lock_guard lock(mutex_);
        if (closed_) throw Failure(FailureCode::not_now, "the daemon is stopping");
        if (in_work_ || waiting_) throw Failure(FailureCode::busy, "another scene is being prepared");
        waiting_ = request;
    }
    std::future<std::string> answer = request->answer.get_future();
    while (answer.wait_for(poll_interval) != std::future_status::ready)
        if (given_up) request->withdrawn = true;
    std::string why = answer.get();
    if (request->withdrawn && !why.empty()) throw service::cancelled();
    return why;
}

void SceneRequests::serve(const Load& load, const Change& change) {
    std::shared_ptr<Request> request;
    {
        const std::lock_guard lock(mutex_);
        // While a scene is built the main thread comes here again.
        if (in_work_ || !waiting_) return;
        request = std::exchange(waiting_, nullptr);
        in_work_ = true;
    }
    std::string why;
    try {
        const auto wanted = [&request] { return !request->withdrawn; };
        why = request->wish.values ? change(*request->wish.values, wanted) : load(request->wish.file, wanted);
    } catch (const std::bad_alloc&) {
        why = "out of memory";
    } catch (const std::exception& error) {
        why = error.what();
    }
    why.resize(std::min(why.find('\n'), why.size())); // the first mistake of a file with several
    const std::filesystem::path& file = request->wish.file;
    if (file != configured) {
        ++(why.empty() ? shown_ : refused_);
        if (why.empty())
            log_notice("scene: {} is shown", file.string());
        else
            log_error("scene: nothing changed: {}", why);
    }
    {
        const std::lock_guard lock(mutex_);
        in_work_ = false;
    }
    request->answer.set_value(std::move(why));
}

void SceneRequests::close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    if (!waiting_) return;
    waiting_->answer.set_value("the daemon is stopping");
    waiting_.reset();
}

} // namespace obscura::emulator
