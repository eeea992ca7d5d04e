// SPDX-License-Identifier: Apache-2.0
// Memory that the clients of a server hold together: pictures that are made or wait to be sent, and what is
// shared.
#pragma once

#include "service/failure.hpp"

#include <fmt/format.h>

#include <atomic>
#include <cstdint>
#include <utility>

namespace obscura::service {

/// Bytes in use, up to a limit. Thread-safe; outlives what is taken of it.
class MemoryAccount {
public:
    explicit MemoryAccount(std::uint64_t limit) : limit_(limit) {}

    /// Bytes that are given back at the end.
    class Share {
    public:
        Share() = default;
        Share(Share&& other) noexcept
            : account_(std::exchange(other.account_, nullptr)), bytes_(other.bytes_) {}
        Share& operator=(Share&& other) noexcept {
            std::swap(account_, other.account_);
            std::swap(bytes_, other.bytes_);
            return *this;
        }
        ~Share() {
            if (account_ != nullptr) account_->used_.fetch_sub(bytes_);
        }
        [[nodiscard]] std::uint64_t bytes() const noexcept { return account_ != nullptr ? bytes_ : 0; }

    private:
        friend class MemoryAccount;
        Share(MemoryAccount& account, std::uint64_t bytes) : account_(&account), bytes_(bytes) {}

        MemoryAccount* account_ = nullptr;
        std::uint64_t bytes_ = 0;
    };

    /// Throws Failure (too_large) if so many bytes are not left.
    [[nodiscard]] Share take(std::uint64_t bytes) {
        std::uint64_t used = used_.load();
        do
            if (bytes > limit_ || used > limit_ - bytes)
                throw Failure(FailureCode::too_large,
                              fmt::format("{} bytes beside {} that clients hold, allowed {} in all", bytes,
                                          used, limit_));
        while (!used_.compare_exchange_weak(used, used + bytes));
        return {*this, bytes};
    }
    /// Makes `share` one of so many bytes. Throws as take(); the share is then as it was.
    void resize(Share& share, std::uint64_t bytes) {
        const std::uint64_t before = share.bytes();
        if (bytes > before) {
            Share more = take(bytes - before);
            more.account_ = nullptr; // it is part of the other one now
        } else {
            used_.fetch_sub(before - bytes);
        }
        share.account_ = this;
        share.bytes_ = bytes;
    }
    [[nodiscard]] std::uint64_t used() const noexcept { return used_.load(); }

private:
    const std::uint64_t limit_;
    std::atomic<std::uint64_t> used_{0};
};

} // namespace obscura::service
