// SPDX-License-Identifier: Apache-2.0
// Watch over daemons that restart, fail for a while or speak another version, and what routes make of them.
#include "service/failure.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/fake_daemon.hpp"
#include "tests/support/temp_folder.hpp"
#include "web/api/routes.hpp"
#include "web/live/daemon_watch.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <poll.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace daemon_watch_test {

using namespace obscura;
using namespace obscura::web;
using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

namespace {

struct EventsAfter {
    std::uint64_t after = 0;

    service::Fields fields() { return {{config::key("after", &after)}}; }
};

/// A daemon whose answers the test chooses.
class ToldDaemon {
public:
    explicit ToldDaemon(const std::filesystem::path& path) : daemon_(path, [this] { return calls(); }) {}

    /// An empty line is one that is not kept any more. A state with `error` is refused with that.
    void set(Json state, std::vector<std::string> lines) {
        const std::lock_guard lock(mutex_);
        state_ = std::move(state);
        lines_ = std::move(lines);
    }
    [[nodiscard]] int states() const { return states_; }
    [[nodiscard]] const std::filesystem::path& path() const { return daemon_.path(); }

private:
    service::Calls calls() {
        using service::Answer, service::Permission, service::Work;
        return {service::call<service::NoArguments>(
                    "state", Permission::view, "",
                    [this](const service::NoArguments&, Work& /*work*/) { return state(); }),
                service::call<EventsAfter>(
                    "events", Permission::view, "",
                    [this](const EventsAfter& asked, Work& /*work*/) { return events(asked.after); })};
    }
    service::Answer state() {
        const std::lock_guard lock(mutex_);
        if (state_.contains("error"))
            throw service::Failure(service::FailureCode::busy, state_["error"].get<std::string>());
        ++states_;
        return {service::head_of(state_)};
    }
    service::Answer events(std::size_t after) {
        const std::lock_guard lock(mutex_);
        nlohmann::json events = nlohmann::json::array();
        for (std::size_t id = after + 1; id <= lines_.size(); ++id)
            if (!lines_[id - 1].empty()) events.push_back({{"id", id}, {"text", lines_[id - 1]}});
        return {{{"events", std::move(events)}}};
    }

    std::mutex mutex_;
    Json state_ = Json::object();
    std::vector<std::string> lines_;
    std::atomic<int> states_{0};
    test::FakeDaemon daemon_;
};

Json state_of(const std::string& started, int pid = 7) {
    return {{"daemon", {{"pid", pid}, {"config", "a.toml"}, {"started_utc_ns", started}}},
            {"cameras", {{{"verdict", {{"health", "good"}, {"text", "on time"}}}}}}};
}

void wait_until(const std::function<bool()>& done) {
    while (!done())
        std::this_thread::sleep_for(2ms);
}

/// Waits until the daemon has been asked twice more: what was set before has then been seen.
void wait_for_looks(const ToldDaemon& daemon) {
    const int before = daemon.states();
    wait_until([&] { return daemon.states() >= before + 2; });
}

std::vector<std::string> texts(const DaemonWatch& watch, std::uint64_t after = 0) {
    std::vector<std::string> texts;
    for (const WatchedEvent& one : watch.events(after, DaemonWatch::max_events))
        texts.push_back(one.event.at("text").get<std::string>());
    return texts;
}

using Texts = std::vector<std::string>;

/// Whether a question has come on that connection and its client still waits for the answer.
bool asked_once(const FileDescriptor& client) {
    std::array<char, 4096> bytes{};
    const bool asked = ::recv(client.get(), bytes.data(), bytes.size(), MSG_PEEK | MSG_DONTWAIT) > 0;
    pollfd end{client.get(), POLLRDHUP, 0};
    return asked && ::poll(&end, 1, 0) == 0;
}

} // namespace

TEST_CASE("events are told once, also of a daemon that fails for a while", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set(state_of("10"), {"one", "two"});
    const DaemonWatch watch(daemon.path(), 5ms);
    wait_until([&] { return texts(watch).size() >= 2; });
    daemon.set({{"error", "busy"}}, {});
    wait_until([&] { return watch.latest()->states.empty(); });
    CHECK(watch.latest()->error.find("busy") != std::string::npos);
    daemon.set(state_of("10"), {"one", "two", "three"});
    wait_until([&] { return !watch.latest()->states.empty(); });
    wait_for_looks(daemon);
    CHECK(texts(watch) == Texts{"one", "two", "three"});
}

