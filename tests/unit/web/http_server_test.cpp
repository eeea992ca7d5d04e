// SPDX-License-Identifier: Apache-2.0
// The server against clients that read slowly, or not at all, and at several addresses.
#include "core/io/file_descriptor.hpp"
#include "tests/support/catch.hpp"
#include "web/http_server.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

namespace http_server_test {

using namespace obscura;
using namespace obscura::web;
using namespace std::chrono_literals;

namespace {

constexpr std::size_t side = 2048, frame_bytes = 2 * side * side;

/// A server that keeps one frame of 8 MiB, number 5 of camera 7-0.
class Bench {
public:
    explicit Bench(HttpLimits limits, const std::vector<std::string>& addresses = {"127.0.0.1:0"})
        : limits_(limits), server_(limits_, addresses) {
        auto frame = std::make_shared<KeptFrame>();
        frame->camera = {7, 0};
        frame->number = 5;
        frame->head = {{"number", 5}, {"bits", 12}};
        frame->width = frame->height = side;
        frame->pixels.assign(side * side, 9);
        Routes::Settings settings{{}, OwnNames({}, server_.port()), "1"};
        settings.tokens.add(Role::viewer, "t");
        settings.frames->keep(std::move(frame));
        routes_ = std::make_unique<Routes>(std::move(settings), watch_);
        thread_ = std::thread([this] { server_.run(*routes_, watch_, [this] { return stop_.load(); }); });
    }
    ~Bench() {
        stop_ = true;
        thread_.join();
    }
    Bench(const Bench&) = delete;
    Bench& operator=(const Bench&) = delete;

