// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/service.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "instrument/packets/space_packet.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <iterator>
#include <string_view>
#include <thread>
#include <utility>

namespace obscura::instrument {
namespace {

constexpr int poll_interval_ms = 50;
constexpr std::chrono::milliseconds report_period{100};
constexpr std::chrono::seconds housekeeping_period{1};
constexpr int max_commands = 32; ///< that are done before anything else is

sockaddr_in address_of(const std::string& text) {
    const std::size_t colon = text.rfind(':');
    sockaddr_in address{};
    address.sin_family = AF_INET;
    std::uint16_t port = 0;
    const std::string host = text.substr(0, colon);
    const std::string_view digits =
        colon == std::string::npos ? std::string_view() : std::string_view(text).substr(colon + 1);
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), port);
    address.sin_port = htons(port);
    if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size() ||
        ::inet_pton(AF_INET, host == "localhost" ? "127.0.0.1" : host.c_str(), &address.sin_addr) != 1)
        throw Error(exit_usage,
                    fmt::format("{}: no address, allowed ADDRESS:PORT such as 127.0.0.1:5301", text));
    return address;
}

/// A socket that is connected to (or bound at) the address, which is completed.
FileDescriptor open(const std::string& text, sockaddr_in& address, bool receives) {
    address = address_of(text);
    auto* const raw = reinterpret_cast<sockaddr*>(&address);
    FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    socklen_t size = sizeof address;
    const bool good = socket && (receives ? ::bind(socket.get(), raw, size) == 0 &&
                                                ::getsockname(socket.get(), raw, &size) == 0
                                          : ::connect(socket.get(), raw, size) == 0);
    if (!good) throw HardwareError(fmt::format("{}: {}", text, std::strerror(errno)));
    return socket;
}

std::string host_of(const sockaddr_in& address) {
    std::array<char, INET_ADDRSTRLEN> host{};
    ::inet_ntop(AF_INET, &address.sin_addr, host.data(), host.size());
    return host.data();
}

CommandResult result_of(const LinkError& error) {
    if (error.code == "controlled") return CommandResult::controlled;
    if (error.code == "not-now" || error.code == "busy") return CommandResult::not_now;
    if (error.code == "bad-argument") return CommandResult::out_of_range;
    if (error.code == "forbidden") return CommandResult::forbidden;
    if (error.code == "connection-lost") return CommandResult::daemon_lost;
    return CommandResult::failed;
}

} // namespace

PacketService::PacketService(const PacketOptions& options, DaemonAddress daemon, const Admission& admission)
    : first_apid_(options.first_apid),
      admission_(admission),
      link_(daemon),
      commanded_(std::move(daemon)),
      commands_(commanded_, "telecommand"),
      writer_(options.first_apid) {
    sockaddr_in address{};
    if (!options.telemetry.empty()) sender_ = open(options.telemetry, address, false);
    if (options.telecommands.empty()) return;
    receiver_ = open(options.telecommands, address, true);
    telecommand_address_ = fmt::format("{}:{}", host_of(address), ntohs(address.sin_port));
}

std::int64_t PacketService::tai_now() const {
    const MonotonicClock clock;
    return clock.now().ns + tai_offset_ns_.value_or(clock.tai_offset_ns());
}

template<typename Source>
void PacketService::send(const Source& source) {
    const std::vector<std::uint8_t> packet = writer_.write(source, tai_now());
    // A receiver that is not there yet is no error: packets are numbered, and it sees what it has missed.
    // send() reports that an earlier packet was refused, and sends nothing then: the packet is sent again.
    if (!sender_) return;
    for (int i = 0; i < 2; ++i)
        if (::send(sender_.get(), packet.data(), packet.size(), MSG_NOSIGNAL) >= 0 || errno != ECONNREFUSED)
            return;
}

void PacketService::count_command(std::uint32_t PacketCounters::*counter) {
    const std::lock_guard lock(mutex_);
    ++(counters_.*counter);
}

void PacketService::report(const Telecommand& command, CommandResult result, std::uint64_t frame) {
    const std::lock_guard lock(mutex_);
    ++(result == CommandResult::done ? counters_.commands_done : counters_.commands_refused);
    send(CommandReport{command.sequence, command.function, command.camera, result, frame});
}

void PacketService::execute(const Telecommand& command) {
    switch (static_cast<CommandFunction>(command.function)) {
    case CommandFunction::no_operation:
    case CommandFunction::trigger:
        return;
    case CommandFunction::start:
        return commands_.start(command.camera);
    case CommandFunction::stop:
        return commands_.stop(command.camera);
    default:
        commands_.set(command.camera, std::string(command.feature),
                      command.word.empty() ? FeatureValue(command.number)
                                           : FeatureValue(std::string(command.word)));
    }
}

void PacketService::take(std::span<const std::uint8_t> datagram) {
    const std::optional<Telecommand> command = read_telecommand(datagram, first_apid_);
    if (!command) {
        count_command(&PacketCounters::commands_refused);
        return;
    }
    if (next_command_ && *next_command_ != command->sequence) count_command(&PacketCounters::command_gaps);
    next_command_ = static_cast<std::uint16_t>((command->sequence + 1U) % sequence_modulus);
    if (command->result != CommandResult::done) return report(*command, command->result);
    try {
        if (command->function != static_cast<std::uint8_t>(CommandFunction::trigger)) {
            execute(*command);
            return report(*command, CommandResult::done);
        }
        if (triggering_) return report(*command, CommandResult::not_now);
        commands_.begin_trigger(command->camera);
        triggering_ = command;
    } catch (const LinkError& error) {
        report(*command, result_of(error));
    }
}

