// SPDX-License-Identifier: Apache-2.0
#include "web/api/camera_jobs.hpp"

#include "core/error.hpp"
#include "core/text/suggestion.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::web {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

constexpr auto trigger_timeout = 10s, scene_timeout = 60s, frame_timeout = 5s;
constexpr auto probe_timeout = 60s;  ///< the first one loads the scene
constexpr auto change_timeout = 60s; ///< a scene may be built, a frame rendered
constexpr auto irradiance_timeout = 600s, configuration_timeout = 60s;
constexpr double frame_wait_s = 5; ///< without ?wait

/// The answer to the call `frame`. Throws Refusal if it has no pixels.
std::shared_ptr<const KeptFrame> answered_frame(const CameraId& camera,
                                                const host::CallClient::Answer& answer) {
    const auto shape = answer.shape("pixels");
    const auto pixels = answer.numbers("pixels");
    if (shape.size() != 2 || pixels.size() != shape[0] * shape[1])
        throw Refusal(503, "daemon", "the daemon's frame has no pixels");
    auto kept = std::make_shared<KeptFrame>();
    kept->camera = camera;
    kept->head = answer.head;
    kept->number = kept->head.value("number", std::uint64_t{0});
    kept->width = shape[1];
    kept->height = shape[0];
    kept->pixels.assign(pixels.begin(), pixels.end());
    return kept;
}

/// As strings, whatever their size: clients find one type.
void make_strings(Json& json, std::initializer_list<const char*> names) {
    for (const char* name : names)
        if (json.contains(name) && json[name].is_number_integer())
            json[name] = std::to_string(json[name].get<std::int64_t>());
}

/// Tag of settings, in whatever order they come.
std::string settings_tag(const nlohmann::json& values) {
    return tag_of(Json(values));
}

/// The view that a query asks for.
View view_of(const Json& query) {
    View view;
    view.x = query.value("x", view.x);
    view.y = query.value("y", view.y);
    view.width = query.value("w", view.width);
    view.height = query.value("h", view.height);
    view.bin = query.value("bin", view.bin);
    view.reduce = enum_named<Reduce>(query.value("reduce", std::string())).value_or(view.reduce);
    return view;
}

/// A row of settings with who or what keeps it from being changed.
void add_access(Json& row, const std::string& controller) {
    row["access"] = "rw";
    row["locked_by"] = nullptr;
    if (!controller.empty())
        row["locked_by"] = "controlled by " + controller;
    else if (row.value("locked", false))
        row["locked_by"] = row.value("why", std::string("locked"));
}

/// The row of a setting. Throws Refusal (404) with the nearest name.
Json& row_of(Json& answer, const std::string& name) {
    std::vector<std::string> names;
    for (Json& row : answer.at("features")) {
        if (row.at("name") == name) return row;
        names.push_back(row.at("name").get<std::string>());
    }
    throw Refusal(404, "no-such-feature",
                  fmt::format("no setting \"{}\", {}", name.substr(0, 60),
                              suggestion(name.substr(0, 60), {names.begin(), names.end()})));
}

/// Rules without what changes by itself.
Json plain_rules(Json rules) {
    for (Json& rule : rules)
        if (rule.is_object()) rule.erase("struck");
    return rules;
}

/// Fields of a request with the sizes of texts that are no lines.
Json without_long_texts(Json fields) {
    constexpr std::size_t max_bytes = 200;
    for (Json& field : fields)
        if (field.is_string() && field.get_ref<const std::string&>().size() > max_bytes)
            field = fmt::format("{} bytes", field.get_ref<const std::string&>().size());
    return fields;
}

} // namespace

void make_exact(Json& json) {
    constexpr std::int64_t most = 1LL << 53;
    if (json.is_number_unsigned()) {
        if (json.get<std::uint64_t>() > static_cast<std::uint64_t>(most))
            json = std::to_string(json.get<std::uint64_t>());
    } else if (json.is_number_integer()) {
        const auto value = json.get<std::int64_t>();
        if (value > most || value < -most) json = std::to_string(value);
    } else if (json.is_structured()) {
        for (Json& element : json)
            make_exact(element);
    }
}

