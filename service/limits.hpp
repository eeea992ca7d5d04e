// SPDX-License-Identifier: Apache-2.0
// Limits of what clients may send and ask for.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>

namespace obscura::service {

/// What one server grants; `hello` tells clients.
struct Limits {
    std::size_t clients = 16;                    ///< at a time
    std::size_t local_clients = 2;               ///< places beside those, for clients over Unix sockets alone
    std::uint32_t head_bytes = 1U << 20;         ///< of a message
    std::uint64_t body_bytes = 0;                ///< of a request; no call takes arrays yet
    std::size_t head_depth = 8;                  ///< maps and arrays within each other
    std::size_t head_values = 200'000;           ///< in the head of a message
    std::uint64_t memory_bytes = 4ULL << 30;     ///< of the pictures of all clients, and what they share
    std::uint64_t shared_bytes = 1ULL << 30;     ///< of the shared memory of a client
    std::size_t requests = 64;                   ///< of a client, received and not yet begun
    std::size_t streams = 4;                     ///< of a client, at a time
    std::uint32_t credits = 1000;                ///< of a stream, at a time
    std::chrono::milliseconds message_ms{30000}; ///< from the first byte of a message to its last
    std::chrono::milliseconds hello_ms{5000};    ///< from the connection to `hello`
    std::size_t stack_bytes = 8U << 20;          ///< of the thread of a client
};

} // namespace obscura::service
