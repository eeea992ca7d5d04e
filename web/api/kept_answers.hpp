// SPDX-License-Identifier: Apache-2.0
// Answers to commands with an Idempotency-Key, kept so that a command that is sent again is not made again.
#pragma once

#include "web/server/message.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

/// Keys are those of a token: others may use the same. Answers that tell that nothing was done are not kept,
/// so that the command can be made after all. Thread-safe.
class KeptAnswers {
public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::minutes kept_for{10};
    static constexpr std::size_t max_per_token = 32, most = 256;   ///< of more the oldest go
    static constexpr std::size_t max_bytes = std::size_t{1} << 20; ///< of all bodies
    static constexpr std::size_t max_key_bytes = 128;

    /// A command in progress, whose key is forgotten if it ends without an answer. Ends before the
    /// KeptAnswers.
    class Command {
    public:
        Command(KeptAnswers& owner, std::uint64_t id) : owner_(owner), id_(id) {}
        ~Command() { owner_.end(id_, nullptr); }
        Command(const Command&) = delete;
        Command& operator=(const Command&) = delete;
        /// To be called once.
        void answered(const Response& response) { owner_.end(id_, &response); }

    private:
        KeptAnswers& owner_;
        const std::uint64_t id_;
    };
    /// One of both.
    struct Begun {
        std::optional<Response> answer;   ///< of the command that has been made with this key
        std::shared_ptr<Command> command; ///< that is to be made
    };
    /// `token` and `command`: text that differs where tokens or commands do. Throws Refusal: 422 for a key of
    /// a wrong form, or that of another command; 409 where the first one has no answer yet.
    [[nodiscard]] Begun begin(std::string_view token, std::string_view key, std::string_view command,
                              Clock::time_point now);

private:
    struct Entry {
        std::uint64_t id;
        std::string token, key, command;
        Clock::time_point at;
        std::optional<Response> answer{}; ///< none: in progress
    };
    /// `response`: null: there is none.
    void end(std::uint64_t id, const Response* response);
    /// Drops what is too old and, with a token that is about to get one more, the oldest of what is too much.
    void drop(Clock::time_point now, const std::string* token);

    std::mutex mutex_;         ///< of what follows
    std::list<Entry> entries_; ///< oldest first
    std::uint64_t last_id_ = 0;
    std::size_t bytes_ = 0;
};

} // namespace obscura::web
