// SPDX-License-Identifier: Apache-2.0
// Network interface of a camera, found by name or by one of its IPv4 addresses.
#pragma once

#include <cstdint>
#include <string>

namespace obscura::transports::gige {

/// IPv4 addresses in host byte order.
struct NetworkInterface {
    std::string name;
    int index = 0;
    std::uint32_t address = 0, mask = 0, broadcast = 0;
    std::uint32_t mtu = 1500;
    std::uint64_t mac = 0;             ///< 48 bits; derived from `address` if the interface has none
    std::uint32_t speed_mbit_s = 1000; ///< as the kernel reports it; 10000 if it reports none
    bool loopback = false;

    /// Whether `ip` can be reached without a router.
    [[nodiscard]] bool on_link(std::uint32_t ip) const noexcept {
        return loopback ? (ip >> 24) == 127 : (ip & mask) == (address & mask);
    }
};

/// `name_or_address`: "eth0", "192.168.7.2", or on the loopback interface any 127.x.y.z. Throws HardwareError
/// when there is no such interface, it is down or has no IPv4 address.
[[nodiscard]] NetworkInterface find_interface(const std::string& name_or_address);

/// "192.168.7.2".
[[nodiscard]] std::string dotted(std::uint32_t ip);

} // namespace obscura::transports::gige
