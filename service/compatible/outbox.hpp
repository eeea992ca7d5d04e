// SPDX-License-Identifier: Apache-2.0
// Send queue of a published client, which may leave answers and log lines unread.
#pragma once

#include "service/compatible/limits.hpp"
#include "service/memory_account.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::service::compatible {

/// A message as it is sent: its encoding, and bytes behind it that need not be copied.
struct Packet {
    std::string start;
    std::string body{};
    MemoryAccount::Share share{};

    [[nodiscard]] std::size_t size() const noexcept { return start.size() + body.size(); }
};

/// The published client sends requests strictly one after another, reads the answers of some calls only, and
/// skips messages until one bears the name of its call. So:
///
/// An answer that is not begun is dropped as soon as a later request has been read: the client cannot be
/// waiting for it. At most one answer and CompatibleLimits::lines lines of log wait.
///
/// A line `[error]` makes the call that reads it fail, and what answers that call stays in the stream: the
/// next call of that name would take it for its own. So the answer of the failing call, and of the first call
/// after it for which the client waits, is held until the next request comes, and then dropped; or, if none
/// comes, for CompatibleLimits::hold_ms, as for a client that ignores errors.
///
/// Not thread-safe; does no input and output.
class Outbox {
public:
    using Clock = std::chrono::steady_clock;

    explicit Outbox(const CompatibleLimits& limits) : limits_(limits) {}

    /// Notes that `count` requests have been read. Returns the number of the first.
    std::uint64_t requests_read(std::size_t count);
    /// Adds a line of log; beyond the limit lines are counted, and the number follows.
    void add_line(std::string_view line, bool is_error);
    /// Adds the answer of a request. `waits`: the client reads the answer of this call. `failed`: a line
    /// `[error]` has been added for it.
    void add_answer(std::uint64_t request, Packet answer, bool waits, bool failed, Clock::time_point now);

    /// What is to be sent next, behind its first sent() bytes; null: nothing yet.
    [[nodiscard]] const Packet* next(Clock::time_point now);
    /// Whether there is something.
    [[nodiscard]] bool ready(Clock::time_point now) const noexcept;
    [[nodiscard]] std::size_t sent() const noexcept { return sent_; }
    /// Notes that `bytes` more of it have been sent.
    void advance(std::size_t bytes);
    /// When an answer that is held becomes due; none: none is.
    [[nodiscard]] std::optional<Clock::time_point> due() const noexcept;
    /// Bytes that wait.
    [[nodiscard]] std::size_t waiting() const noexcept;
    void clear();
    /// Large packets that were sent or dropped: to free them takes a while, which is not for the thread that
    /// serves other clients, nor under a lock.
    [[nodiscard]] std::vector<Packet> take_spent();
    [[nodiscard]] bool has_spent() const noexcept { return !spent_.empty(); }

private:
    struct Answer {
        Packet packet;
        bool waits = false;
        bool held = false;
        Clock::time_point until{}; ///< if held
    };

    void drop_current();
    void drop_answer();
    void spend(Packet packet);

    const CompatibleLimits limits_;
    std::uint64_t read_ = 0; ///< requests
    std::deque<Packet> lines_;
    std::size_t left_out_ = 0; ///< lines beyond the limit
    bool error_left_out_ = false;
    std::optional<Answer> answer_;
    std::optional<Packet> current_; ///< begun, or about to be
    bool current_is_answer_ = false;
    std::size_t sent_ = 0; ///< bytes of it
    /// Lines `[error]` for which no call has failed yet: each makes one of the calls fail that read.
    std::size_t unread_errors_ = 0;
    std::vector<Packet> spent_;
};

/// A line of log as a message.
[[nodiscard]] Packet line_packet(std::string_view line);

} // namespace obscura::service::compatible
