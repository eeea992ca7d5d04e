// SPDX-License-Identifier: Apache-2.0
#include "emulator/simulator/simulator_server.hpp"

#include "core/clock.hpp"
#include "core/error.hpp"
#include "core/realtime/log.hpp"
#include "core/realtime/realtime.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "sync/inputs/ipv4_endpoint.hpp"

#include <fmt/format.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <utility>

namespace obscura::emulator {
namespace {

constexpr std::size_t max_clients = 8;
constexpr std::size_t max_input = 16 * simulator_line_bytes; // input buffered while a step is in progress
constexpr std::int64_t step_timeout_ns = 60 * ns_per_s;      // longest wait for one frame
constexpr std::int64_t ready_timeout_ns = 15 * ns_per_s;     // longest wait for a busy camera
/// So often a step sees whether it has been given up, and whether settings keep the camera from being ready.
constexpr std::int64_t step_check_interval_ns = 100 * ns_per_ms;

/// Longest time without a proof: the places of clients are few.
constexpr std::chrono::seconds admission_time{5};

std::string explain_unknown_name(std::string_view wanted, const PoseRings& rings) {
    std::vector<std::string_view> names;
    for (const auto& [name, unused] : rings)
        names.push_back(name);
    return fmt::format("pose: nothing in the scene is called \"{}\", {}", printable(wanted, 60),
                       allowed_words(wanted, names));
}

/// About the last frame, for the end of an answer.
std::string quality_words(const QualityCounters& q) {
    return fmt::format("level={} error={:.5f} rows_degraded={} reasons={} margin_us={}",
                       name_of(q.last_level), q.last_error, q.last_rows_degraded, q.last_reasons,
                       q.last_margin_us);
}

} // namespace

PoseRings attach_pose_rings(scene::Scene& scene, double max_extrapolation_s) {
    PoseRings rings;
    const auto attach = [&](const std::string& name, scene::Motion& motion) {
        if (name.empty() || rings.contains(name)) return;
        auto ring = std::make_shared<PoseRing>(max_extrapolation_s);
        motion.live = ring;
        rings.emplace(name, std::move(ring));
    };
    attach(std::string(scene::camera_name), scene.camera.motion);
    for (scene::Body& body : scene.bodies)
        attach(body.name, body.motion);
    for (scene::Lamp& lamp : scene.lamps)
        attach(lamp.name, lamp.motion);
    return rings;
}

SimulatorServer::SimulatorServer(std::string listen, PoseRings rings, Camera& camera, const Clock& clock,
                                 const RenderScheduling& render, const std::optional<service::Token>& token)
    : listen_(std::move(listen)),
      rings_(std::move(rings)),
      camera_(camera),
      clock_(clock),
      scheduling_(render) {
    if (scheduling_.has_priority()) ++scheduling_.priority;
    if (token) tokens_.add(service::Permission::scene, *token);
}

SimulatorServer::~SimulatorServer() {
    stop();
}

void SimulatorServer::start() {
    sockaddr_in address = sync::parse_ipv4_endpoint("simulator.listen", listen_, 0, "127.0.0.1:5003");
    const auto fail = [this] {
        throw HardwareError(fmt::format("simulator.listen: {}: {}", listen_, std::strerror(errno)));
    };
    try {
        // The configuration says which addresses it may have without a token.
        acceptor_.emplace(service::Listener::tcp(listen_, true));
    } catch (const Error& error) {
        throw HardwareError(fmt::format("simulator.listen: {}", error.what()));
    }
    port_ = service::port_of(acceptor_->listener());
    address.sin_port = htons(port_);
    // A datagram cannot prove who sends it.
    if (tokens_.empty()) {
        udp_ = FileDescriptor(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
        if (!udp_ || ::bind(udp_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
            fail();
    }
    wake_ = FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
    if (!wake_) fail();
    stopping_ = false;
    line_step_.stopping = false;
    step_thread_ = std::thread([this] { run_steps(); });
    thread_ = std::thread([this] { work(); });
}

void SimulatorServer::stop() {
    if (!thread_.joinable()) return;
    stopping_ = true;
    wake();
    thread_.join();
    cancel_step();
    {
        const std::lock_guard lock(line_step_.mutex);
        line_step_.stopping = true;
    }
    line_step_.changed.notify_all();
    step_thread_.join();
    heartbeat_.rest();
    clients_.clear();
    acceptor_.reset();
    for (FileDescriptor* fd : {&udp_, &wake_})
        *fd = FileDescriptor();
}

void SimulatorServer::wake() const {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t written = ::write(wake_.get(), &one, sizeof one);
}

std::string SimulatorServer::pose(const PoseLine& pose) {
    std::string why = take_pose(pose);
    if (!why.empty()) refused_.fetch_add(1);
    return why;
}

SimulatorServer::StepResult SimulatorServer::step(Time scene, Time& last,
                                                  const std::atomic<bool>& cancelled) {
    StepResult result;
    result.refusal = claim_step(scene, last);
    if (result.refusal.empty()) result = make_step(scene, cancelled);
    if (!result.refusal.empty()) refused_.fetch_add(1);
    return result;
}

void SimulatorServer::step_with(sync::SoftwareTrigger* source) {
    source_ = source;
    // Wait until the thread of a step has finished firing the old source.
    while (firing_)
        std::this_thread::yield();
}

SimulatorCounters SimulatorServer::counters() const noexcept {
    return {connections_.load(), poses_.load(), steps_.load(), refused_.load()};
}

void SimulatorServer::work() {
    name_this_thread(heartbeat_.name().c_str());
    if (scheduling_.has_priority()) schedule_this_thread(scheduling_);
    while (!stopping_) {
        heartbeat_.beat();
        std::vector<pollfd> watched{{wake_.get(), POLLIN, 0},
                                    {acceptor_->polled(service::Acceptor::Clock::now()), POLLIN, 0},
                                    {udp_.get(), POLLIN, 0}};
        for (const auto& client : clients_) {
            // Stop reading from a client whose input buffer is full.
            const bool full = client->input.size() >= max_input;
            watched.push_back({client->fd.get(), static_cast<short>(full ? 0 : POLLIN), 0});
        }
        const timespec limit{0, Heartbeat::max_wait_ns};
        if (::ppoll(watched.data(), watched.size(), &limit, nullptr) < 0 && errno != EINTR) break;
        std::uint64_t wakes = 0;
        if (watched[0].revents != 0 && ::read(wake_.get(), &wakes, sizeof wakes) < 0) wakes = 0;
        if (watched[2].revents != 0) receive_datagrams();
        for (std::size_t i = 0; i < clients_.size(); ++i)
            if (watched[3 + i].revents != 0) receive(*clients_[i]);
        if (watched[1].revents != 0)
            acceptor_->accept(
                service::Acceptor::Clock::now(), [this] { return has_place(); },
                [this](FileDescriptor fd) { add_client(std::move(fd)); });
        answer_step();
        for (const auto& client : clients_) {
            admit(*client);
            handle_lines(*client);
        }
        std::erase_if(clients_, [this](const std::unique_ptr<Client>& client) {
            if (client->gone && step_client_ == client.get()) cancel_step();
            return client->gone;
        });
    }
}

bool SimulatorServer::has_place() {
    if (clients_.size() < max_clients) return true;
    refused_.fetch_add(1);
    return false;
}

void SimulatorServer::add_client(FileDescriptor fd) {
    connections_.fetch_add(1);
    clients_.push_back(std::make_unique<Client>());
    clients_.back()->peer = service::address_of_peer(fd.get());
    clients_.back()->fd = std::move(fd);
    std::string greeting = "obscura simulator 1";
    if (!tokens_.empty()) {
        clients_.back()->challenge = service::make_challenge();
        clients_.back()->admit_by = service::Tokens::Clock::now() + admission_time;
        greeting += " challenge=" + clients_.back()->challenge;
    }
    answer(*clients_.back(), greeting);
}

void SimulatorServer::receive(Client& client) {
    std::array<char, 4096> bytes;
    const ssize_t n = ::recv(client.fd.get(), bytes.data(), bytes.size(), 0);
    if (n > 0)
        client.input.append(bytes.data(), static_cast<std::size_t>(n));
    else if (n == 0 || (errno != EAGAIN && errno != EINTR))
        client.gone = true;
}

void SimulatorServer::receive_datagrams() {
    // Read a bounded number at a time, so that a flood does not block other clients.
    for (int i = 0; i < 64; ++i) {
        std::array<char, 65536> bytes;
        const ssize_t n = ::recv(udp_.get(), bytes.data(), bytes.size(), 0);
        if (n < 0) return;
        heartbeat_.beat(); // datagrams full of refused lines take their time
        std::string_view rest(bytes.data(), static_cast<std::size_t>(n));
        while (!rest.empty()) {
            const std::size_t end = std::min(rest.find('\n'), rest.size());
            const SimulatorLine line = parse_simulator_line(rest.substr(0, end));
            rest.remove_prefix(std::min(end + 1, rest.size()));
            const auto* pose = std::get_if<PoseLine>(&line);
            const auto* bad = std::get_if<BadLine>(&line);
            const std::string why = pose != nullptr  ? take_pose(*pose)
                                    : bad != nullptr ? bad->why
                                                     : "only poses come by UDP";
            if (why.empty()) continue;
            refused_.fetch_add(1);
            if (!std::exchange(bad_datagram_reported_, true))
                log_warning("simulator: datagram refused: {}; further ones are only counted", why);
        }
    }
}

void SimulatorServer::handle_lines(Client& client) {
    while (!client.gone && step_client_ != &client && client.proof.empty()) {
        const std::size_t end = client.input.find('\n');
        if (end == std::string::npos) {
            if (client.input.size() > simulator_line_bytes) {
                refuse(client, fmt::format("a line has at most {} bytes", simulator_line_bytes));
                client.gone = true;
            }
            return;
        }
        std::string line = client.input.substr(0, end);
        client.input.erase(0, end + 1);
        if (!line.empty() && line.back() == '\r') line.pop_back();
        if (!line.empty()) handle(client, line);
    }
}

void SimulatorServer::handle(Client& client, std::string_view text) {
    const SimulatorLine line = parse_simulator_line(text);
    if (!client.challenge.empty()) return take_proof(client, line);
    if (const auto* pose = std::get_if<PoseLine>(&line)) {
        if (const std::string why = take_pose(*pose); !why.empty()) refuse(client, why);
    } else if (const auto* step = std::get_if<StepLine>(&line)) {
        begin_step(client, step->time);
    } else if (std::holds_alternative<StateLine>(line)) {
        answer(client, state_line());
    } else if (std::holds_alternative<TokenLine>(line)) {
        refuse(client, "token: none is wanted");
    } else {
        refuse(client, std::get<BadLine>(line).why);
    }
}

void SimulatorServer::take_proof(Client& client, const SimulatorLine& line) {
    if (const auto* const token = std::get_if<TokenLine>(&line)) {
        client.proof = token->proof;
        const auto now = service::Tokens::Clock::now();
        client.proof_due = now + tokens_.delay(client.peer, now);
        return admit(client);
    }
    refuse(client, "token: the first line is \"token PROOF\"");
    client.gone = true;
}

void SimulatorServer::admit(Client& client) {
    if (client.challenge.empty() || client.gone) return;
    const auto now = service::Tokens::Clock::now();
    if (client.proof.empty()) {
        client.gone = now > client.admit_by;
        return;
    }
    if (now < client.proof_due) return;
    if (tokens_.permission_of(client.challenge, std::exchange(client.proof, {}), client.peer, now)) {
        client.challenge.clear();
        answer(client, "welcome");
    } else {
        refuse(client, "token: not the one of this camera");
        client.gone = true;
    }
}

std::string SimulatorServer::take_pose(const PoseLine& line) {
    const auto ring = rings_.find(line.name);
    if (ring == rings_.end()) return explain_unknown_name(line.name, rings_);
    const std::lock_guard lock(pushing_);
    if (!ring->second->push(to_seconds(line.time.ns), line.pose, line.rates))
        return "pose: TIME: not later than the pose before";
    poses_.fetch_add(1);
    return {};
}

void SimulatorServer::begin_step(Client& client, Time scene) {
    if (const std::string why = claim_step(scene, client.last_step); !why.empty()) return refuse(client, why);
    step_client_ = &client;
    step_scene_ = scene;
    {
        const std::lock_guard lock(line_step_.mutex);
        line_step_.wanted = scene;
        line_step_.cancelled = false;
    }
    line_step_.changed.notify_all();
}

void SimulatorServer::answer_step() {
    if (step_client_ == nullptr) return;
    std::optional<StepResult> done;
    {
        const std::lock_guard lock(line_step_.mutex);
        done.swap(line_step_.done);
    }
    if (!done) return;
    Client& client = *std::exchange(step_client_, nullptr);
    if (!done->refusal.empty()) return refuse(client, done->refusal);
    answer(client,
           fmt::format("frame {} {} {} {} {}", done->frame.frame_id, seconds_text(step_scene_),
                       name_of(done->frame.outcome), done->frame.late_rows, quality_words(done->quality)));
}

void SimulatorServer::cancel_step() {
    if (step_client_ == nullptr) return;
    step_client_ = nullptr;
    line_step_.cancelled = true;
    camera_.outcomes().wake_all();
    camera_.moments_changed().notify();
    // Wait for its end, so that another client's step is not refused for it.
    std::unique_lock lock(line_step_.mutex);
    line_step_.changed.wait(lock, [this] { return line_step_.done.has_value(); });
    line_step_.done.reset();
}

void SimulatorServer::run_steps() {
    name_this_thread("simulator-step");
    if (scheduling_.has_priority()) schedule_this_thread(scheduling_);
    std::unique_lock lock(line_step_.mutex);
    for (;;) {
        line_step_.changed.wait(lock, [this] { return line_step_.stopping || line_step_.wanted; });
        if (line_step_.stopping) return;
        const Time scene = *std::exchange(line_step_.wanted, std::nullopt);
        lock.unlock();
        StepResult result = make_step(scene, line_step_.cancelled);
        lock.lock();
        line_step_.done = std::move(result);
        line_step_.changed.notify_all();
        wake();
    }
}

std::string SimulatorServer::claim_step(Time scene, Time& last) {
    if (source_.load() == nullptr) return "step: trigger.source is not \"lockstep\"";
    if (!camera_.acquiring()) return "step: the camera does not acquire";
    if (step_claimed_.exchange(true)) return "step: another client's step is in progress";
    if (scene > last) {
        last = scene;
        return {};
    }
    step_claimed_ = false;
    return "step: TIME: not later than the step before";
}

SimulatorServer::StepResult SimulatorServer::make_step(Time scene, const std::atomic<bool>& cancelled) {
    StepResult result;
    OutcomeRing& outcomes = camera_.outcomes();
    OutcomeRing::Request request = outcomes.request();
    result.refusal = fire_step(scene, request.number, cancelled);
    const Time give_up = clock_.now() + step_timeout_ns;
    std::optional<OutcomeRecord> record;
    while (result.refusal.empty() && !record) {
        const Time now = clock_.now();
        record = outcomes.wait(request, std::min(give_up, now + step_check_interval_ns));
        if (!record && stopping_) result.refusal = "the daemon is stopping";
        if (!record && (now > give_up || cancelled)) result.refusal = "step: the frame does not come";
    }
    if (record) {
        steps_.fetch_add(1);
        result.frame = *record;
        if (record->outcome == FrameOutcome::missed) result.frame.frame_id = camera_.moments().frame_id;
        result.quality = camera_.counters().quality;
    }
    step_claimed_ = false;
    return result;
}

std::string SimulatorServer::fire_step(Time scene, std::uint64_t request,
                                       const std::atomic<bool>& cancelled) {
    const Time ready_by = clock_.now() + ready_timeout_ns;
    for (;;) {
        const std::uint32_t seen = camera_.moments_changed().value();
        const Time now = clock_.now();
        if (camera_.ready_for_line0(now)) break;
        if (!camera_.acquiring()) return "step: the camera does not acquire";
        if (stopping_) return "the daemon is stopping";
        if (now > ready_by || cancelled) return "step: the camera is not ready or listens to another source";
        const CameraMoments moments = camera_.moments();
        Time until = now + step_check_interval_ns;
        if (moments.ready && moments.not_before > now) until = std::min(until, moments.not_before);
        camera_.moments_changed().wait(seen, until);
    }
    firing_ = true;
    sync::SoftwareTrigger* const source = source_.load();
    const bool fired = source != nullptr && source->fire(clock_.now(), scene, request);
    firing_ = false;
    return fired ? std::string() : "step: trigger.source is not \"lockstep\" any more";
}

std::string SimulatorServer::state_line() const {
    const CameraCounters c = camera_.counters();
    return fmt::format("state acquiring={} ready={} lockstep={} frames={} missed={} degraded={} failed={} {}",
                       camera_.acquiring() ? 1 : 0, camera_.ready_for_line0(clock_.now()) ? 1 : 0,
                       source_.load() != nullptr ? 1 : 0, c.frames, c.missed_triggers, c.quality.degraded,
                       c.quality.failed, quality_words(c.quality));
}

void SimulatorServer::answer(Client& client, const std::string& line) {
    const std::string text = line + "\n";
    const ssize_t sent = ::send(client.fd.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent != static_cast<ssize_t>(text.size())) client.gone = true;
}

void SimulatorServer::refuse(Client& client, const std::string& why) {
    refused_.fetch_add(1);
    answer(client, "error " + why);
}

} // namespace obscura::emulator
