// SPDX-License-Identifier: Apache-2.0
#include "tools/check/device_check.hpp"

#include "core/clock.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/io/path_state.hpp"
#include "emulator/daemon/tai_reference.hpp"
#include "emulator/render/render_scheduling.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "ephemeris/time/leap_seconds.hpp"
#include "images/writers/pending_file.hpp"
#include "sync/inputs/gpio_output.hpp"
#include "sync/inputs/ipv4_endpoint.hpp"
#include "sync/settings.hpp"
#include "transports/file/settings.hpp"
#include "transports/gige/channels/network_interface.hpp"
#include "transports/gige/settings.hpp"
#include "transports/stimulator/libusb_bus.hpp"
#include "transports/stimulator/settings.hpp"
#include "transports/v4l2/settings.hpp"
#include "transports/v4l2/v4l2_node.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <functional>
#include <optional>
#include <utility>

namespace obscura::tools {
namespace {

class Trials {
public:
    /// Runs `attempt`, which returns what was found or throws an Error.
    void run(std::string device, DeviceState otherwise, const std::function<std::string()>& attempt) {
        DeviceTrial trial{std::move(device), DeviceState::ok, {}};
        try {
            trial.text = attempt();
        } catch (const Error& error) {
            trial.state = otherwise;
            trial.text = error.what();
        }
        done.push_back(std::move(trial));
    }

