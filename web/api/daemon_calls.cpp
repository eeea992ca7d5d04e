// SPDX-License-Identifier: Apache-2.0
#include "web/api/daemon_calls.hpp"

#include "core/error.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace obscura::web {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t max_stored = 4;
constexpr std::chrono::milliseconds poll_interval = 5ms, silence_timeout = 2s;
constexpr std::uint64_t max_array_bytes = 1ULL << 26; ///< a frame of 33 million pixels

/// What a refusal of a daemon is in HTTP.
Refusal refusal_of(const host::CallRefused& error) {
    struct Row {
        std::string_view code;
        unsigned status;
        std::string_view type;
    };
    static constexpr std::array rows{
        Row{"controlled", 409, "controlled"}, Row{"not-now", 409, "not-now"},
        Row{"bad-argument", 422, "value"},    Row{"bad-scene", 422, "scene"},
        Row{"too-large", 422, "value"},       Row{"forbidden", 403, "permission"},
        Row{"unknown-call", 503, "no-call"},  Row{"busy", 503, "busy"},
    };
    const auto found =
        std::find_if(rows.begin(), rows.end(), [&](const Row& row) { return row.code == error.code; });
    std::string detail = error.what();
    if (!error.hint.empty()) detail += fmt::format(" ({})", error.hint);
    return found == rows.end() ? Refusal(503, "daemon", detail, error.field)
                               : Refusal(found->status, found->type, detail, error.field);
}

/// Refusal of a request that has been sent.
Refusal lost_answer(std::string_view why) {
    Refusal refusal(503, "answer-lost", why);
    refusal.response.may_have_acted = true;
    return refusal;
}

} // namespace

std::string camera_id(const Sighting& sighting, std::string_view camera) {
    const bool is_number =
        !camera.empty() && camera.size() < 4 &&
        std::all_of(camera.begin(), camera.end(), [](char c) { return c >= '0' && c <= '9'; });
    if (!is_number || sighting.states.empty()) return std::string(camera);
    if (sighting.states.size() > 1)
        throw Refusal(422, "value",
                      "several daemons run here: a camera's id is wanted, as /api/v1/cameras has it");
    return fmt::format("{}-{}", run_of(sighting.states.front()).pid, camera);
}

CameraPlace find_camera(const Sighting& sighting, std::string_view id) {
    std::string ids;
    for (const auto& state : sighting.states) {
        const auto& daemon = state.at("daemon");
        std::uint32_t number = 0;
        for (const auto& camera : state.at("cameras")) {
            const auto own = camera.value("id", std::string());
            if (own == id) {
                const auto control = daemon.value("control", std::string());
                if (control.empty())
                    throw Refusal(503, "no-control",
                                  "this daemon takes no calls: its configuration has no [control]");
                return {own, run_of(state), number, control, camera.value("controller", std::string())};
            }
            ids += fmt::format("{}{}", ids.empty() ? "" : ", ", own);
            ++number;
        }
    }
    if (ids.empty()) throw Refusal(503, "no-daemon", sighting.error);
    throw Refusal(404, "no-such-camera", fmt::format("the cameras are: {}", ids));
}

std::unique_ptr<host::CallClient> DaemonCalls::take(const CameraPlace& place) {
    {
        const std::lock_guard lock(mutex_);
        const auto now = Clock::now();
        std::erase_if(silent_, [now](const auto& row) { return row.second <= now; });
        if (silent_.contains(place.daemon))
            throw Refusal(503, "no-answer", fmt::format("{}: the daemon does not answer", place.control));
        // What was connected to an earlier run of the daemon has no other end.
        std::erase_if(kept_, [&](const Kept& kept) {
            return kept.daemon.pid == place.daemon.pid && kept.daemon != place.daemon;
        });
        const auto found = std::find_if(kept_.begin(), kept_.end(),
                                        [&](const Kept& kept) { return kept.daemon == place.daemon; });
        if (found != kept_.end()) {
            auto client = std::move(found->client);
            kept_.erase(found);
            return client;
        }
    }
    host::CallClient::Options options;
    options.connect_timeout_s = std::chrono::duration<double>(silence_timeout).count();
    options.max_array_bytes = max_array_bytes;
    try {
        return std::make_unique<host::CallClient>(place.control, options);
    } catch (const HardwareError& error) {
        note_silent(place);
        throw Refusal(503, "no-answer", error.what());
    } catch (const host::CallRefused& error) {
        throw refusal_of(error);
    }
}

void DaemonCalls::note_silent(const CameraPlace& place) {
    const std::lock_guard lock(mutex_);
    silent_[place.daemon] = Clock::now() + silence_timeout;
}

void DaemonCalls::keep(Running& running) {
    const std::lock_guard lock(mutex_);
    if (kept_.size() >= max_stored) kept_.erase(kept_.begin());
    kept_.push_back({running.place.daemon, std::move(running.client)});
}

DaemonCalls::Running DaemonCalls::begin(const CameraPlace& place, const std::string& name, const Json& fields,
                                        std::chrono::milliseconds timeout) {
    Running running{place, take(place), Clock::now(), Clock::now() + timeout};
    try {
        running.client->begin(name, fields);
    } catch (const HardwareError& error) {
        throw Refusal(503, "no-answer", error.what());
    } catch (const host::CallRefused& error) {
        throw refusal_of(error);
    }
    return running;
}

std::optional<DaemonCalls::Answer> DaemonCalls::look(Running& running) {
    return wait(running, poll_interval);
}

std::optional<DaemonCalls::Answer> DaemonCalls::wait(Running& running, std::chrono::milliseconds longest) {
    try {
        std::optional<Answer> answer = running.client->wait(std::chrono::duration<double>(longest).count());
        if (answer) {
            keep(running);
        } else if (Clock::now() >= running.deadline) {
            note_silent(running.place);
            throw lost_answer(fmt::format("{}: the daemon does not answer", running.place.control));
        }
        return answer;
    } catch (const HardwareError& error) {
        throw lost_answer(error.what());
    } catch (const host::CallRefused& error) {
        keep(running);
        throw refusal_of(error);
    }
}

DaemonCalls::Answer DaemonCalls::call(const CameraPlace& place, const std::string& name, const Json& fields) {
    Running running = begin(place, name, fields, answer_timeout);
    while (true)
        if (std::optional<Answer> answer = wait(running, answer_timeout)) return *std::move(answer);
}

} // namespace obscura::web
