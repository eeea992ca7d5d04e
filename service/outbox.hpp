// SPDX-License-Identifier: Apache-2.0
// Send queue of one client, two lanes: control messages overtake arrays.
#pragma once

#include "service/message.hpp"

#include <cstddef>
#include <deque>
#include <vector>

namespace obscura::service {

/// Messages in two queues: short ones, and those of a lane, which may have arrays. Short ones leave first; a
/// message that has begun is finished. Not thread-safe.
class Outbox {
public:
    /// Answers without arrays, errors, events.
    void add(Outgoing message);
    /// Answers and frames of one origin, which adds the next one once this has left.
    void add(Outgoing message, const void* lane);
    /// Whether a message of the lane has not left yet.
    [[nodiscard]] bool holds(const void* lane) const;
    [[nodiscard]] bool empty() const noexcept { return short_.empty() && bulk_.empty(); }
    [[nodiscard]] std::size_t size() const noexcept { return short_.size() + bulk_.size(); }
    void clear();

    /// Sends what the socket takes at once, and not much more than `most` bytes. Returns whether a message of
    /// a lane has left.
    bool send(int socket, std::size_t most);

    /// Messages of lanes that have left; the caller frees their arrays.
    [[nodiscard]] std::vector<Outgoing> take_sent();
    [[nodiscard]] bool has_sent() const noexcept { return !sent_.empty(); }

private:
    struct Entry {
        Outgoing message;
        std::size_t bytes = 0;
        const void* lane = nullptr;
    };
    static Entry entry(Outgoing message, const void* lane);

    std::deque<Entry> short_, bulk_;
    std::deque<Entry>* begun_ = nullptr; ///< whose first message has begun
    std::size_t offset_ = 0;             ///< bytes of it that have left
    std::vector<Outgoing> sent_;
};

} // namespace obscura::service
