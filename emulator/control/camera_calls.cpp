// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/camera_calls.hpp"

#include "core/realtime/log.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "emulator/control/camera_features.hpp"
#include "emulator/simulator/simulator_protocol.hpp"
#include "emulator/simulator/simulator_server.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

namespace obscura::emulator {
namespace {

/// "; did you mean ...?" of a name that is close to one of a feature, else empty.
std::string nearest_feature(std::string_view name, const nlohmann::json& features) {
    std::vector<std::string_view> known;
    for (const auto& [feature, unused] : features.items())
        known.push_back(feature);
    return did_you_mean(name, known);
}

using nlohmann::json;
using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Permission;
using service::Work;

/// Longest wait for the frame of a trigger, as that of a step.
constexpr std::int64_t frame_timeout_ns = 60 * ns_per_s;
/// So often a wait sees whether its client has cancelled it.
constexpr std::int64_t cancel_check_interval_ns = 100 * ns_per_ms;

Failure not_now(const std::string& message, const std::string& hint = {}) {
    Failure failure(FailureCode::not_now, message);
    failure.hint = hint;
    return failure;
}

Time time_of(double time_s) {
    return Time{std::llround(time_s * 1e9)};
}

config::Key scene_time(double* target) {
    return config::key("time_s", target).unit("s").range(0, 999'999'999).required();
}

/// The error is rounded as in the answers of the simulator port.
json step_members(const SimulatorServer::StepResult& step) {
    const QualityCounters& q = step.quality;
    return {{"frame", step.frame.frame_id},
            {"outcome", name_of(step.frame.outcome)},
            {"late_rows", step.frame.late_rows},
            {"level", name_of(q.last_level)},
            {"error", std::round(static_cast<double>(q.last_error) * 1e5) / 1e5},
            {"rows_degraded", q.last_rows_degraded},
            {"reasons", q.last_reasons},
            {"margin_us", q.last_margin_us}};
}

/// What the chip makes of the settings in force.
json readout_of(const Camera& camera) {
    const auto us = [](std::int64_t ns) { return static_cast<double>(ns) / static_cast<double>(ns_per_us); };
    const ReadoutAnswer answer = camera.readout(camera.settings());
    if (!answer.refusal.empty()) return {{"refusal", answer.refusal}};
    json windows = json::array();
    std::int64_t rows = 0;
    for (std::size_t i = 0; i < answer.window_count; ++i) {
        const FrameWindow& w = answer.windows[i];
        rows += w.sensor.height;
        windows.push_back({{"x", w.sensor.x},
                           {"y", w.sensor.y},
                           {"width", w.sensor.width},
                           {"height", w.sensor.height},
                           {"exposure_requested_us", us(w.exposure_requested_ns)},
                           {"exposure_min_us", us(w.exposure_min_ns)},
                           {"exposure_max_us", us(w.exposure_max_ns)},
                           {"reads", w.reads}});
    }
    const double period_us = us(answer.frame_period_ns);
    return {{"frame_period_us", period_us},
            {"max_rate_hz", period_us > 0 ? json(1e6 / period_us) : json()},
            {"readout_us", us(answer.readout_ns)},
            {"row_us", rows > 1 ? json(us(answer.readout_ns) / static_cast<double>(rows - 1)) : json()},
            {"windows", std::move(windows)}};
}

/// Waits until the outcome of a trigger is known, of a frame that is exposed for `exposure_ns`. Throws
/// Failure.
OutcomeRecord await_outcome(OutcomeRing& outcomes, OutcomeRing::Request& request, std::int64_t exposure_ns,
                            const Work& work) {
    const MonotonicClock clock;
    const Time give_up = clock.now() + frame_timeout_ns + exposure_ns;
    for (;;) {
        if (work.cancelled()) throw service::cancelled();
        const Time now = clock.now();
        if (now > give_up) throw not_now("camera.trigger: the frame does not come");
        if (const auto record = outcomes.wait(request, std::min(give_up, now + cancel_check_interval_ns)))
            return *record;
    }
}

} // namespace

/// Which camera of the daemon.
struct CameraCalls::Choice {
    std::uint32_t number = 0;

