// SPDX-License-Identifier: Apache-2.0
#include "tools/import/map/read_ahead.hpp"

#include <algorithm>

namespace obscura::tools {
namespace {

/// Numbers of a strip, and strips that are kept: 160 MB.
constexpr std::int64_t strip_numbers = std::int64_t{2} << 20;
constexpr std::size_t max_strips = 20;

} // namespace

ReadAhead::~ReadAhead() {
    stop();
}

void ReadAhead::stop() {
    if (!thread_.joinable()) return;
    {
        const std::lock_guard lock(mutex_);
        end_ = true;
    }
    changed_.notify_all();
    thread_.join();
    strips_.clear();
    failure_ = nullptr;
    end_ = false;
}

void ReadAhead::start(std::uint32_t plane, std::int64_t y) {
    stop();
    plane_ = plane;
    next_ = y;
    thread_ = std::thread([this] { run(); });
}

void ReadAhead::run() {
    const std::int64_t w = inner_.width(), h = inner_.height();
    const std::int64_t most = std::clamp<std::int64_t>(strip_numbers / w, 1, h);
    for (;;) {
        Strip strip;
        {
            std::unique_lock lock(mutex_);
            changed_.wait(lock, [&] { return end_ || (next_ < h && strips_.size() < max_strips); });
            if (end_) return;
            strip.y = next_;
            strip.rows = std::min(most, h - next_);
            if (!spare_.empty()) {
                strip.numbers = std::move(spare_.back());
                spare_.pop_back();
            }
        }
        std::exception_ptr failure;
        try {
            strip.numbers.resize(static_cast<std::size_t>(strip.rows * w));
            inner_.read(plane_, 0, strip.y, static_cast<int>(w), static_cast<int>(strip.rows), strip.numbers);
        } catch (...) {
            failure = std::current_exception();
        }
        {
            const std::lock_guard lock(mutex_);
            failure_ = failure;
            next_ = strip.y + strip.rows;
            if (!failure) strips_.push_back(std::move(strip));
        }
        changed_.notify_all();
        if (failure) return;
    }
}

void ReadAhead::read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
                     std::span<float> out) {
    const std::int64_t w = inner_.width();
    if (x != 0 || columns != w || !by_rows()) {
        stop();
        inner_.read(plane, x, y, columns, rows, out);
        return;
    }
    for (std::int64_t row = y; row < y + rows;) {
        std::unique_lock lock(mutex_);
        const bool follows = thread_.joinable() && plane == plane_ &&
                             row >= (strips_.empty() ? next_ : strips_.front().y) && row <= next_;
        if (!follows) {
            lock.unlock();
            start(plane, row);
            continue;
        }
        changed_.wait(lock, [&] { return failure_ || !strips_.empty(); });
        if (strips_.empty()) {
            const std::exception_ptr failure = failure_;
            lock.unlock();
            stop();
            std::rethrow_exception(failure);
        }
        // Only this thread takes strips away.
        const Strip& strip = strips_.front();
        lock.unlock();
        const std::int64_t count = std::min(y + rows, strip.y + strip.rows) - row;
        if (count > 0)
            std::copy_n(strip.numbers.begin() + static_cast<std::ptrdiff_t>((row - strip.y) * w), count * w,
                        out.begin() + static_cast<std::ptrdiff_t>((row - y) * w));
        row += std::max<std::int64_t>(count, 0);
        if (row < strip.y + strip.rows) continue;
        lock.lock();
        spare_.push_back(std::move(strips_.front().numbers));
        strips_.pop_front();
        lock.unlock();
        changed_.notify_all();
    }
}

} // namespace obscura::tools
