// SPDX-License-Identifier: Apache-2.0
// Loop over independent pieces of work on several threads, each with scratch memory of its own.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <limits>
#include <mutex>
#include <thread>
#include <vector>

namespace obscura::terrain::obt {

/// Threads that live as long as a loop does. Thread-bound.
template<typename Scratch>
class WorkerTeam {
public:
    /// `threads` of them; 0: as many as there are processors, at most `most`.
    WorkerTeam(unsigned threads, unsigned most)
        : scratch_(threads > 0 ? threads : std::clamp(std::thread::hardware_concurrency(), 1U, most)) {}

    /// Calls `work(index, scratch)` for the indices below `count`, on any thread, each once. Of several
    /// exceptions, that of the lowest index is thrown, as if one thread had gone through all.
    template<typename Work>
    void run(std::size_t count, const Work& work) {
        std::atomic<std::size_t> next{0}, end{count};
        std::mutex mutex;
        std::exception_ptr failure;
        std::size_t failed = std::numeric_limits<std::size_t>::max();
        const auto take = [&](Scratch& scratch) {
            for (std::size_t k = next++; k < end; k = next++)
                try {
                    work(k, scratch);
                } catch (...) {
                    const std::lock_guard lock(mutex);
                    end = 0;
                    if (k < failed) {
                        failed = k;
                        failure = std::current_exception();
                    }
                }
        };
        std::vector<std::thread> threads;
        for (std::size_t t = 1; t < std::min(scratch_.size(), count); ++t)
            threads.emplace_back([&, t] { take(scratch_[t]); });
        take(scratch_[0]);
        for (std::thread& thread : threads)
            thread.join();
        if (failure) std::rethrow_exception(failure);
    }

private:
    std::vector<Scratch> scratch_;
};

} // namespace obscura::terrain::obt
