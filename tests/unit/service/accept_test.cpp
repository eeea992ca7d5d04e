// SPDX-License-Identifier: Apache-2.0
// A server that has no descriptor for a client that waits.
#include "core/io/file_descriptor.hpp"
#include "service/server.hpp"
#include "tests/support/catch.hpp"
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
            [[nodiscard]] Calls calls() override { return {}; }
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

} // namespace

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
