// SPDX-License-Identifier: Apache-2.0
// Monitor socket of a daemon that is none: its calls are those that a test chooses.
#pragma once

#include "service/server.hpp"
#include "tests/support/service_bench.hpp"

#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <utility>

namespace obscura::test {

class FakeDaemon {
public:
    /// `calls` makes the table of each connection, on its thread.
    FakeDaemon(std::filesystem::path path, std::function<service::Calls()> calls)
        : path_(std::move(path)), host_(std::move(calls)) {
        auto server =
            std::make_unique<service::Server>(service::Limits{}, host_, std::vector<service::Listener>());
        server->add_for(service::Permission::view, service::Listener::unix_socket(path_),
                        {8, {.idle = std::chrono::seconds(2)}});
        server_.start(std::move(server));
    }
    [[nodiscard]] const std::filesystem::path& path() const { return path_; }

private:
    class CallsHost final : public service::Host {
    public:
        explicit CallsHost(std::function<service::Calls()> calls) : calls_(std::move(calls)) {}
        [[nodiscard]] std::string version() const override { return "fake"; }
        [[nodiscard]] std::unique_ptr<service::Session> open() override {
            return std::make_unique<CallsSession>(calls_());
        }

    private:
        struct CallsSession final : service::Session {
            explicit CallsSession(service::Calls made) : all(std::move(made)) {}
            [[nodiscard]] service::Calls calls() override { return all; }
            service::Calls all;
        };
        const std::function<service::Calls()> calls_;
    };

    const std::filesystem::path path_;
    CallsHost host_;
    ServerThread server_;
};

} // namespace obscura::test
