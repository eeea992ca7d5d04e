// SPDX-License-Identifier: Apache-2.0
// Limits of the compatible protocol.
#pragma once

#include <chrono>
#include <cstddef>

namespace obscura::service::compatible {

/// What one client of the compatible protocol may send, and how it is answered.
struct CompatibleLimits {
    std::size_t message_bytes = std::size_t{64} << 20; ///< of one message
    std::size_t values = 4'000'000;                    ///< in one message
    std::size_t depth = 16;                            ///< maps and lists within each other
    std::chrono::milliseconds message_ms{30000};       ///< from the first byte of a message to its last
    std::size_t requests = 4096;                       ///< received and not yet done
    std::size_t request_bytes = std::size_t{64} << 20; ///< of those, unless it is a single one
    /// Time for which an answer that the client may not be waiting for is held back, see Outbox.
    std::chrono::milliseconds hold_ms{2000};
    /// Time that a client has to read the line before its connection ends.
    std::chrono::milliseconds linger_timeout_ms{1000};
    std::size_t lines = 100; ///< of log that wait to be sent
};

} // namespace obscura::service::compatible
