// SPDX-License-Identifier: Apache-2.0
// HTTP server with limits: one thread, Boost.Beast, answers of Routes.
#pragma once

#include "web/api/routes.hpp"
#include "web/http_request.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace obscura::web {

class Tls;
class LivePictures;

/// Serves until it is stopped. A stream whose client does not read loses it after write_ms; what it has not
/// got waits in DaemonWatch, not here.
class HttpServer {
public:
    /// Listens at those addresses, one or more like "127.0.0.1:8420" or "[::1]:8420"; port 0: any free one.
    /// With `tls`, which outlives this, it speaks HTTPS. Throws HardwareError.
    HttpServer(const HttpLimits& limits, const std::vector<std::string>& addresses, const Tls* tls = nullptr);
    ~HttpServer();
    HttpServer(const HttpServer&) = delete;
    HttpServer& operator=(const HttpServer&) = delete;

    /// Port of the first address, and ports of all.
    [[nodiscard]] std::uint16_t port() const { return ports().front(); }
    [[nodiscard]] std::vector<std::uint16_t> ports() const;
    /// Serves live pictures, too; before run().
    void serve_live(std::shared_ptr<LivePictures> pictures);
    /// Serves on this thread, and does jobs on one of its own, until `stopped`, which is asked five times a
    /// second, returns true. The arguments outlive the call.
    void run(Routes& routes, const DaemonWatch& watch, const std::function<bool()>& stopped);

private:
    class Impl;
    const std::unique_ptr<Impl> impl_;
};

/// Whether an address "HOST:PORT" is of the loopback interface, is that of all interfaces, or is one of this
/// machine, and its first part as in an URL. These throw InputError if it is no address.
[[nodiscard]] bool is_loopback(const std::string& address);
[[nodiscard]] bool is_wildcard(const std::string& address);
[[nodiscard]] bool is_here(const std::string& address);
[[nodiscard]] std::string host_of(const std::string& address);

} // namespace obscura::web
