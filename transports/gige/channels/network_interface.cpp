// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/channels/network_interface.hpp"

#include "core/error.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <fstream>
#include <memory>
#include <optional>

namespace obscura::transports::gige {
namespace {

std::uint32_t host_order(const sockaddr* a) {
    sockaddr_in in{};
    std::memcpy(&in, a, sizeof in);
    return ntohl(in.sin_addr.s_addr);
}

void ask_kernel(NetworkInterface& found) {
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return;
    ifreq request{};
    found.name.copy(request.ifr_name, sizeof request.ifr_name - 1);
    if (ioctl(fd, SIOCGIFMTU, &request) == 0) found.mtu = static_cast<std::uint32_t>(request.ifr_mtu);
    if (ioctl(fd, SIOCGIFHWADDR, &request) == 0)
        for (int i = 0; i < 6; ++i)
            found.mac = found.mac << 8 | static_cast<std::uint8_t>(request.ifr_hwaddr.sa_data[i]);
    close(fd);
    long speed = 0;
    std::ifstream("/sys/class/net/" + found.name + "/speed") >> speed;
    found.speed_mbit_s = speed > 0 ? static_cast<std::uint32_t>(speed) : 10'000;
}

} // namespace

std::string dotted(std::uint32_t ip) {
    return fmt::format("{}.{}.{}.{}", ip >> 24, ip >> 16 & 255, ip >> 8 & 255, ip & 255);
}

NetworkInterface find_interface(const std::string& wanted) {
    ifaddrs* list = nullptr;
    if (getifaddrs(&list) != 0)
        throw HardwareError(fmt::format("gige: cannot list network interfaces: {}", std::strerror(errno)));
    const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> guard(list, freeifaddrs);

    in_addr parsed{};
    std::optional<std::uint32_t> address;
    if (inet_pton(AF_INET, wanted.c_str(), &parsed) == 1) address = ntohl(parsed.s_addr);

    bool name_exists = false;
    std::string known;
    std::optional<NetworkInterface> found;
    bool first_of_interface = true;
    std::string previous_name;
    for (const ifaddrs* i = list; i != nullptr; i = i->ifa_next) {
        name_exists = name_exists || wanted == i->ifa_name;
        if (i->ifa_addr == nullptr || i->ifa_addr->sa_family != AF_INET || i->ifa_netmask == nullptr)
            continue;
        first_of_interface = previous_name != i->ifa_name;
        previous_name = i->ifa_name;
        const bool loopback = (i->ifa_flags & IFF_LOOPBACK) != 0;
        const std::uint32_t ip = host_order(i->ifa_addr);
        const std::uint32_t mask = host_order(i->ifa_netmask);
        known += fmt::format("{}{} ({})", known.empty() ? "" : ", ", i->ifa_name, dotted(ip));
        const bool matches = address ? ip == *address || (loopback && (ip & mask) == (*address & mask))
                                     : wanted == i->ifa_name;
        if (found || !matches) continue;
        if ((i->ifa_flags & IFF_UP) == 0)
            throw HardwareError(fmt::format("gige.interface: {} is down", i->ifa_name));
        found.emplace();
        found->name = i->ifa_name;
        found->index = static_cast<int>(if_nametoindex(i->ifa_name));
        found->address = address.value_or(ip);
        found->mask = mask;
        found->broadcast = found->address | ~mask;
        found->loopback = loopback;
        ask_kernel(*found);
        // Every camera needs its own hardware address, because clients distinguish devices by it. 0x02:
        // locally administered.
        if (found->mac == 0 || !first_of_interface || found->address != ip)
            found->mac = 0x024F00000000ULL | found->address;
    }
    if (found) return *found;
    if (name_exists) throw HardwareError(fmt::format("gige.interface: {} has no IPv4 address", wanted));
    throw HardwareError(fmt::format("gige.interface: no interface \"{}\" here; there are {}", wanted, known));
}

} // namespace obscura::transports::gige