Job CameraJobs::job(CameraRequest request) {
    const auto state = std::make_shared<State>(State{std::move(request)});
    Job job;
    const Answers answers = state->request.route->answers;
    const bool frames = answers == Answers::frame_json || answers == Answers::frame_png ||
                        answers == Answers::frame_fits || answers == Answers::frame_raw ||
                        answers == Answers::frame_jpeg || answers == Answers::frame;
    job.queue = frames ? Job::Queue::frames : Job::Queue::calls;
    if (const DaemonRun& daemon = state->request.place.daemon; daemon.pid != 0)
        // Nothing waits for a frame that is rendered again.
        job.lane = fmt::format("{} {}{}", daemon.pid, daemon.started,
                               answers == Answers::frame_exr ? " irradiance" : "");
    job.step = [this, state]() -> std::optional<Response> {
        try {
            return step(*state);
        } catch (const Refusal& refusal) {
            return refusal.response;
        } catch (const std::exception& error) { // the daemon's answer lacks what it must have
            Response response = problem(503, "daemon", error.what());
            response.may_have_acted = true;
            return response;
        }
    };
    return job;
}

std::optional<Response> CameraJobs::step(State& state) {
    switch (state.request.route->answers) {
    case Answers::call:
        return call(state);
    case Answers::features:
        return features(state);
    case Answers::set_features:
        return set_features(state);
    case Answers::feature:
        return feature(state);
    case Answers::set_feature:
        return set_feature(state);
    case Answers::trigger:
        return trigger(state);
    case Answers::acquisition:
        return acquisition(state);
    case Answers::faults:
        return faults(state);
    case Answers::set_faults:
        return set_faults(state);
    case Answers::probe:
        return probe(state);
    case Answers::scenes:
        return scenes(state);
    case Answers::show_scene:
        return show_scene(state);
    case Answers::set_device:
        return set_device(state);
    case Answers::set_log_level:
        return set_log_level(state);
    case Answers::release:
        return release(state);
    case Answers::self_test:
        return self_test(state);
    case Answers::support_bundle:
        return support_bundle(state);
    case Answers::configuration:
        return configuration(state);
    case Answers::set_configuration:
        return set_configuration(state);
    case Answers::frame_png:
    case Answers::frame_fits:
    case Answers::frame_raw:
    case Answers::frame_jpeg:
    case Answers::frame_json:
    case Answers::frame:
        return state.request.frame ? frame_of_path(state) : frame(state);
    case Answers::frame_exr:
        return irradiance(state);
    default:
        return problem(503, "daemon", "nothing answers this");
    }
}

Json CameraJobs::ask(const State& state, const char* call, Json fields) {
    fields["camera"] = state.request.place.number;
    return calls_.call(state.request.place, call, fields).head;
}

std::optional<DaemonCalls::Answer> CameraJobs::answer(State& state, std::chrono::milliseconds timeout) {
    const CameraRequest& request = state.request;
    if (!state.running) {
        const CallRow& row = *request.route->call;
        Json fields = request.route->changes() ? request.body : request.query;
        for (const Parameter& field : row.fields) // the daemon waits, too
            if (field.name == "wait_s")
                timeout += std::chrono::milliseconds(static_cast<std::int64_t>(
                    1e3 * fields.value("wait_s", Json::parse(field.initial).get<double>())));
        fields.erase("camera"); // of the query: whose daemon is meant
        if (row.has_camera) fields["camera"] = request.place.number;
        state.running = calls_.begin(request.place, std::string(row.name), fields, timeout);
    }
    return calls_.look(*state.running);
}

std::optional<Response> CameraJobs::call(State& state) {
    const bool changes = state.request.route->changes();
    auto answered = answer(state, changes ? change_timeout : DaemonCalls::answer_timeout);
    if (!answered) return std::nullopt;
    // What a viewer may do has changed nothing.
    if (changes && state.request.route->role != Role::viewer)
        note(state, nullptr, without_long_texts(state.request.body));
    make_exact(answered->head);
    return json_answer(answered->head);
}

void CameraJobs::note(const State& state, Json before, Json after, bool forced) {
    const CameraRequest& request = state.request;
    audit_.note({request.who, request.peer, std::string(request.route->id), request.place.id,
                 std::move(before), std::move(after), forced});
}

void CameraJobs::check_tag(const State& state, const std::string& tag) {
    if (!state.request.if_match.empty() && !names_tag(state.request.if_match, tag))
        throw Refusal(412, "changed",
                      "it has changed since it was read: If-Match names another tag than " + tag);
}

Response CameraJobs::features(const State& state) {
    Json answer = ask(state, "camera.features");
    nlohmann::json values;
    for (Json& row : answer.at("features")) {
        values[row.at("name").get<std::string>()] = row.at("value");
        add_access(row, state.request.place.controller);
    }
    make_exact(answer);
    Response response = json_answer(answer);
    response.headers.emplace_back("ETag", settings_tag(values));
    return response;
}

