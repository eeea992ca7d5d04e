// SPDX-License-Identifier: Apache-2.0
// Requests of one client, read from the bytes that it sends.
#pragma once

#include "service/compatible/codec.hpp"
#include "service/compatible/limits.hpp"
#include "service/compatible/value.hpp"
#include "service/memory_account.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <string>
#include <string_view>

namespace obscura::service::compatible {

/// A message of the client. The memory that it takes is counted until it has been done.
struct ReadRequest {
    std::uint64_t number = 0; ///< of the outbox
    std::size_t bytes = 0;    ///< as it was sent
    Fields message;
    MemoryAccount::Share share{};
};

/// Reads ahead up to CompatibleLimits::requests. Thread-bound: of the thread that runs the requests, for
/// messages of millions of values take a while to read and to free.
class RequestReader {
public:
    /// `memory` outlives this.
    RequestReader(const CompatibleLimits& limits, MemoryAccount& memory)
        : limits_(limits), memory_(memory), decoder_(limits) {}

    /// More bytes of the client; best when wants_bytes().
    void add(std::string bytes);
    /// Reads on while few enough requests wait. Returns how many have come to `waiting`, at its end. Throws
    /// Failure; nothing can be read on then.
    std::size_t read();
    /// Whether bytes are left that read() would read on with.
    [[nodiscard]] bool can_read() const noexcept { return unread_ && has_room(); }
    /// Whether all bytes have been read that are there.
    [[nodiscard]] bool wants_bytes() const noexcept { return !unread_; }
    /// A message has begun and is not complete.
    [[nodiscard]] bool begun() const noexcept { return !unread_ && (!input_.empty() || decoder_.begun()); }
    /// The command `close` was read; nothing behind it is.
    [[nodiscard]] bool closed() const noexcept { return closed_; }
    /// The request that came first. There is one.
    [[nodiscard]] ReadRequest take();

    std::deque<ReadRequest> waiting;

private:
    [[nodiscard]] bool has_room() const noexcept;
    void take_message();

    const CompatibleLimits limits_;
    MemoryAccount& memory_;
    Decoder decoder_;
    std::string input_;
    std::size_t waiting_bytes_ = 0;
    bool unread_ = false; ///< input_ may hold a whole message
    bool closed_ = false;
    MemoryAccount::Share share_; ///< of the message that is being read
};

/// The command of a message; empty: none is named.
[[nodiscard]] std::string name_in(const Fields& message);
/// Whether these bytes, the last that a client has sent, end with the command `close`.
[[nodiscard]] bool ends_with_close(std::string_view bytes);
/// Bytes that are enough for that.
constexpr std::size_t close_bytes = 64;

} // namespace obscura::service::compatible
