// SPDX-License-Identifier: Apache-2.0
// Jobs about the daemon behind a camera: its GigE Vision features, logging, control, support bundle.
#include "core/error.hpp"
#include "host/support_bundle.hpp"
#include "web/api/camera_jobs.hpp"
#include "web/server/problem.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <string>
#include <utility>

#ifndef OBSCURA_VERSION
#error "OBSCURA_VERSION comes from the build"
#endif

namespace obscura::web {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

} // namespace

Response CameraJobs::set_device(const State& state) {
    const Json& body = state.request.body;
    if (body.size() != 1)
        return problem(422, "value",
                       "the name of one feature and its new value are wanted; true runs a command");
    const auto wanted = body.begin();
    ask(state, "device.set", {{"name", wanted.key()}, {"value", wanted.value()}});
    note(state, nullptr, body);
    return json_answer({{"written", wanted.key()}});
}

Response CameraJobs::set_log_level(const State& state) {
    const Json answer = calls_.call(state.request.place, "log_level", state.request.body).head;
    note(state, answer.at("before"), answer.at("level"));
    return json_answer(answer);
}

Response CameraJobs::release(const State& state) {
    const Json answer = ask(state, "release");
    note(state, answer.at("controller"), nullptr);
    return json_answer(answer);
}

std::optional<Response> CameraJobs::self_test(State& state) {
    auto answered = answer(state, 60s);
    if (!answered) return std::nullopt;
    answered->head.erase("text");
    return json_answer(answered->head);
}

Response CameraJobs::support_bundle(const State& state) {
    const std::time_t now = std::time(nullptr);
    const std::string stem =
        fmt::format("obscura-support-{}-{:%Y%m%dT%H%M%SZ}", state.request.place.id, fmt::gmtime(now));
    host::TarArchive archive(stem, now);
    host::SupportBundle bundle(archive);
    host::add_machine(bundle, OBSCURA_VERSION);
    const auto ask_daemon = [&](const std::string& call, const host::CallJson& fields) {
        try {
            return calls_.call(state.request.place, call, fields).head;
        } catch (const Refusal& refusal) {
            throw HardwareError(refusal.what());
        }
    };
    (void)host::add_daemon(bundle, ask_daemon, true);
    host::add_self_test(bundle, [&ask_daemon] {
        return ask_daemon("self_test", host::CallJson::object()).at("text").get<std::string>();
    });
    bundle.finish();
    Response response;
    response.type = state.request.route->type;
    response.headers.emplace_back("Content-Disposition",
                                  fmt::format("attachment; filename=\"{}.tar.zst\"", stem));
    response.body = archive.packed();
    return response;
}

} // namespace obscura::web