Response CameraJobs::feature(const State& state) {
    Json answer = ask(state, "camera.features");
    Json& row = row_of(answer, state.request.feature);
    const std::string tag = tag_of(row.at("value"));
    add_access(row, state.request.place.controller);
    make_exact(row);
    Response response = json_answer(row);
    response.headers.emplace_back("ETag", tag);
    return response;
}

Response CameraJobs::set_feature(const State& state) {
    Json answer = ask(state, "camera.features");
    check_tag(state, tag_of(row_of(answer, state.request.feature).at("value")));
    nlohmann::json values;
    for (const Json& row : answer.at("features"))
        values[row.at("name").get<std::string>()] = row.at("value");
    return change(state, {{state.request.feature, state.request.body.at("value")}}, values);
}

Response CameraJobs::set_features(const State& state) {
    nlohmann::json values = ask(state, "camera.get").at("values");
    check_tag(state, settings_tag(values));
    return change(state, state.request.body, values);
}

Response CameraJobs::change(const State& state, Json wanted, nlohmann::json& values) {
    const bool force = state.request.query.value("force", false);
    Json fields{{"values", std::move(wanted)}};
    if (force) fields["force"] = true;
    Json changed = ask(state, "camera.set", std::move(fields)).at("changed");
    Json before = Json::object();
    for (const auto& [name, value] : changed.items()) {
        before[name] = values[name];
        values[name] = value;
    }
    if (!changed.empty()) note(state, std::move(before), changed, force);
    make_exact(changed);
    Response response = json_answer({{"changed", std::move(changed)}});
    // Tag of the resource: of all settings, or of the one.
    response.headers.emplace_back("ETag", state.request.feature.empty()
                                              ? settings_tag(values)
                                              : tag_of(Json(values[state.request.feature])));
    return response;
}

Response CameraJobs::acquisition(const State& state) {
    const bool running = state.request.body.at("running").get<bool>();
    const Json answer = ask(state, running ? "camera.start" : "camera.stop");
    const bool changed = answer.value(running ? "started" : "stopped", false);
    if (changed) note(state, !running, running);
    return json_answer({{"running", running}, {"changed", changed}});
}

Response CameraJobs::faults(const State& state) {
    Json answer = ask(state, "faults.list");
    const std::string tag = tag_of(plain_rules(answer.at("rules")));
    make_exact(answer);
    Response response = json_answer(answer);
    response.headers.emplace_back("ETag", tag);
    return response;
}

Response CameraJobs::set_faults(const State& state) {
    Json before = plain_rules(ask(state, "faults.list").at("rules"));
    check_tag(state, tag_of(before));
    ask(state, "faults.set", {{"rules", plain_rules(state.request.body.at("rules"))}});
    Response response = faults(state);
    note(state, std::move(before), plain_rules(Json::parse(response.body).at("rules")));
    return response;
}

Response CameraJobs::scenes(const State& state) {
    const Json answer = calls_.call(state.request.place, "scene.list", Json::object()).head;
    Response response = json_answer(answer);
    response.headers.emplace_back("ETag", tag_of(answer.at("shown")));
    return response;
}

Response CameraJobs::configuration(const State& state) {
    const Json answer = calls_.call(state.request.place, "configuration", Json::object()).head;
    Response response = json_answer(answer);
    // Where values stand is part of the answer, and not of the daemon's hash.
    response.headers.emplace_back("ETag", tag_of(answer));
    return response;
}

std::optional<Response> CameraJobs::set_configuration(State& state) {
    const CameraPlace& place = state.request.place;
    if (!state.running) {
        const Json now = calls_.call(place, "configuration", Json::object()).head;
        check_tag(state, tag_of(now));
        for (const Json& entry : now.at("entries"))
            state.before[entry.at("key").get<std::string>()] = entry.at("value");
        state.running =
            calls_.begin(place, "configuration.set", {{"values", state.request.body}}, configuration_timeout);
    }
    const auto answer = calls_.look(*state.running);
    if (!answer) return std::nullopt;
    const Json& changed = answer->head.at("changed");
    Json before = Json::object();
    for (const auto& [key, value] : changed.items())
        before[key] = state.before.value(key, Json());
    if (!changed.empty()) note(state, std::move(before), changed);
    Response response = json_answer({{"changed", changed}});
    response.headers.emplace_back("ETag", tag_of(calls_.call(place, "configuration", Json::object()).head));
    return response;
}

