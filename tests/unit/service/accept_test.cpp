// SPDX-License-Identifier: Apache-2.0
// Clients that a server does not take at once: it has no descriptor, or no place, for them.
#include "core/io/file_descriptor.hpp"
#include "service/server.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/native_client.hpp"
#include "tests/support/service_bench.hpp"
#include "tests/support/temp_folder.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace accept_test {

using namespace obscura;
using namespace obscura::service;
using namespace std::chrono_literals;

namespace {

class PlainHost final : public Host {
public:
    [[nodiscard]] std::string version() const override { return "test"; }
    [[nodiscard]] std::unique_ptr<Session> open() override {
        struct NoCalls final : Session {
            [[nodiscard]] Calls calls() override {
                const auto plain = [](const NoArguments&, Work& /*work*/) { return Answer{}; };
                return {call<NoArguments>("watch", Permission::view, "", plain),
                        call<NoArguments>("change", Permission::operate, "", plain),
                        call<NoArguments>("wait", Permission::view, "",
                                          [](const NoArguments&, Work& work) -> Answer {
                                              while (!work.cancelled())
                                                  std::this_thread::sleep_for(1ms);
                                              throw cancelled();
                                          })};
            }
        };
        return std::make_unique<NoCalls>();
    }
};

/// No further file can be opened while it lives.
class NoDescriptors {
public:
    NoDescriptors() {
        ::getrlimit(RLIMIT_NOFILE, &before_);
        const FileDescriptor lowest(::dup(STDOUT_FILENO));
        const rlimit none{static_cast<rlim_t>(lowest.get()), before_.rlim_max};
        ::setrlimit(RLIMIT_NOFILE, &none);
    }
    ~NoDescriptors() { ::setrlimit(RLIMIT_NOFILE, &before_); }
    NoDescriptors(const NoDescriptors&) = delete;
    NoDescriptors& operator=(const NoDescriptors&) = delete;

private:
    rlimit before_{};
};

/// A server with one place for clients of `path()`, and `places` with `idle` for those that watch.
class WatchedBench {
public:
    WatchedBench(std::size_t places, const IdleRules& idle) {
        limits_.clients = 1;
        limits_.local_clients = 0;
        std::vector<Listener> listeners;
        listeners.push_back(Listener::unix_socket(server_.path()));
        auto server = std::make_unique<Server>(limits_, host_, std::move(listeners));
        server->add_for(Permission::view, Listener::unix_socket(watched()), {places, idle});
        server_.start(std::move(server));
    }
    [[nodiscard]] std::string path() const { return server_.path(); }
    [[nodiscard]] std::string watched() const { return server_.path() + "w"; }

private:
    Limits limits_;
    PlainHost host_;
    test::ServerThread server_;
};

std::string code_of(test::NativeClient& client, const std::string& call) {
    client.request(7, {{"call", call}});
    return client.answer().head.value("code", "");
}

/// Whether the client's connection is served still.
bool is_there(test::NativeClient& client) {
    client.request(7, {{"call", "watch"}});
    return client.next().has_value();
}

} // namespace

TEST_CASE("a socket for viewing gives no other permission, not even to the daemon's own user", "[service]") {
    const WatchedBench bench(2, {});
    test::NativeClient watching(bench.watched()), owner(bench.path());
    CHECK(code_of(watching, "watch").empty());
    CHECK(code_of(watching, "change") == "forbidden");
    CHECK(code_of(owner, "change").empty());
    watching.request(3, {{"call", "memory.open"}});
    CHECK(watching.answer().frame.kind == MessageKind::answer);
}

TEST_CASE("clients that watch have places of their own", "[service]") {
    const WatchedBench bench(2, {});
    const test::NativeClient owner(bench.path());
    test::NativeClient further(bench.path(), false); // beyond the limit: the server says so and hangs up
    CHECK(further.answer().head["code"] == "busy");
    test::NativeClient watching(bench.watched());
    watching.request(1, {{"call", "wait"}});
    test::NativeClient beside(bench.watched());
    CHECK(code_of(beside, "watch").empty());
}

TEST_CASE("a client that watches waits for a place until another one is idle", "[service]") {
    const WatchedBench bench(2, {.idle = 400ms});
    test::NativeClient first(bench.watched()), second(bench.watched());
    const auto begin = std::chrono::steady_clock::now();
    first.request(1, {{"call", "wait"}}); // a call in progress is not idleness
    std::this_thread::sleep_for(200ms);
    CHECK(is_there(second));
    test::NativeClient third(bench.watched()); // waits for the answer to its hello
    CHECK(std::chrono::steady_clock::now() - begin >= 600ms);
    CHECK(is_there(third));
    CHECK_FALSE(is_there(second));
    first.request(2, {{"call", "status"}});
    CHECK(first.answer().head["call"] == "wait");
}

TEST_CASE("idle clients stay while no other one waits", "[service]") {
    const WatchedBench bench(2, {.idle = 1ms, .mute = 1ms});
    test::NativeClient first(bench.watched()), second(bench.watched());
    std::this_thread::sleep_for(500ms);
    CHECK(is_there(first));
    CHECK(is_there(second));
}

TEST_CASE("connections that ask nothing do not keep others out for long", "[service]") {
    const WatchedBench bench(2, {.idle = 1h, .mute = 20ms});
    test::NativeClient watching(bench.watched());
    std::vector<FileDescriptor> crowd;
    for (int i = 0; i < 8; ++i)
        crowd.push_back(test::connect_to(bench.watched()));
    test::NativeClient last(bench.watched()); // long before one of them has been idle for an hour
    CHECK(is_there(last));
    CHECK(is_there(watching));
}

TEST_CASE("a server rests while it has no descriptor for a client, which it serves later", "[service]") {
    const test::TempFolder folder;
    const std::string path = (folder.path() / "s").string();
    PlainHost host;
    std::vector<Listener> listeners;
    listeners.push_back(Listener::unix_socket(path));
    const Limits limits;
    Server server(limits, host, std::move(listeners));
    FileDescriptor client(::socket(AF_UNIX, SOCK_STREAM, 0));
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, path.size());
    const timeval timeout{60, 0};
    ::setsockopt(client.get(), SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
    std::atomic<int> turns{0};
    std::atomic<bool> stop{false};
    std::thread serves([&] {
        server.run([&] {
            ++turns;
            return stop.load();
        });
    });
    int connected = -1;
    std::int64_t taken = 0, allowed = 0;
    {
        // Nothing is checked in here: UndefinedBehaviorSanitizer needs descriptors to look at objects of
        // Catch.
        const NoDescriptors none;
        connected = ::connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address);
        std::this_thread::sleep_for(100ms);
        const auto begin = std::chrono::steady_clock::now();
        const int before = turns;
        std::this_thread::sleep_for(500ms);
        taken = turns - before;
        allowed = 5 + (std::chrono::steady_clock::now() - begin) / 20ms;
    }
    CHECK(connected == 0);
    CHECK(taken <= allowed);
    test::send_all(client, "no message of the protocol");
    char byte = 0;
    CHECK(::recv(client.get(), &byte, 1, 0) == 1); // the refusal
    stop = true;
    serves.join();
}

} // namespace accept_test