    /// A connection with a small receive buffer that has asked for a path.
    [[nodiscard]] FileDescriptor ask(std::string_view path, bool at_ipv6 = false) const {
        FileDescriptor client(::socket(at_ipv6 ? AF_INET6 : AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
        constexpr int bytes = 16384;
        ::setsockopt(client.get(), SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
        sockaddr_in v4{};
        v4.sin_family = AF_INET;
        v4.sin_port = htons(server_.port());
        v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        sockaddr_in6 v6{};
        v6.sin6_family = AF_INET6;
        v6.sin6_port = htons(server_.port());
        v6.sin6_addr = in6addr_loopback;
        const int connected =
            at_ipv6 ? ::connect(client.get(), reinterpret_cast<const sockaddr*>(&v6), sizeof v6)
                    : ::connect(client.get(), reinterpret_cast<const sockaddr*>(&v4), sizeof v4);
        REQUIRE(connected == 0);
        const std::string request = fmt::format(
            "GET {} HTTP/1.1\r\nHost: {}:{}\r\nAuthorization: Bearer t\r\nConnection: close\r\n\r\n", path,
            at_ipv6 ? "[::1]" : "127.0.0.1", server_.port());
        REQUIRE(::send(client.get(), request.data(), request.size(), MSG_NOSIGNAL) ==
                static_cast<ssize_t>(request.size()));
        return client;
    }
    [[nodiscard]] std::uint16_t port() const { return server_.port(); }

private:
    const HttpLimits limits_;
    HttpServer server_;
    DaemonWatch watch_{"/nowhere", 1h};
    std::unique_ptr<Routes> routes_;
    std::atomic<bool> stop_{false};
    std::thread thread_;
};

/// What is read until the server ends the connection, with a rest after each part.
std::string read_all(const FileDescriptor& client, std::chrono::milliseconds rest = 0ms) {
    std::string all;
    std::array<char, 65536> part{};
    while (true) {
        const ssize_t bytes = ::recv(client.get(), part.data(), part.size(), rest > 0ms ? MSG_WAITALL : 0);
        if (bytes <= 0) return all;
        all.append(part.data(), static_cast<std::size_t>(bytes));
        std::this_thread::sleep_for(rest);
    }
}

constexpr std::string_view frame_path = "/api/v1/cameras/7-0/frames/5.raw";

} // namespace

TEST_CASE("a client that reads slowly gets all of a large file", "[web]") {
    HttpLimits limits;
    limits.write_ms = 1000ms;
    const Bench bench(limits);
    const auto begin = std::chrono::steady_clock::now();
    const std::string answer = read_all(bench.ask(frame_path), 12ms);
    CHECK(answer.starts_with("HTTP/1.1 200 "));
    CHECK(answer.size() - answer.find("\r\n\r\n") - 4 == frame_bytes);
    // Longer than what a part may take.
    CHECK(std::chrono::steady_clock::now() - begin > limits.write_ms);
}

TEST_CASE("clients that do not read take no more memory than is set", "[web]") {
    HttpLimits limits;
    limits.write_ms = 3000ms;
    limits.answer_bytes = frame_bytes + 1000;
    const Bench bench(limits);
    const FileDescriptor stuck = bench.ask(frame_path);
    char first = 0;
    REQUIRE(::recv(stuck.get(), &first, 1, 0) == 1);
    const std::string refused = read_all(bench.ask(frame_path));
    CHECK(refused.starts_with("HTTP/1.1 503 "));
    CHECK(refused.find("Retry-After: 1") != std::string::npos);
    CHECK(read_all(bench.ask("/livez")).starts_with("HTTP/1.1 200 "));
    // In the end it loses its connection, and others get theirs.
    const auto end = std::chrono::steady_clock::now() + 60s;
    std::string answer = refused;
    while (answer.starts_with("HTTP/1.1 503 ") && std::chrono::steady_clock::now() < end) {
        std::this_thread::sleep_for(100ms);
        answer = read_all(bench.ask(frame_path));
    }
    CHECK(answer.starts_with("HTTP/1.1 200 "));
    CHECK(read_all(stuck).size() < frame_bytes);
}

TEST_CASE("a server may listen at several addresses", "[web]") {
    if (!is_here("[::1]:1")) return;
    std::uint16_t port = 0;
    {
        const HttpServer free(HttpLimits{}, {"127.0.0.1:0"});
        port = free.port();
    }
    const Bench bench({}, {fmt::format("127.0.0.1:{}", port), fmt::format("[::1]:{}", port)});
    CHECK(bench.port() == port);
    CHECK(read_all(bench.ask("/livez")).starts_with("HTTP/1.1 200 "));
    CHECK(read_all(bench.ask("/livez", true)).starts_with("HTTP/1.1 200 "));
}

TEST_CASE("addresses are read as they are written", "[web]") {
    CHECK(is_loopback("127.0.0.1:8420"));
    CHECK(is_loopback("[::1]:8420"));
    CHECK_FALSE(is_loopback("192.0.2.1:8420"));
    CHECK(is_wildcard("0.0.0.0:1"));
    CHECK(is_wildcard("[::]:1"));
    CHECK_FALSE(is_wildcard("[::1]:1"));
    CHECK(host_of("[0:0::1]:8420") == "[::1]");
    CHECK(host_of("192.0.2.1:8420") == "192.0.2.1");
    CHECK(is_here("127.0.0.1:8420"));
    CHECK_FALSE(is_here("192.0.2.1:8420"));
}

TEST_CASE("a server has the names that it is given", "[web]") {
    const OwnNames plain({"bench", "localhost:9000", "https://Proxy.example.org", "http://p.example.org:81"},
                         8420);
    for (const char* host : {"localhost:8420", "127.0.0.1:8420", "[::1]:8420", "BENCH:8420", "localhost:9000",
                             "proxy.example.org", "proxy.example.org:443", "p.example.org:81"}) {
        CAPTURE(host);
        CHECK(plain.allows_host(host));
    }
    for (const char* host : {"bench", "bench:80", "localhost", "localhost:9001", "proxy.example.org:8420", "",
                             "p.example.org", "127.0.0.1", "evil.example.org:8420"}) {
        CAPTURE(host);
        CHECK_FALSE(plain.allows_host(host));
    }
    for (const char* origin : {"http://localhost:8420", "http://bench:8420", "http://localhost:9000",
                               "https://proxy.example.org", "http://p.example.org:81"}) {
        CAPTURE(origin);
        CHECK(plain.allows_origin(origin));
    }
    // Not by another scheme than that of the name.
    for (const char* origin : {"https://localhost:8420", "http://proxy.example.org",
                               "https://p.example.org:81", "null", "http://bench", ""}) {
        CAPTURE(origin);
        CHECK_FALSE(plain.allows_origin(origin));
    }
    const OwnNames secure({}, 443, true);
    CHECK(secure.allows_host("localhost"));
    CHECK(secure.allows_origin("https://localhost"));
    CHECK_FALSE(secure.allows_origin("http://localhost"));
    for (const char* good :
         {"bench", "bench.example.org", "localhost:9000", "https://b", "http://b:81", "[::1]:8421"})
        CHECK(OwnNames::is_name(good));
    for (const char* bad : {"", "https://", "b/", "b:", "b:0", "b:99999", "b:x", "https://b/p", "a b",
                            "user@b", "::1", "ftp://b"})
        CHECK_FALSE(OwnNames::is_name(bad));
}

} // namespace http_server_test
