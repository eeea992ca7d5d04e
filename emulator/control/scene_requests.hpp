// SPDX-License-Identifier: Apache-2.0
// Requests of control clients for another scene or a reload, from their threads to the main thread.
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <string>

namespace obscura::emulator {

/// One at a time: a scene takes long to build, and another would only replace it. Thread-safe.
class SceneRequests {
public:
    /// In place of a file: the configuration is read again.
    static inline const std::filesystem::path configured{};

    /// Asks for `file` and waits for the answer: empty, or why the scene is not shown. Throws Failure if
    /// another request is in progress, or once `given_up` becomes true, when the request is withdrawn.
    [[nodiscard]] std::string ask(const std::filesystem::path& file, const std::atomic<bool>& given_up);

    /// Main thread: calls `load` with the file that is asked for, if any, and a function that tells whether
    /// it is still wanted; its result is the answer, as is the text of what it throws.
    using Load =
        std::function<std::string(const std::filesystem::path& file, const std::function<bool()>& wanted)>;
    void serve(const Load& load);
    /// Answers requests from now on with a failure.
    void close();

    [[nodiscard]] std::uint64_t shown() const noexcept { return shown_.load(); }
    [[nodiscard]] std::uint64_t refused() const noexcept { return refused_.load(); }

private:
    struct Request {
        std::filesystem::path file;
        std::promise<std::string> answer{};
        std::atomic<bool> withdrawn{false};
    };
    std::mutex mutex_;
    std::shared_ptr<Request> waiting_;
    bool in_work_ = false, closed_ = false;
    std::atomic<std::uint64_t> shown_{0}, refused_{0};
};

} // namespace obscura::emulator