void PacketService::take_commands() {
    std::array<std::uint8_t, max_packet_bytes> buffer;
    for (int i = 0; receiver_ && i < max_commands; ++i) {
        sockaddr_in from{};
        socklen_t from_bytes = sizeof from;
        const ssize_t got = ::recvfrom(receiver_.get(), buffer.data(), buffer.size(), MSG_TRUNC,
                                       reinterpret_cast<sockaddr*>(&from), &from_bytes);
        if (got < 0) return;
        if (!admission_.admits(ntohl(from.sin_addr.s_addr), "telecommand")) continue;
        commands_.set_peer(host_of(from));
        const auto size = static_cast<std::size_t>(got);
        take(size <= buffer.size() ? std::span<const std::uint8_t>(buffer).first(size)
                                   : std::span<const std::uint8_t>());
    }
}

void PacketService::settle_trigger() {
    if (!triggering_) return;
    try {
        const std::optional<TriggerResult> result = commands_.trigger_result(0);
        if (!result) return;
        report(*triggering_, result->outcome == "missed" ? CommandResult::no_frame : CommandResult::done,
               result->frame);
    } catch (const LinkError& error) {
        report(*triggering_, result_of(error));
    }
    triggering_.reset();
}

void PacketService::send_reports(std::uint32_t camera) {
    const TimingAnswer answer = link_.timing(camera, reports_[camera].after());
    const std::lock_guard lock(mutex_);
    tai_offset_ns_ = answer.tai_offset_ns ? *answer.tai_offset_ns : MonotonicClock().tai_offset_ns();
    for (const FrameReport& frame : reports_[camera].take(camera, answer, *tai_offset_ns_)) {
        ++counters_.reports;
        counters_.reports_lost += static_cast<std::uint32_t>(frame.lost_before);
        send(frame);
    }
}

void PacketService::look(bool housekeeping) {
    std::vector<std::optional<CameraState>> cameras;
    try {
        // The state takes the daemon a tenth of a second, time stamps nothing: they are asked for by
        // themselves while the connection to the same daemon lasts.
        if (housekeeping || !connected_) {
            connected_ = false;
            DaemonState state = link_.state();
            reports_.resize(state.cameras.size());
            if (run_ && state.run != *run_)
                for (FrameReports& camera : reports_)
                    camera.begin_anew();
            run_ = std::move(state.run);
            connected_ = true;
            std::move(state.cameras.begin(), state.cameras.end(), std::back_inserter(cameras));
        }
        for (std::uint32_t camera = 0; camera < reports_.size(); ++camera)
            send_reports(camera);
    } catch (const LinkError& error) {
        connected_ = false;
        // Whatever answers next has not been there before: its frames are wanted from the first one on.
        if (!run_ && error.code == "connection-lost") run_.emplace();
    }
    if (housekeeping) send_housekeeping(std::move(cameras));
}

void PacketService::send_housekeeping(std::vector<std::optional<CameraState>> cameras) {
    const std::lock_guard lock(mutex_);
    if (!cameras.empty()) cameras_ = cameras.size();
    cameras.resize(cameras_);
    for (std::uint32_t camera = 0; camera < cameras.size(); ++camera)
        send(Housekeeping{camera, std::move(cameras[camera]), counters_});
    housekeeping_sent_ = Steady::now();
}

void PacketService::serve_telemetry(const std::function<bool()>& stopped) {
    Steady::time_point next_report = Steady::now(), next_housekeeping = next_report;
    while (!stopped()) {
        std::this_thread::sleep_until(next_report);
        const bool housekeeping = Steady::now() >= next_housekeeping;
        look(housekeeping);
        const Steady::time_point now = Steady::now();
        if (housekeeping) next_housekeeping = std::max(next_housekeeping + housekeeping_period, now);
        next_report = std::max(next_report + report_period, now);
    }
}

void PacketService::serve_telecommands(const std::function<bool()>& stopped) {
    while (!stopped()) {
        pollfd watched{receiver_.get(), POLLIN, 0};
        ::poll(&watched, 1, poll_interval_ms);
        take_commands();
        settle_trigger();
    }
}

void PacketService::run(const std::function<bool()>& stopped) {
    std::vector<std::jthread> threads;
    if (sender_) threads.emplace_back([&] { serve_telemetry(stopped); });
    if (receiver_) threads.emplace_back([&] { serve_telecommands(stopped); });
    while (!stopped()) {
        std::this_thread::sleep_for(report_period);
        if (!sender_) continue;
        std::unique_lock lock(mutex_);
        const Steady::time_point now = Steady::now();
        const bool silent = now - housekeeping_sent_ > max_silence;
        lock.unlock();
        if (!silent) continue;
        send_housekeeping({});
        // The next one comes after the usual period, unless the daemon answers before.
        lock.lock();
        housekeeping_sent_ = now - max_silence + housekeeping_period;
    }
}

} // namespace obscura::instrument
