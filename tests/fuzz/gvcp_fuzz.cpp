// SPDX-License-Identifier: Apache-2.0
// libFuzzer target: the camera's control port fed with a sequence of datagrams from two clients.
//
// Input: datagrams one after the other, each preceded by two bytes: its length (low byte; bit 0 of the second
// adds 256), then in the second byte bit 1: sent by the other client, bit 2: broadcast, bits 3-7: time that
// passes, in 100 ms.
#include "core/clock.hpp"
#include "transports/gige/control/control_port.hpp"

#include <cstdlib>
#include <span>

namespace {

using namespace obscura;
using namespace obscura::transports::gige;

/// A camera that accepts whatever is within its limits.
class PlainCamera final : public CameraControl {
public:
    [[nodiscard]] CameraLimits limits() const override {
        CameraLimits l;
        l.sensor_width = 640;
        l.sensor_height = 480;
        return l;
    }
    [[nodiscard]] CameraSettings settings() const override { return settings_; }
    bool apply(const CameraSettings& s) override {
        if (!explain_invalid(s, limits()).empty()) return false;
        settings_ = s;
        return true;
    }
    bool acquisition_start() override { return !std::exchange(acquiring_, true); }
    void acquisition_stop(bool) override { acquiring_ = false; }
    [[nodiscard]] bool acquiring() const override { return acquiring_; }
    bool software_trigger(Time) override { return acquiring_; }

private:
    CameraSettings settings_{.region = {0, 0, 640, 480}};
    bool acquiring_ = false;
};

class NoStream final : public StreamPort {
public:
    bool begin(const StreamConfig& c) override { return c.packet_size >= 576 && c.packet_size <= 1500; }
    void abort() noexcept override {}
    [[nodiscard]] bool idle() const noexcept override { return true; }
    bool wait_idle(std::int64_t) noexcept override { return true; }
    void resend(const ResendRequest&) noexcept override {}
    bool send_test_packet(const StreamConfig&) noexcept override { return true; }
    [[nodiscard]] std::uint16_t source_port() const noexcept override { return 1; }
};

void require(bool truth) {
    if (!truth) std::abort();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    NetworkInterface network;
    network.name = "eth9";
    network.address = 0xC0A80702;
    network.mask = 0xFFFFFF00;
    GigeSettings settings;
    FakeClock clock(Time{1'000'000'000'000});
    PlainCamera camera;
    NoStream stream;
    MessageChannel messages(network);
    Device device(settings, network, camera, stream, messages, clock);
    ControlPort port(device, settings, network);
    for (std::size_t at = 0; at + 2 <= size;) {
        const std::uint8_t how = data[at + 1];
        const std::size_t n = std::min<std::size_t>(data[at] + (how & 1U) * 256U, size - at - 2);
        const Peer from{0xC0A80705U + (how >> 1 & 1U), 50'000};
        clock.advance((how >> 3) * 100 * ns_per_ms);
        port.on_timer(clock.now());
        Peer to;
        require(port.take_due_reply(clock.now(), to).size() <= gvcp_max_datagram);
        const auto reply = port.handle({data + at + 2, n}, from, (how & 4U) != 0, clock.now());
        require(reply.size() <= gvcp_max_datagram);
        require(explain_invalid(camera.settings(), camera.limits()).empty());
        require(port.controlled() || !camera.acquiring());
        at += 2 + n;
    }
    return 0;
}
