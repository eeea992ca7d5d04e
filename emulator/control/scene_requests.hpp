// SPDX-License-Identifier: Apache-2.0
// Requests of control clients for another scene, a reload or other values of the configuration, from their
// threads to the main thread.
#pragma once

#include "config/document.hpp"

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

namespace obscura::emulator {

/// One at a time: a scene takes long to build, and another would only replace it. Thread-safe.
class SceneRequests {
public:
    /// In place of a file: the configuration is read again.
    static inline const std::filesystem::path configured{};

    /// Asks for `file` and waits for the answer: empty, or why the scene is not shown. Throws Failure if
    /// another request is in progress, or once `given_up` becomes true, when the request is withdrawn.
    [[nodiscard]] std::string ask(const std::filesystem::path& file, const std::atomic<bool>& given_up) {
        return ask({.file = file}, given_up);
    }
    /// The same for other values of the configuration, see with_values().
    [[nodiscard]] std::string ask(config::Value tables, const std::atomic<bool>& given_up) {
        return ask({.values = std::move(tables)}, given_up);
    }

    /// Main thread: calls `load` with the file that is asked for, if any, and a function that tells whether
    /// it is still wanted; its result is the answer, as is the text of what it throws.
    using Load =
        std::function<std::string(const std::filesystem::path& file, const std::function<bool()>& wanted)>;
    /// `change` is called for other values.
    using Change =
        std::function<std::string(const config::Value& tables, const std::function<bool()>& wanted)>;
    void serve(const Load& load, const Change& change = {});
    /// Answers requests from now on with a failure.
    void close();

    [[nodiscard]] std::uint64_t shown() const noexcept { return shown_.load(); }
    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(); }

private:
    struct Wish {
        std::filesystem::path file = configured;
        std::optional<config::Value> values{};
    };
    [[nodiscard]] std::string ask(Wish wish, const std::atomic<bool>& given_up);
    struct Request {
        Wish wish;
        std::promise<std::string> answer{};
        std::atomic<bool> withdrawn{false};
    };
    std::mutex mutex_;
    std::shared_ptr<Request> waiting_;
    bool in_work_ = false, closed_ = false;
    std::atomic<std::uint64_t> shown_{0}, refused_{0};
};

} // namespace obscura::emulator
