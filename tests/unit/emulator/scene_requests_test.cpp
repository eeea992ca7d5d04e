// SPDX-License-Identifier: Apache-2.0
// Requests of control clients for another scene: handed to the main thread, answered once, one at a time.
#include "emulator/control/scene_requests.hpp"
#include "service/failure.hpp"
#include "tests/support/catch.hpp"

#include <atomic>
#include <filesystem>
#include <functional>
#include <future>
#include <new>
#include <stdexcept>
#include <string>
#include <thread>

namespace scene_requests_test {

using namespace obscura;
using namespace obscura::emulator;
using service::Failure;
using service::FailureCode;

namespace {

using Load = SceneRequests::Load;

/// A client that has asked for `file`; get() is its answer.
struct Client {
    std::atomic<bool> given_up{false};
    std::future<std::string> answer;

    Client(SceneRequests& requests, const std::string& file)
        : answer(std::async(std::launch::async,
                            [this, &requests, file] { return requests.ask(file, given_up); })) {}
    /// Code of the failure that the client gets.
    FailureCode code() {
        try {
            (void)answer.get();
        } catch (const Failure& failure) {
            return failure.code;
        }
        FAIL("the request was not refused");
        return FailureCode::internal;
    }
};

/// The main thread, until it has served one request.
void serve_one(SceneRequests& requests, const Load& load) {
    bool served = false;
    while (!served) {
        requests.serve([&](const auto& file, const auto& wanted) {
            served = true;
            return load(file, wanted);
        });
        std::this_thread::yield();
    }
}

Load answering(const std::string& why) {
    return [why](const auto& /*file*/, const auto& /*wanted*/) { return why; };
}

} // namespace

TEST_CASE("a request gets the answer of the main thread, in one line, and is counted") {
    SceneRequests requests;
    requests.serve(
        [](const auto&, const auto&) -> std::string { throw std::logic_error("none was asked for"); });

    Client good(requests, "good.toml");
    serve_one(requests, [](const std::filesystem::path& file, const std::function<bool()>& wanted) {
        CHECK(file == "good.toml");
        CHECK(wanted());
        return std::string();
    });
    CHECK(good.answer.get().empty());
    CHECK(requests.shown() == 1);

    Client bad(requests, "bad.toml");
    serve_one(requests, answering("bad.toml:3:1: wrong\nbad.toml:4:1: wrong, too"));
    CHECK(bad.answer.get() == "bad.toml:3:1: wrong");
    CHECK(requests.refused() == 1);

    Client thrown(requests, "thrown.toml");
    serve_one(requests,
              [](const auto&, const auto&) -> std::string { throw std::runtime_error("unreadable"); });
    CHECK(thrown.answer.get() == "unreadable");
    Client large(requests, "large.toml");
    serve_one(requests, [](const auto&, const auto&) -> std::string { throw std::bad_alloc(); });
    CHECK(large.answer.get() == "out of memory");
    CHECK(requests.shown() == 1);
    CHECK(requests.refused() == 3);
}

TEST_CASE("while a scene is prepared another request is refused, and the main thread may come by") {
    SceneRequests requests;
    Client first(requests, "first.toml");
    serve_one(requests, [&](const auto&, const auto&) {
        Client second(requests, "second.toml");
        CHECK(second.code() == FailureCode::busy);
        requests.serve(answering("nothing waits")); // from within, as while a scene is built
        return std::string();
    });
    CHECK(first.answer.get().empty());
    CHECK(requests.shown() == 1);
    CHECK(requests.refused() == 0);
}

TEST_CASE("a client that gives up withdraws its request, unless the scene is shown already") {
    SceneRequests requests;
    Client impatient(requests, "slow.toml");
    serve_one(requests, [&](const auto&, const std::function<bool()>& wanted) {
        impatient.given_up = true;
        while (wanted())
            std::this_thread::yield();
        return std::string("no longer wanted");
    });
    CHECK(impatient.code() == FailureCode::cancelled);

    Client late(requests, "quick.toml");
    serve_one(requests, [&](const auto&, const std::function<bool()>& wanted) {
        late.given_up = true;
        while (wanted())
            std::this_thread::yield();
        return std::string(); // shown all the same
    });
    CHECK(late.answer.get().empty());
    CHECK(requests.shown() == 1);
}

TEST_CASE("when the daemon stops, no request waits for ever") {
    SceneRequests requests;
    Client waiting(requests, "a.toml"); // comes before close(), or after it
    requests.close();
    std::string why;
    try {
        why = waiting.answer.get();
    } catch (const Failure& failure) {
        why = failure.what();
    }
    CHECK(why == "the daemon is stopping");
    Client after(requests, "b.toml");
    CHECK(after.code() == FailureCode::not_now);
    requests.serve([](const auto&, const auto&) -> std::string { throw std::logic_error("closed"); });
    CHECK(requests.shown() == 0);
}

} // namespace scene_requests_test
