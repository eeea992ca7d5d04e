// SPDX-License-Identifier: Apache-2.0
// Thread with a stack of a given size.
#pragma once

#include <pthread.h>

#include <cstddef>
#include <functional>

namespace obscura {

/// In a process that locks its memory, each thread's stack takes all of its size at once. Join it before its
/// end. Thread-bound.
class StackThread {
public:
    /// Runs `run`, which must not throw. Throws std::system_error.
    StackThread(std::size_t stack_bytes, std::function<void()> run);
    StackThread(const StackThread&) = delete;
    StackThread& operator=(const StackThread&) = delete;

    void join();
    /// Whether it has ended; then it is joined. Does not wait.
    [[nodiscard]] bool ended() noexcept;

private:
    pthread_t thread_{};
    bool joined_ = false;
};

} // namespace obscura