    std::vector<DeviceTrial> done;
};

class DiscardTriggers final : public sync::TriggerSink {
public:
    void on_trigger(const sync::Trigger& /*trigger*/) noexcept override {}
};

/// Binds a socket of `type` to `address` and closes it. Throws HardwareError that names `key`.
void try_bind(const std::string& key, const std::string& text, int type, const sockaddr_in& address) {
    const FileDescriptor fd(::socket(AF_INET, type | SOCK_CLOEXEC, 0));
    const int on = 1;
    if (type == SOCK_STREAM) ::setsockopt(fd.get(), SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    if (fd && ::bind(fd.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return;
    const int cause = errno;
    const char* cure = cause == EADDRINUSE
                           ? "; stop the program that has it (ss -lnp shows it), or choose another"
                       : cause == EACCES        ? "; ports below 1024 need CAP_NET_BIND_SERVICE"
                       : cause == EADDRNOTAVAIL ? "; no interface has this address (ip address shows them)"
                                                : "";
    throw HardwareError(fmt::format("{}: cannot bind {} {}: {}{}", key, type == SOCK_DGRAM ? "UDP" : "TCP",
                                    text, std::strerror(cause), cure));
}

void try_gige(const transports::gige::GigeSettings& gige, Trials& trials) {
    namespace g = transports::gige;
    if (!gige.enabled) return;
    std::optional<g::NetworkInterface> network;
    trials.run(fmt::format("gige.interface {}", gige.interface), DeviceState::failed, [&] {
        network = g::find_interface(gige.interface);
        return fmt::format("{}, {}, MTU {}", network->name, g::dotted(network->address), network->mtu);
    });
    if (!network) return;
    trials.run(fmt::format("gige.port {}", gige.port), DeviceState::failed, [&] {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(network->address);
        address.sin_port = htons(static_cast<std::uint16_t>(gige.port));
        const std::string text = fmt::format("{}:{}", g::dotted(network->address), gige.port);
        try_bind("gige.port", text, SOCK_DGRAM, address);
        return fmt::format("UDP {} is free", text);
    });
    if (!gige.state_file.empty())
        trials.run(fmt::format("gige.state_file {}", gige.state_file), DeviceState::failed, [&] {
            const auto folder = std::filesystem::path(gige.state_file).parent_path();
            images::require_writable(folder.empty() ? "." : folder);
            return std::string("its folder is writable");
        });
}

void try_source(const sync::TriggerLineSettings& line, Trials& trials) {
    const sync::SourceKind* kind = line.kind();
    // A schedule without a device needs nothing; the simulator's port is tried on its own.
    if (kind == nullptr ||
        (kind->traits().group != sync::SourceGroup::input && kind->traits().device.empty()))
        return;
    trials.run(fmt::format("{}.source {}", line.table(), line.source), DeviceState::failed, [&] {
        const MonotonicClock clock;
        DiscardTriggers sink;
        const auto source = sync::make_source(line, clock, {});
        source->start(sink);
        source->stop();
        return std::string("opened");
    });
}

void try_output(const std::string& key, const std::string& line, bool active_low, Trials& trials) {
    if (line.empty()) return;
    trials.run(fmt::format("{} {}", key, line), DeviceState::failed, [&] {
        const auto output = sync::open_gpio_output(key, line, active_low);
        return std::string("requested for output, inactive");
    });
}

void try_simulator(const emulator::SimulatorSection& simulator, Trials& trials) {
    if (!simulator.enabled) return;
    const std::string key = "simulator.listen";
    trials.run(fmt::format("{} {}", key, simulator.listen), DeviceState::failed, [&] {
        const sockaddr_in address = sync::parse_ipv4_endpoint(key, simulator.listen, 0, "127.0.0.1:5003");
        try_bind(key, simulator.listen, SOCK_STREAM, address);
        try_bind(key, simulator.listen, SOCK_DGRAM, address);
        return std::string("TCP and UDP are free");
    });
}

void try_video(const transports::V4l2Settings& v4l2, Trials& trials) {
    if (!v4l2.enabled) return;
    trials.run(fmt::format("v4l2.device {}", v4l2.device),
               v4l2.required ? DeviceState::failed : DeviceState::missing, [&] {
                   const transports::V4l2Node node(transports::system_v4l2_calls(), v4l2, {});
                   return std::string("a video node that takes images");
               });
}

void try_display(const transports::StimulatorSettings& stimulator, Trials& trials) {
    if (!stimulator.enabled) return;
    const auto vendor = static_cast<std::uint16_t>(stimulator.vendor_id);
    const auto product = static_cast<std::uint16_t>(stimulator.product_id);
    trials.run(fmt::format("stimulator {:04x}:{:04x}", vendor, product), DeviceState::missing, [&] {
        for (const transports::UsbIdentity& display : transports::make_libusb_bus()->list(vendor, product)) {
            if (!stimulator.serial.empty() && display.serial != stimulator.serial) continue;
            if (!display.problem.empty())
                throw HardwareError(fmt::format("the display at bus {} address {} cannot be opened: {}",
                                                display.bus, display.address, display.problem));
            return fmt::format("bus {} address {}", display.bus, display.address);
        }
        throw HardwareError(fmt::format(
            "no USB display {:04x}:{:04x}{} is connected; the daemon waits for it. lsusb shows what is there",
            vendor, product, stimulator.serial.empty() ? "" : " with serial " + stimulator.serial));
    });
}

/// The folder itself, or the nearest one above it that exists: the daemon creates the rest.
void try_folder(const transports::FileSinkSettings& file, Trials& trials) {
    if (!file.enabled) return;
    trials.run(fmt::format("file.directory {}", file.directory), DeviceState::failed, [&] {
        std::filesystem::path folder = absolute_path(file.directory);
        std::error_code error;
        while (!std::filesystem::exists(folder, error) && folder.has_relative_path())
            folder = folder.parent_path();
        images::require_writable(folder);
        const auto space = std::filesystem::space(folder, error);
        return fmt::format("{}, {:.1f} GB free",
                           folder == std::filesystem::path(file.directory) ? "writable" : "can be created",
                           error ? 0.0 : static_cast<double>(space.available) * 1e-9);
    });
}

void try_tai(Trials& trials) {
    trials.run("TAI", DeviceState::missing, [] {
        const ephemeris::LeapSeconds list = ephemeris::system_leap_seconds();
        const int kernel_s = emulator::kernel_tai_minus_utc_s();
        const TaiCorrection tai = emulator::tai_correction(kernel_s, 0, list, std::time(nullptr));
        const std::string text = emulator::tai_text(tai, list);
        if (tai.source == TaiSource::unknown) throw HardwareError(text + "; set the clock");
        return tai.source == TaiSource::kernel ? fmt::format("UTC plus {} s {}", kernel_s, text) : text;
    });
}

void try_realtime(const emulator::DaemonConfig& config, Trials& trials) {
    using emulator::RealtimeMode;
    if (config.daemon.realtime == RealtimeMode::off) return;
    const DeviceState otherwise =
        config.daemon.realtime == RealtimeMode::required ? DeviceState::failed : DeviceState::missing;
    const emulator::ThreadPlan plan = emulator::configured_threads(config);
    if (const int priority = emulator::highest_priority(plan); priority > 0)
        trials.run(fmt::format("real-time priority {}", priority), otherwise, [&] {
            const RealtimeGrant grant = realtime_permitted(priority);
            if (!grant.granted)
                throw HardwareError(fmt::format(
                    "{}; start the daemon as a service, or allow it in /etc/security/limits.d (rtprio {}), or give CAP_SYS_NICE",
                    grant.why, priority));
            return std::string("permitted");
        });
    trials.run("rendering", otherwise, [&] {
        const RealtimeGrant grant = emulator::scheduling_permitted(plan.render);
        if (!grant.granted)
            throw HardwareError(
                fmt::format("{}; allow it by LimitNICE={} or CAP_SYS_NICE", grant.why, plan.render.nice));
        return std::string("its scheduling is permitted");
    });
    trials.run("locked memory", otherwise, [&] {
        const RealtimeGrant grant = lock_memory();
        if (grant.granted) munlockall();
        if (!grant.granted)
            throw HardwareError(fmt::format(
                "{}; "
                "start the daemon as a service, or allow it in /etc/security/limits.d (memlock unlimited), or give CAP_IPC_LOCK",
                grant.why));
        return std::string("permitted");
    });
}

} // namespace

std::vector<DeviceTrial> try_devices(const emulator::DaemonConfig& config) {
    Trials trials;
    for (const emulator::DaemonConfig* camera : config.cameras()) {
        if (camera == &config || camera->own_trigger)
            for (const sync::TriggerLineSettings& line : camera->trigger.lines)
                try_source(line, trials);
        try_gige(camera->transports.get<transports::gige::GigeSettings>(), trials);
        try_video(camera->transports.get<transports::V4l2Settings>(), trials);
        try_display(camera->transports.get<transports::StimulatorSettings>(), trials);
        try_folder(camera->transports.get<transports::FileSinkSettings>(), trials);
        try_simulator(camera->simulator, trials);
        try_output("outputs.trigger_ready", camera->outputs.trigger_ready, camera->outputs.active_low,
                   trials);
        try_output("outputs.exposure", camera->outputs.exposure, camera->outputs.active_low, trials);
    }
    if (config.ptp.enabled)
        trials.run(fmt::format("ptp.socket {}", config.ptp.socket), DeviceState::missing, [&] {
            std::error_code error;
            if (!std::filesystem::is_socket(config.ptp.socket, error))
                throw HardwareError(fmt::format(
                    "there is no socket {}: is ptp4l running, with this uds_address?", config.ptp.socket));
            return std::string("ptp4l's socket is there");
        });
    try_tai(trials);
    try_realtime(config, trials);
    return trials.done;
}

} // namespace obscura::tools
