// SPDX-License-Identifier: Apache-2.0
// Cards that one thread replaces while others write files with them.
#pragma once

#include "images/writers/card.hpp"

#include <mutex>
#include <utility>

namespace obscura::images {

/// Thread-safe; not real-time safe.
class SharedCards {
public:
    explicit SharedCards(Cards cards) : cards_(std::move(cards)) {}
    void set(Cards cards) {
        const std::lock_guard lock(mutex_);
        cards_ = std::move(cards);
    }
    [[nodiscard]] Cards get() const {
        const std::lock_guard lock(mutex_);
        return cards_;
    }

private:
    mutable std::mutex mutex_;
    Cards cards_;
};

} // namespace obscura::images