TEST_CASE("a daemon that is restarted under the same number is another one", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set(state_of("10"), {"one", "two"});
    const DaemonWatch watch(daemon.path(), 5ms);
    wait_until([&] { return texts(watch).size() >= 2; });
    // It has as many lines already as the one before had.
    daemon.set(state_of("20"), {"started", "runs"});
    wait_until([&] { return texts(watch).size() >= 4; });
    wait_for_looks(daemon);
    CHECK(texts(watch) == Texts{"one", "two", "started", "runs"});
}

TEST_CASE("where a daemon has not kept its lines, the log says how many are lost", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set(state_of("10"), {"one", "two"});
    const DaemonWatch watch(daemon.path(), 5ms);
    wait_until([&] { return texts(watch).size() >= 2; });
    daemon.set(state_of("10"), {"", "", "", "", "", "six", "seven"});
    wait_until([&] { return texts(watch).size() >= 5; });
    wait_for_looks(daemon);
    CHECK(texts(watch) == Texts{"one", "two", "3 lines of the log are lost here", "six", "seven"});
}

TEST_CASE("a daemon that does not answer keeps no other one from being seen", "[web]") {
    const test::TempFolder folder;
    std::filesystem::create_directory(folder.path() / "obscura");
    const std::string before = ::getenv("XDG_RUNTIME_DIR") != nullptr ? ::getenv("XDG_RUNTIME_DIR") : "";
    ::setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
    // Connections are accepted, by the system, and nothing reads them.
    std::optional<service::Listener> silent(
        service::Listener::unix_socket(folder.path() / "obscura" / "obscurad-1.socket"));
    ToldDaemon daemon(folder.path() / "obscura" / "obscurad-2.socket");
    daemon.set(state_of("10", 8), {"one"});
    {
        const DaemonWatch watch({}, 5ms);
        // Each time that the silent one has been asked, until it is no longer waited for, which is after 5 s.
        bool beside = false;
        FileDescriptor client;
        int before = 0;
        wait_until([&] {
            if (FileDescriptor next = silent->accept()) {
                client = std::move(next);
                before = daemon.states();
            }
            const bool looked = client && daemon.states() >= before + 2;
            beside = looked && asked_once(client);
            return beside;
        });
        CHECK(beside);
        wait_until([&] { return !watch.latest()->states.empty(); });
        CHECK(watch.latest()->states.front()["daemon"]["pid"] == 8);
        client = FileDescriptor();
        silent.reset(); // ends the wait
    }
    ::setenv("XDG_RUNTIME_DIR", before.c_str(), 1);
    if (before.empty()) ::unsetenv("XDG_RUNTIME_DIR");
}

TEST_CASE("an event that has not been yet is of another run of the watch", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set(state_of("10"), {"one", "two"});
    const DaemonWatch watch(daemon.path(), 5ms);
    wait_until([&] { return texts(watch).size() >= 2; });
    CHECK(texts(watch, 1) == Texts{"two"});
    CHECK(texts(watch, 2).empty());
    CHECK(texts(watch, 3) == Texts{"one", "two"});
}

TEST_CASE("whoever wants looks again and again gets ten a second", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set(state_of("10"), {});
    const auto begin = std::chrono::steady_clock::now(); // before the first look
    DaemonWatch watch(daemon.path(), 1h);
    while (daemon.states() < 5) {
        watch.look_soon();
        std::this_thread::sleep_for(1ms);
    }
    CHECK(std::chrono::steady_clock::now() - begin >= 4 * DaemonWatch::shortest);
}

TEST_CASE("a daemon of another version is answered for with 503", "[web]") {
    const test::TempFolder folder;
    ToldDaemon daemon(folder.path() / "one.socket");
    daemon.set({{"daemon", {{"pid", 7}}}, {"cameras", {{{"latency_us", {{"render", {{"up_to", 3}}}}}}}}}, {});
    const DaemonWatch watch(daemon.path(), 5ms);
    wait_until([&] { return !watch.latest()->states.empty(); });
    Tokens tokens;
    tokens.add(Role::admin, "abc");
    Routes routes({tokens, OwnNames({}, 80), "1"}, watch);
    const auto status_of = [&routes](std::string_view target) {
        Request request;
        request.method = "GET";
        request.target = target;
        request.has_host = true;
        request.host = "localhost";
        request.bearer = "abc";
        return routes.answer(request).status;
    };
    CHECK(status_of("/readyz") == 503);
    CHECK(status_of("/metrics") == 200);
    CHECK(status_of("/api/v1/state") == 200);
    CHECK(status_of("/api/v1/cameras/7-0/features") == 503);
}

} // namespace daemon_watch_test