    Fields fields() { return {{camera_key(&number)}}; }
};

struct CameraCalls::Get : Choice { // NOLINT(bugprone-exception-escape): json does not throw when moved
    json names;

    Fields fields() {
        Fields all = Choice::fields();
        all.free.push_back({"names", "array of strings", "Features that are wanted; missing: all", &names});
        return all;
    }
};

struct CameraCalls::Set : Choice { // NOLINT(bugprone-exception-escape): json does not throw when moved
    json values;
    bool force = false;

    Fields fields() {
        Fields all = Choice::fields();
        all.keys.push_back(
            config::key("force", &force)
                .help(
                    "Also while a client of GigE Vision controls the camera; needs the permission \"admin\""));
        all.free.push_back({"values", "map", "Names of features and their new values", &values, true});
        return all;
    }
};

struct CameraCalls::Trigger : Choice {
    bool wait = true;

    Fields fields() {
        Fields all = Choice::fields();
        all.keys.push_back(
            config::key("wait", &wait)
                .help(
                    "Answer when the last row of the frame has left, or when it is clear that no frame comes; false: at once"));
        return all;
    }
};

struct CameraCalls::PoseFields : Choice {
    std::string name;
    double time_s = 0;
    Vec3 position_m{};
    std::array<double, 4> orientation{1, 0, 0, 0};
    std::array<double, 3> velocity_m_s{}, rate_rad_s{};
    bool moves = false;

    Fields fields() {
        Fields all = Choice::fields();
        const auto numbers = [](auto& array) { return config::Numbers{array.data(), array.size()}; };
        for (config::Key& key : config::Keys{
                 config::key("name", &name)
                     .required()
                     .help("Body or lamp of the scene by its name, or \"camera\""),
                 scene_time(&time_s).help("Scene time of the pose, later than that of the one before"),
                 config::key("position_m", &position_m).unit("m").required().help("Position, inertial"),
                 config::key("orientation", numbers(orientation))
                     .help("Quaternion w, x, y, z: from its own axes to inertial ones"),
                 config::key("velocity_m_s", numbers(velocity_m_s))
                     .unit("m/s")
                     .help("Velocity with which the motion goes on, with rates"),
                 config::key("rate_rad_s", numbers(rate_rad_s))
                     .unit("rad/s")
                     .help("Rotation rate in its own axes, with rates"),
                 config::key("rates", &moves)
                     .help("The velocities hold; false: those between the last two poses do")})
            all.keys.push_back(std::move(key));
        return all;
    }
    /// Valid while this lives.
    [[nodiscard]] PoseLine line() const {
        const auto vector = [](const auto& v) { return Vec3{v[0], v[1], v[2]}; };
        PoseLine line{name,
                      time_of(time_s),
                      {position_m, {orientation[0], orientation[1], orientation[2], orientation[3]}}};
        if (moves) line.rates = {vector(velocity_m_s), vector(rate_rad_s)};
        return line;
    }
};

struct CameraCalls::Step : Choice {
    double time_s = 0;

