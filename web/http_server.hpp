// SPDX-License-Identifier: Apache-2.0
// HTTP server with limits: one thread, Boost.Beast, answers of Routes.
#pragma once

#include "web/routes.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

class Tls;
class LivePictures;

/// What clients may take.
struct HttpLimits {
    std::size_t connections = 64;
    std::size_t of_one_address = 16;
    /// Further connections, which get /livez and are refused everything else.
    std::size_t for_health = 2;
    std::size_t streams = 24;
    std::uint32_t header_bytes = 8192;
    std::uint64_t body_bytes = 65536;
    std::chrono::milliseconds header_ms{2000}; ///< from the first byte of a request to the end of its header
    std::chrono::milliseconds body_ms{5000}, write_ms{10000}, idle_ms{30000};
};

/// Serves until it is stopped. A stream whose client does not read loses it after write_ms; what it has not
/// got waits in DaemonWatch, not here.
class HttpServer {
public:
    /// Listens at `address`, "127.0.0.1:8420" or "[::1]:8420"; port 0: any free one. With `tls`, which
    /// outlives this, it speaks HTTPS. Throws HardwareError.
    HttpServer(const HttpLimits& limits, const std::string& address, const Tls* tls = nullptr);
    ~HttpServer();
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    [[nodiscard]] std::uint16_t port() const;
    /// Serves live pictures, too; before run().
    void serve_live(std::shared_ptr<LivePictures> pictures);
    /// Serves on this thread, and does jobs on one of its own, until `stopped`, which is asked five times a
    /// second, returns true. The arguments outlive the call.
    void run(Routes& routes, const DaemonWatch& watch, const std::function<bool()>& stopped);

private:
    class Impl;
    const std::unique_ptr<Impl> impl_;
};

/// What a connection would answer to the first request in `bytes` without doing its job, for tests and
/// fuzzing; none: the request is not whole.
[[nodiscard]] std::optional<Response> answer_to(Routes& routes, const HttpLimits& limits,
                                                std::string_view bytes);

/// Whether an address "HOST:PORT" is of the loopback interface. Throws InputError if it is no address.
[[nodiscard]] bool is_loopback(const std::string& address);

} // namespace obscura::web
