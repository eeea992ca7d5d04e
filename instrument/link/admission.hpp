// SPDX-License-Identifier: Apache-2.0
// Admission of clients by their address: those of this machine, and those of other machines on a list.
#pragma once

#include "core/io/address_range.hpp"

#include <atomic>
#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::instrument {

/// Thread-safe.
class Admission {
public:
    /// `allowed`: other machines that may come; empty: all.
    explicit Admission(std::vector<AddressRange> allowed) : allowed_(std::move(allowed)) {}

    /// Whether a request from that address is taken. One that is not is said in the log, once for each of
    /// several in a row. `who`: "SCPI", "telecommand".
    [[nodiscard]] bool admits(std::uint32_t ip, std::string_view who) const;
    /// The same for the client of a TCP socket.
    [[nodiscard]] bool admits_peer(int socket, std::string_view who) const;

private:
    const std::vector<AddressRange> allowed_;
    mutable std::atomic<std::uint32_t> last_refused_{0};
};

} // namespace obscura::instrument