    Fields fields() {
        Fields all = Choice::fields();
        all.keys.push_back(
            scene_time(&time_s).help("Scene time of the frame, later than that of the client's step before"));
        return all;
    }
};

config::Key camera_key(std::uint32_t* number) {
    return config::key("camera", number)
        .range(0, 1000)
        .help("Number of the camera, in the order of the configuration");
}

void check_camera_number(std::size_t cameras, std::uint32_t number) {
    if (number < cameras) return;
    const std::string allowed = fmt::format("0 to {}", cameras - 1);
    throw bad_argument("camera", fmt::format("camera: there is no camera {}, allowed {}", number, allowed),
                       allowed);
}

ControlledCamera& checked_camera(const CameraCalls::Cameras& cameras, std::uint32_t number) {
    check_camera_number(cameras.size(), number);
    return *cameras[number];
}

ControlledCamera& CameraCalls::camera(const Choice& choice) const {
    return checked_camera(cameras_, choice.number);
}

std::string CameraCalls::change(ControlledCamera& camera, const std::function<void()>& work,
                                bool force) const {
    std::string forced;
    camera.run([&](const std::string& controller) {
        if (!controller.empty() && !force)
            throw Failure(FailureCode::controlled, fmt::format("controlled by {}", controller));
        work();
        forced = controller;
    });
    return forced;
}

SimulatorServer& CameraCalls::simulator(const Choice& choice) const {
    if (SimulatorServer* const server = camera(choice).simulator) return *server;
    throw Failure(FailureCode::not_now, "the daemon has no simulator port: simulator.enabled is false");
}

Answer CameraCalls::features(const Choice& choice) const {
    const Camera& chosen = camera(choice).camera;
    CameraFeatures values(chosen.settings());
    const config::Keys keys = values.keys(chosen.limits());
    json rows = service::describe(keys);
    const json now = values_of(keys);
    const bool acquiring = chosen.acquiring();
    for (json& row : rows) {
        const auto name = row["name"].get<std::string>();
        const Setting& setting = *find_setting(name);
        row.erase("default");
        row["value"] = now.at(name);
        row["category"] = setting.category;
        if (const std::optional<SettingRange> range = setting.range_of(chosen.limits())) {
            row["min"] = range->minimum;
            row["max"] = range->maximum;
        }
        if (setting.increment != nullptr) row["increment"] = chosen.limits().*setting.increment;
        row["locked"] = setting.is_locked(acquiring);
        if (row["locked"]) row["why"] = "not while it acquires";
    }
    return {{{"features", std::move(rows)}, {"readout", readout_of(chosen)}}};
}

Answer CameraCalls::get(const Get& get) const {
    const Camera& chosen = camera(get).camera;
    CameraFeatures values(chosen.settings());
    const json now = values_of(values.keys(chosen.limits()));
    if (get.names.is_null()) return {{{"values", now}}};
    if (!get.names.is_array()) throw bad_argument("names", "camera.get: names: allowed an array of strings");
    json wanted = json::object();
    for (const json& name : get.names) {
        const std::string text = name.is_string() ? name.get<std::string>() : std::string();
        if (!now.contains(text))
            throw bad_argument("names", fmt::format("camera.get: names: no feature \"{}\"{}",
                                                    printable(text, 60), nearest_feature(text, now)));
        wanted[text] = now[text];
    }
    return {{{"values", std::move(wanted)}}};
}

Answer CameraCalls::set(const Set& set, const Work& work) const {
    if (set.force && work.permission() < Permission::admin) {
        Failure failure(
            FailureCode::forbidden,
            "camera.set: force needs the permission \"admin\": members of the group control.admin_group have it at the Unix socket, others by a token of control.token_permission");
        failure.field = "force";
        throw failure;
    }
    if (!set.values.is_object()) throw bad_argument("values", "camera.set: values: allowed a map");
    Camera& chosen = camera(set).camera;
    json changed = json::object();
    const auto apply = [&] {
        const CameraLimits limits = chosen.limits();
        CameraFeatures features(chosen.settings());
        const config::Keys keys = features.keys(limits);
        const json before = values_of(keys);
        service::read_values("camera.set", set.values, keys);
        const json asked = values_of(keys);
        for (const auto& [name, value] : asked.items()) {
            if (value == before[name] || !find_setting(name)->is_locked(chosen.acquiring())) continue;
            Failure failure = not_now(
                fmt::format("camera.set: {} cannot change while the camera acquires", name), "camera.stop");
            failure.field = name;
            throw failure;
        }
        const CameraSettings wanted = features.settings();
        if (const std::string why = chosen.explain(wanted); !why.empty() || !chosen.apply(wanted)) {
            const auto invalid = find_invalid(wanted, limits);
            throw bad_argument(invalid ? invalid->feature : "values", fmt::format("camera.set: {}", why));
        }
        CameraFeatures applied(chosen.settings());
        const json after = values_of(applied.keys(limits));
        for (const auto& [name, value] : after.items())
            if (value != before[name]) changed[name] = value;
    };
    if (const std::string controller = change(camera(set), apply, set.force); !controller.empty())
        log_notice("calls: camera {}: {} set although {} controls it", set.number, changed.dump(),
                   controller);
    return {{{"changed", std::move(changed)}}};
}

Answer CameraCalls::trigger(const Trigger& trigger, Work& work) const {
    ControlledCamera& chosen = camera(trigger);
    OutcomeRing& outcomes = chosen.camera.outcomes();
    OutcomeRing::Request request;
    Time edge;
    std::int64_t exposure_ns = 0; // of all windows
    bool accepted = false;
    change(chosen, [&] {
        if (!chosen.camera.acquiring())
            throw not_now("camera.trigger: the camera does not acquire", "camera.start");
        const CameraSettings settings = chosen.camera.settings();
        for (std::size_t i = 0; i < settings.window_count(); ++i)
            exposure_ns += settings.window(i).exposure_ns;
        const TriggerChoice choice = settings.frame_trigger;
        if (!choice.enabled || choice.source != TriggerSource::software)
            throw not_now(
                fmt::format("camera.trigger: TriggerMode is {} and TriggerSource {}, not On and Software",
                            choice.enabled ? "On" : "Off", name_of(choice.source)),
                "camera.set");
        request = outcomes.request();
        edge = chosen.clock.now();
        accepted = chosen.camera.software_trigger(edge, request);
    });
    Answer answer;
    answer.head = {{"accepted", accepted}, {"edge_tai_ns", edge.ns + chosen.clock.tai_offset_ns()}};
    if (!trigger.wait) return answer;
    const OutcomeRecord record =
        accepted ? await_outcome(outcomes, request, exposure_ns, work) : OutcomeRecord{};
    answer.head["outcome"] = name_of(record.outcome);
    if (record.outcome == FrameOutcome::missed) return answer;
    answer.head["frame"] = record.frame_id;
    answer.head["late_rows"] = record.late_rows;
    answer.head["seconds"] = to_seconds(chosen.clock.now() - edge);
    return answer;
}

void CameraCalls::pose(const PoseFields& pose) const {
    // What no line of the simulator port can name is not named by a call either.
    constexpr std::size_t max_name_bytes = 200;
    if (pose.name.empty() || pose.name.size() > max_name_bytes ||
        !std::all_of(pose.name.begin(), pose.name.end(),
                     [](char c) { return static_cast<unsigned char>(c) > ' ' && c != '\x7f'; }))
        throw bad_argument("name", "pose: name: a word without blanks is wanted");
    SimulatorServer& server = simulator(pose);
    PoseLine line = pose.line();
    std::string why = check_pose(line);
    if (why.empty()) why = server.pose(line);
    if (!why.empty()) throw Failure(FailureCode::bad_argument, why);
}

Answer CameraCalls::step(const Step& step, Work& work) {
    SimulatorServer& server = simulator(step);
    Time& last = last_steps_.try_emplace(step.number, Time{-1}).first->second;
    const SimulatorServer::StepResult result = server.step(time_of(step.time_s), last, work.cancelled());
    if (result.refusal.empty()) return {step_members(result)};
    if (work.cancelled()) {
        last = Time{-1}; // the step has not been made
        throw service::cancelled();
    }
    throw not_now(result.refusal);
}

namespace {

/// Sets what the calls answer, in the order of CameraCalls::calls().
void set_results(service::Calls& calls) {
    calls[0].results = {
        {"features", "array of maps", "",
         "Rows: name, value, type, unit, allowed, help; category, of SFNC; "
         "increment, if it is not any; locked: cannot change now, and why"},
        {"readout", "map", "",
         "What the chip makes of the settings in force: frame_period_us, shortest time between triggers; "
         "max_rate_hz; readout_us, first to last row; row_us; "
         "windows: x, y, width, height, exposure_requested_us, exposure_min_us and exposure_max_us obtained, reads. refusal: why it cannot read them"}};
    calls[1].results = {{"values", "map", "", "Values by the names of the features"}};
    calls[2].results = {{"changed", "map", "", "All features that have changed, and their values now"}};
    calls[3].results = {{"started", "boolean", "", "False: it was running"}};
    calls[4].results = {{"stopped", "boolean", "", "False: it was not running"}};
    calls[5].results = {
        {"accepted", "boolean", "", "Whether the camera was ready for the trigger"},
        {"edge_tai_ns", "integer", "ns", "Instant of the trigger, TAI"},
        {"outcome", "string", "",
         "complete, late, repeated, partial, dropped, abandoned, or missed: no frame; with wait"},
        {"frame", "integer", "", "Number of the frame"},
        {"late_rows", "integer", "", "Rows that were not ready in time"},
        {"seconds", "number", "s", "Time from the trigger until the last row had left"}};
    calls[7].results = {{"frame", "integer", "", "Number of the frame"},
                        {"outcome", "string", "", "As that of camera.trigger"},
                        {"late_rows", "integer", "", "Rows that were not ready in time"},
                        {"level", "string", "", "Worst quality level of its rows"},
                        {"error", "number", "", "Estimated error"},
                        {"rows_degraded", "integer", "", "Rows below full quality"},
                        {"reasons", "integer", "", "Bits of the reasons, see docs/truth.md"},
                        {"margin_us", "integer", "us", "Time that the last row was ready before it was due"}};
}

} // namespace

service::Calls CameraCalls::calls() {
    using service::call;
    service::Calls calls{
        call<Choice>("camera.features", Permission::view,
                     "Lists the settings of a camera by their SFNC names, with values and what is allowed.",
                     [this](const Choice& choice, Work& /*work*/) { return features(choice); }),
        call<Get>("camera.get", Permission::view, "Reads settings of a camera.",
                  [this](const Get& arguments, Work& /*work*/) { return get(arguments); }),
        call<Set>(
            "camera.set", Permission::operate,
            "Changes settings of a camera from the next frame on: all of them, or none if one is wrong. "
            "While a GigE Vision client controls the camera it answers \"controlled\" with the client's address, unless it is forced, which is logged.",
            [this](const Set& arguments, Work& work) { return set(arguments, work); }),
        call<Choice>("camera.start", Permission::operate,
                     "Starts the acquisition; answers \"controlled\" as camera.set does.",
                     [this](const Choice& choice, Work& /*work*/) {
                         Camera& chosen = camera(choice).camera;
                         bool started = false;
                         change(camera(choice), [&] { started = chosen.acquisition_start(); });
                         return Answer{{{"started", started}}};
                     }),
        call<Choice>("camera.stop", Permission::operate,
                     "Stops the acquisition; the frame in progress is finished. "
                     "Answers \"controlled\" as camera.set does.",
                     [this](const Choice& choice, Work& /*work*/) {
                         Camera& chosen = camera(choice).camera;
                         bool stopped = false;
                         change(camera(choice), [&] {
                             stopped = chosen.acquiring();
                             chosen.acquisition_stop(false);
                         });
                         return Answer{{{"stopped", stopped}}};
                     }),
        call<Trigger>(
            "camera.trigger", Permission::operate,
            "Triggers one frame of a camera whose TriggerSource is Software, and tells what became of it. "
            "Answers \"controlled\" as camera.set does.",
            [this](const Trigger& arguments, Work& work) { return trigger(arguments, work); }),
        call<PoseFields>(
            "pose", Permission::scene,
            "Moves the camera, a body or a lamp, as `pose` of the simulator port does; needs simulator.enabled.",
            [this](const PoseFields& arguments, Work& /*work*/) {
                pose(arguments);
                return Answer{};
            }),
        call<Step>(
            "step", Permission::operate,
            "Makes the frame of a scene time in lockstep, as `step` of the simulator port does, and answers when its last row has left; "
            "needs trigger.source = \"lockstep\".",
            [this](const Step& arguments, Work& work) { return step(arguments, work); }),
    };
    set_results(calls);
    return calls;
}

} // namespace obscura::emulator
