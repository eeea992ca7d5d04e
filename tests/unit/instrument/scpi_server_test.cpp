// SPDX-License-Identifier: Apache-2.0
// SCPI clients over TCP, without a daemon.
#include "instrument/scpi/server.hpp"
#include "tests/support/catch.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <array>
#include <atomic>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace scpi_server_test {

using namespace obscura;
using namespace obscura::instrument;

namespace {

/// A server for one client at a time, which may be silent for `idle`.
class Server {
public:
    explicit Server(std::chrono::seconds idle) {
        std::vector<ScpiPort> ports;
        ports.push_back({service::Listener::tcp("127.0.0.1:0"), true});
        const std::string& address = ports.front().listener.address();
        port_ = static_cast<std::uint16_t>(std::stoul(address.substr(address.rfind(':') + 1)));
        ScpiLimits limits;
        limits.clients = 1;
        limits.idle = {.idle = idle};
        server_.emplace(limits, DaemonAddress{}, "1.2", std::move(ports), all_);
        thread_ = std::thread([this] { server_->run([this] { return stopped_.load(); }); });
    }
    ~Server() {
        stopped_ = true;
        thread_.join();
    }
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;

    [[nodiscard]] FileDescriptor connect() const {
        FileDescriptor client(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port_);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        REQUIRE(::connect(client.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0);
        return client;
    }

private:
    const Admission all_{std::vector<AddressRange>{}};
    std::atomic<bool> stopped_{false};
    std::uint16_t port_ = 0;
    std::optional<ScpiServer> server_;
    std::thread thread_;
};

/// The answer to *ESE?; empty: the connection has ended.
std::string ask(const FileDescriptor& client) {
    (void)::send(client.get(), "*ESE?\n", 6, MSG_NOSIGNAL);
    std::array<char, 16> answer{};
    const ssize_t got = ::recv(client.get(), answer.data(), answer.size(), 0);
    return {answer.data(), got < 0 ? 0 : static_cast<std::size_t>(got)};
}

} // namespace

TEST_CASE("a client that has been silent for long makes room for another one", "[instrument]") {
    const Server server(std::chrono::seconds(0));
    const FileDescriptor first = server.connect();
    CHECK(ask(first) == "0\n");
    const FileDescriptor second = server.connect();
    CHECK(ask(second) == "0\n");
    CHECK(ask(first).empty());
}

TEST_CASE("a client that has spoken lately keeps its place", "[instrument]") {
    const Server server(std::chrono::hours(1));
    const FileDescriptor first = server.connect();
    CHECK(ask(first) == "0\n");
    CHECK(ask(server.connect()).empty());
    CHECK(ask(first) == "0\n");
}

TEST_CASE("machines on the list and this one are admitted", "[instrument]") {
    const Admission listed(parse_address_ranges("192.168.7.0/24"));
    CHECK(listed.admits(0xC0A80714, "SCPI"));
    CHECK(listed.admits(0x7F000001, "SCPI"));
    CHECK_FALSE(listed.admits(0xC0A80814, "SCPI"));
    CHECK_FALSE(listed.admits(0, "SCPI"));
    CHECK_FALSE(listed.admits_peer(-1, "SCPI"));
    CHECK(Admission(std::vector<AddressRange>{}).admits(0xC0A80814, "SCPI"));
}

} // namespace scpi_server_test
