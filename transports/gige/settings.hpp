// What a GigE Vision camera is made from.
#pragma once

#include "core/realtime.hpp"
#include "transports/gige/channels/fault_injector.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports::gige {

/// Plain data; the first fields are those of config's [gige] section under the same names.
struct GigeSettings {
    std::string interface = "lo"; ///< interface name or one of its IPv4 addresses; any 127.x.y.z on loopback
    std::int32_t port = 3956;     ///< clients know no other
    std::string vendor = "Obscura", model = "Obscura-1", serial = "OBS000001", user_name = "";
    std::uint64_t mac = 0;           ///< hardware address to show, 48 bits; 0: the interface's own
    std::int32_t packet_size = 1500; ///< reset value of GevSCPSPacketSize; taken down to the interface's MTU
    std::int32_t heartbeat_timeout_ms = 3000;
    std::int32_t history_frames = 4; ///< frames kept for packet resend; each holds a frame of the pool
    double drop_percent = 0;         ///< fault: payload packets left out on purpose at first sending
    std::uint64_t seed = 1;          ///< of that choice: same seed, same packets

    /// Reset value of DeviceLinkThroughputLimit. Receivers have room for a fraction of a frame, so a camera
    /// that sends faster than they read loses packets; a gigabit is what they are used to. 0: no limit.
    double throughput_limit_mbit_s = 1000;
    std::string firmware = "0.1.0";   ///< DeviceVersion
    std::int32_t max_rows = 0;        ///< of a frame composed of several windows; 0: as the sensor
    int realtime_priority = 0;        ///< SCHED_FIFO priority of the sender, control one above; 0: none
    CoreSet cores;                    ///< of its threads; none: any
    std::string backend = "sendmmsg"; ///< sendmmsg, sendto, gso, auto (gso but on lo, veth, bridge and tap)
    std::vector<FaultRule> faults;    ///< beside drop_percent
    std::vector<std::string>
        allow;              ///< addresses and ranges that may talk to the camera; empty: all on the link
    bool off_link = false;  ///< also answer sources behind a router
    bool read_only = false; ///< nobody gets control
    std::string xml;        ///< GenICam file of a real camera to be shown in place of our own
    std::string xml_values; ///< with `xml`: "Feature=value, ..." after reset
    std::string state_file; ///< where user sets are kept; empty: in memory only
};

/// "a, b" as {"a", "b"}; blanks do not count.
[[nodiscard]] std::vector<std::string> split_list(const std::string& text);

} // namespace obscura::transports::gige
