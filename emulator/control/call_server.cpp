// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/call_server.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/control/configuration_call.hpp"
#include "emulator/control/scene_tree.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/monitor/monitor.hpp"
#include "host/monitor_paths.hpp"

#include <fmt/format.h>
#include <grp.h>
#include <unistd.h>

#include <chrono>
#include <exception>
#include <filesystem>
#include <optional>
#include <utility>

namespace obscura::emulator {
namespace {

/// Calls compute little, and the daemon locks its memory.
constexpr std::size_t stack_bytes = 512U << 10;

/// Places of the clients of [monitor], which those of [control] cannot take. Silence after which one makes
/// room: more than the period of those that watch, and less than the time-out of those that wait meanwhile.
/// Clients ask as soon as they are connected.
constexpr service::OwnPlaces watchers{
    8, {.idle = std::chrono::milliseconds(2000), .mute = std::chrono::milliseconds(200)}};

CameraCalls::Cameras cameras_of(Daemon& daemon) {
    CameraCalls::Cameras cameras;
    for (std::size_t i = 0; i < daemon.camera_count(); ++i) {
        CameraUnit& unit = daemon.unit(i);
        cameras.push_back(std::unique_ptr<ControlledCamera>(new ControlledCamera{
            unit.camera(), unit.clock(),
            [&unit](const transports::Transport::ControlWork& work) { unit.run_between_commands(work); },
            unit.simulator(), unit.watch(), unit.fault_rules(), &unit.recent_timing(),
            [&daemon] { return daemon.config_sha256(); }, unit.device_features(),
            [&unit](const transports::KeptFrame& frame) -> std::shared_ptr<const FrameOverlay> {
                const auto scene = unit.scene_of(frame.info);
                return scene ? unit.overlays().of(frame, *scene) : nullptr;
            }}));
    }
    return cameras;
}

std::filesystem::path scenes_of(const DaemonConfig& config) {
    return config.control.scenes.empty() ? std::filesystem::path(config.scene_file).parent_path()
                                         : std::filesystem::path(config.control.scenes);
}

/// Throws HardwareError.
service::Listener socket_at(const std::filesystem::path& path) {
    if (const std::string why = host::prepare_socket_folder(path.parent_path()); !why.empty())
        throw HardwareError(fmt::format("{}: {}", path.string(), why));
    return service::Listener::unix_socket(path);
}

/// A socket at its automatic path is optional: a camera starts without it.
void add_automatic_socket(std::vector<service::Listener>& listeners) {
    const std::filesystem::path path = host::own_calls_socket();
    host::remove_left_over_sockets(path.parent_path());
    try {
        listeners.push_back(socket_at(path));
    } catch (const HardwareError& error) {
        log_warning("calls: no socket: {}", error.what());
    }
}

/// The socket for those who watch. None: the configuration wants none, or the automatic one cannot be opened.
/// Throws HardwareError.
std::optional<service::Listener> monitor_socket(const std::string& where) {
    if (where == host::no_monitor) return std::nullopt;
    const bool automatic = where == host::automatic_monitor;
    const std::filesystem::path path = automatic ? host::own_monitor_socket() : std::filesystem::path(where);
    try {
        if (automatic) host::remove_left_over_sockets(path.parent_path());
        service::Listener listener = socket_at(path);
        log_info("monitor: {}", listener.address());
        return listener;
    } catch (const HardwareError& error) {
        if (!automatic) throw HardwareError(fmt::format("monitor.socket: {}", error.what()));
        log_warning("monitor: socket not opened: {}", error.what());
        return std::nullopt;
    }
}

/// The group of that name; none: it has none. A camera is not to stay down for a group either.
std::optional<gid_t> group_of(const std::string& name) {
    if (name.empty()) return std::nullopt;
    std::vector<char> text(1 << 16);
    group row{};
    group* found = nullptr;
    if (::getgrnam_r(name.c_str(), &row, text.data(), text.size(), &found) == 0 && found != nullptr)
        return found->gr_gid;
    log_warning("calls: control.admin_group: there is no group {}", name);
    return std::nullopt;
}

} // namespace

CallServer::CallServer(const DaemonConfig& config, const StartProgress& progress, const std::string& version)
    : config_(config),
      progress_(progress),
      version_(version),
      started_(MonotonicClock().now()),
      started_utc_ns_(std::chrono::duration_cast<std::chrono::nanoseconds>(
                          std::chrono::system_clock::now().time_since_epoch())
                          .count()) {}

CallServer::~CallServer() {
    stop();
}

void CallServer::open() {
    const ControlSection& section = config_.control;
    std::vector<service::Listener> listeners;
    service::Tokens tokens;
    if (!section.token_file.empty())
        tokens.add(section.token_permission, service::read_token_file(section.token_file));
    if (!section.listen.empty()) listeners.push_back(service::Listener::tcp(section.listen, !tokens.empty()));
    if (section.unix_socket == host::automatic_calls)
        add_automatic_socket(listeners);
    else if (!section.unix_socket.empty())
        listeners.push_back(service::Listener::unix_socket(section.unix_socket));
    std::optional<service::Listener> watched = monitor_socket(config_.monitor.socket);
    for (const service::Listener& listener : listeners) {
        addresses_.push_back(listener.address());
        log_info("calls: {}", listener.address());
    }
    if (listeners.empty() && !watched) return;
    service::Limits limits;
    limits.clients = static_cast<std::size_t>(section.clients);
    limits.stack_bytes = stack_bytes;
    starting_ = std::make_unique<StartingHost>(
        version_, progress_,
        nlohmann::json{{"version", version_},
                       {"pid", ::getpid()},
                       {"config", config_.source.string()},
                       // The Unix socket, if there is one, tells who calls.
                       {"control", addresses_.empty() ? std::string() : addresses_.back()},
                       {"started_utc_ns", std::to_string(started_utc_ns_)}});
    server_ = std::make_unique<service::Server>(limits, *starting_, std::move(listeners), std::move(tokens),
                                                group_of(section.admin_group));
    if (watched) server_->add_for(service::Permission::view, std::move(*watched), watchers);
    stopping_ = false;
    thread_ = std::thread([this] {
        const std::unique_lock running(pausing_);
        // Threads of clients inherit all of it.
        enter_client_thread("calls", {});
        try {
            server_->run([this] { return stopped(); });
        } catch (const std::exception& error) {
            log_error("calls: server stopped: {}", error.what());
        }
    });
}

/// On the server's thread, several times a second.
bool CallServer::stopped() {
    if (pause_.load()) {
        pausing_.unlock();
        while (pause_.load() && !stopping_.load())
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
        pausing_.lock();
    }
    if (const std::optional<CoreSet> cores = std::exchange(cores_, std::nullopt))
        enter_client_thread("calls", *cores);
    return stopping_.load();
}

void CallServer::pause_for(const std::function<void()>& work) {
    if (!thread_.joinable()) return work();
    pause_ = true;
    {
        const std::lock_guard paused(pausing_);
        work();
    }
    pause_ = false;
}

void CallServer::start(Daemon& daemon, Monitor& monitor) {
    host_ = std::make_unique<ControlHost>(
        version_, cameras_of(daemon), scenes_of(daemon.config()), daemon.config().models,
        ordinary_cores(daemon.threads()),
        ControlHost::Sources{[&monitor] { return monitor.state(); },
                             [&daemon] { return std::filesystem::path(daemon.config().scene_file); },
                             [&daemon] { return daemon.config(); },
                             [&daemon] { return describe_configuration(daemon.config()); },
                             [&daemon](std::size_t camera, const FrameInfo& frame) {
                                 return daemon.unit(camera).probe_source(frame);
                             },
                             [&daemon](std::size_t camera) {
                                 const CameraUnit& unit = daemon.unit(camera);
                                 return scene_tree({*daemon.config().cameras().at(camera), unit.scene(),
                                                    unit.pose_rings(), unit.simulator_counters()});
                             },
                             [&daemon](std::size_t camera) {
                                 std::string controller = daemon.unit(camera).controller();
                                 daemon.unit(camera).release_control();
                                 return controller;
                             }});
    monitor.set_started(started_, started_utc_ns_);
    if (!addresses_.empty()) monitor.set_control(addresses_.back());
    if (!starting_) return;
    pause_for([&] { cores_ = ordinary_cores(daemon.threads()); });
    starting_->hand_over(*host_);
}

void CallServer::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    if (host_) host_->close(); // calls that wait for the main thread end
    thread_.join();
    server_.reset();
}

} // namespace obscura::emulator