std::optional<Response> CameraJobs::trigger(State& state) {
    if (!state.running) {
        const bool wait = state.request.body.value("wait", true);
        state.running = calls_.begin(state.request.place, "camera.trigger",
                                     {{"camera", state.request.place.number}, {"wait", wait}},
                                     trigger_timeout + frame_timeout);
    }
    if (DaemonCalls::Clock::now() - state.running->begun >= trigger_timeout) {
        note(state, nullptr, {{"outcome", "unknown"}});
        Response response = json_answer({{"accepted", true}, {"outcome", "unknown"}});
        response.status = 202;
        return response;
    }
    const auto answer = calls_.look(*state.running);
    if (!answer) return std::nullopt;
    Json head = answer->head;
    make_strings(head, {"edge_tai_ns", "frame"});
    Json after{{"accepted", head.value("accepted", false)}};
    for (const char* name : {"outcome", "frame"})
        if (head.contains(name)) after[name] = head[name];
    note(state, nullptr, std::move(after));
    Response response = json_answer(head);
    if (!head.contains("outcome")) response.status = 202;
    return response;
}

std::optional<Response> CameraJobs::show_scene(State& state) {
    const Json& file = state.request.body.at("file");
    if (!state.running) {
        try {
            state.before = calls_.call(state.request.place, "scene.list", Json::object()).head.at("shown");
        } catch (const Refusal& refusal) { // a daemon may show scenes and not list them
            if (refusal.type != "no-call") throw;
        }
        check_tag(state, tag_of(state.before));
        state.running = calls_.begin(state.request.place, "scene.show", {{"file", file}}, scene_timeout);
    }
    const auto answer = calls_.look(*state.running);
    if (!answer) return std::nullopt;
    note(state, state.before, file);
    return json_answer({{"file", file}});
}

std::optional<Response> CameraJobs::probe(State& state) {
    auto answered = answer(state, probe_timeout);
    if (!answered) return std::nullopt;
    make_strings(answered->head, {"frame", "row_mid_exposure_tai_ns"});
    return json_answer(answered->head);
}

std::optional<Response> CameraJobs::frame(State& state) {
    const Json& query = state.request.query;
    const double wait_s = query.value("wait", frame_wait_s);
    const std::chrono::milliseconds wait(static_cast<std::int64_t>(1e3 * wait_s));
    if (!state.running)
        state.running = calls_.begin(state.request.place, "frame",
                                     {{"camera", state.request.place.number},
                                      {"after", query.value("after", std::uint64_t{0})},
                                      {"wait_s", wait_s}},
                                     wait + frame_timeout);
    try {
        const auto answer = calls_.look(*state.running);
        if (!answer) return std::nullopt;
        const auto camera = camera_id_of(state.request.place.id);
        const auto kept = answered_frame(camera.value_or(CameraId{}), *answer);
        frames_->keep(kept);
        return file_of(state, *kept);
    } catch (const Refusal& refusal) {
        // The daemon refuses what did not come in time as it refuses what never can.
        if (refusal.response.status != 409 || DaemonCalls::Clock::now() - state.running->begun < wait) throw;
        Response none;
        none.status = 204;
        return none;
    }
}

std::optional<Response> CameraJobs::irradiance(State& state) {
    const CameraRequest& request = state.request;
    const auto camera = camera_id_of(request.place.id).value_or(CameraId{});
    if (!state.running) {
        std::uint64_t frame = 0;
        if (request.frame) {
            const auto kept = frames_->find(camera, *request.frame);
            if (!kept)
                throw Refusal(404, "gone", "this frame is not kept: no viewer or request has had it lately");
            frame = kept->head.value("frame", std::uint64_t{0});
        }
        state.running =
            calls_.begin(request.place, "irradiance", {{"camera", request.place.number}, {"frame", frame}},
                         irradiance_timeout);
    }
    const auto answer = calls_.look(*state.running);
    if (!answer) return std::nullopt;
    const auto shape = answer->shape("irradiance");
    const auto values = answer->floats("irradiance");
    if (shape.size() != 3 || values.size() != shape[0] * shape[1] * shape[2])
        throw Refusal(503, "daemon", "the daemon's frame has no irradiance");
    Response response = files_.irradiance(camera, answer->head, values, shape[1], shape[2]);
    response.type = request.route->type;
    return response;
}

Response CameraJobs::frame_of_path(const State& state) {
    const auto camera = camera_id_of(state.request.place.id);
    const auto kept = camera ? frames_->find(*camera, *state.request.frame) : nullptr;
    if (!kept)
        throw Refusal(
            404, "gone",
            "this frame is not kept: there are those that viewers see or have just seen, and those that were answered with last");
    return file_of(state, *kept);
}

Response CameraJobs::file_of(const State& state, const KeptFrame& frame) {
    return files_.response(state.request.form, frame, view_of(state.request.query));
}

} // namespace obscura::web
