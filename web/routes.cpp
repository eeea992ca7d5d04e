// SPDX-License-Identifier: Apache-2.0
#include "web/routes.hpp"

#include "core/latency_histogram.hpp"
#include "tools/support/metrics_text.hpp"
#include "web/page_files.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view json_type = "application/json", problem_type = "application/problem+json";

constexpr std::array all_routes{
    Route{"/", std::nullopt, "The page, with the files of web/page below it"},
    Route{"/livez", std::nullopt, "200 while this process answers"},
    Route{"/readyz", Role::viewer, "200 if every camera is on time or idle, else 503; JSON of the checks"},
    Route{"/metrics", Role::viewer, "Metrics in the text format of Prometheus"},
    Route{"/api/v1/state", Role::viewer, "What the daemons said last: {\"age_s\", \"daemons\": [state...]}"},
    Route{"/api/v1/events", Role::viewer,
          "Log lines of the daemons as server-sent events, those after ?after=ID; "
          "with ?follow=0 as JSON"},
};

std::string dumped(const Json& json) {
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// RFC 9457. `type`: the cause, for programs.
Response problem(unsigned status, std::string_view type, std::string_view detail) {
    Response response;
    response.status = status;
    response.type = problem_type;
    response.body = dumped({{"type", fmt::format("urn:obscura:{}", type)},
                            {"status", status},
                            {"title", type},
                            {"detail", detail}});
    return response;
}

/// A file of the page; none: the path is none of them.
const PageFile* page_file(std::string_view path) {
    const auto files = page_files();
    const auto file =
        std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == path; });
    return file == files.end() ? nullptr : &*file;
}

double seconds_since(std::chrono::steady_clock::time_point at) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - at).count();
}

/// Value of a field of a query; none: the query does not have it.
std::optional<std::string_view> field(std::string_view query, std::string_view name) {
    while (!query.empty()) {
        const std::string_view one = query.substr(0, query.find('&'));
        query.remove_prefix(std::min(one.size() + 1, query.size()));
        if (one.substr(0, one.find('=')) == name)
            return one.size() > name.size() ? one.substr(name.size() + 1) : std::string_view();
    }
    return std::nullopt;
}

} // namespace

std::span<const Route> routes() {
    return all_routes;
}

Routes::Routes(Settings settings, const DaemonWatch& watch) : settings_(std::move(settings)), watch_(watch) {}

Response Routes::answer(const Request& request) {
    const std::string_view path = request.target.substr(0, request.target.find('?'));
    const std::string_view query =
        path.size() < request.target.size() ? request.target.substr(path.size() + 1) : std::string_view();
    if (!request.has_host || !settings_.names.allows_host(request.host))
        return problem(421, "wrong-host", "this server is not called so; --host allows further names");
    if (request.has_origin && !settings_.names.allows_origin(request.origin))
        return problem(403, "foreign-origin", "a page of another site has asked");
    const PageFile* const file = page_file(path);
    const auto route = std::find_if(all_routes.begin(), all_routes.end(),
                                    [&](const Route& one) { return one.path == (file ? "/" : path); });
    if (route == all_routes.end()) {
        std::string paths;
        for (const Route& one : all_routes)
            paths += fmt::format("{}{}", paths.empty() ? "" : " ", one.path);
        return problem(404, "no-such-path", "the paths are: " + paths);
    }
    if (request.method != "GET" && request.method != "HEAD") {
        Response response = problem(405, "method-not-allowed", "nothing can be changed here: GET and HEAD");
        response.headers.emplace_back("Allow", "GET, HEAD");
        return response;
    }
    if (std::optional<Response> refused = refusal(request, *route)) return *std::move(refused);
    if (file) return {200, file->type, std::string(file->bytes), {}, {}};
    if (path == "/livez") return {200, "text/plain; charset=utf-8", "ok\n", {}, {}};
    if (path == "/readyz") return ready();
    if (path == "/metrics") return metrics();
    if (path == "/api/v1/state") return state();
    return events(query);
}

std::optional<Response> Routes::refusal(const Request& request, const Route& route) {
    if (!route.role) return std::nullopt;
    const std::optional<Role> role = settings_.tokens.role_of(request.bearer);
    if (role && *role >= *route.role) return std::nullopt;
    if (role) return problem(403, "role", fmt::format("the role {} is wanted", name_of(*route.role)));
    const auto now = WrongTokens::Clock::now();
    // A client with the right one, perhaps behind the same tunnel, is not kept waiting.
    if (wrong_.too_many(request.address, now)) {
        Response response =
            problem(429, "too-many-wrong-tokens", "too many wrong tokens from this address; wait a minute");
        response.headers.emplace_back("Retry-After", "60");
        return response;
    }
    if (!request.bearer.empty()) wrong_.note(request.address, now);
    Response response = problem(401, "token",
                                request.bearer.empty() ? "a token is wanted: Authorization: Bearer TOKEN"
                                                       : "this token is not known");
    response.headers.emplace_back("WWW-Authenticate", "Bearer");
    return response;
}

Response Routes::ready() const {
    const auto sighting = watch_.latest();
    Json checks = Json::object();
    bool good = !sighting->states.empty();
    checks["daemon"] = good ? "answers" : sighting->error;
    for (const Json& state : sighting->states)
        for (std::size_t k = 0; k < state["cameras"].size(); ++k) {
            const Json& verdict = state["cameras"][k]["verdict"];
            good = good && verdict["health"] != "bad";
            checks[fmt::format("{} camera {}", state["daemon"]["config"].get<std::string>(), k)] =
                verdict["text"];
        }
    return {good ? 200u : 503u, json_type, dumped({{"ready", good}, {"checks", checks}}), {}, {}};
}

Response Routes::state() const {
    const auto sighting = watch_.latest();
    Json all{{"age_s", seconds_since(sighting->at)},
             {"web", {{"version", settings_.version}, {"latency_bounds_us", latency_bounds_us}}}};
    all["error"] = sighting->error;
    all["daemons"] = sighting->states;
    return {200, json_type, dumped(all), {}, {}};
}

Response Routes::metrics() const {
    return {200,
            "text/plain; version=0.0.4; charset=utf-8",
            tools::metrics_text(watch_.latest()->states),
            {},
            {}};
}

Response Routes::events(std::string_view query) const {
    std::uint64_t after = 0;
    if (const auto text = field(query, "after")) {
        const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), after);
        if (error != std::errc{} || end != text->data() + text->size())
            return problem(422, "value", "after: the number of an event");
    }
    if (field(query, "follow") == "0") {
        Json list = Json::array();
        for (const WatchedEvent& one : watch_.events(after, DaemonWatch::most_events))
            list.push_back(one.event);
        return {200, json_type, dumped({{"events", std::move(list)}}), {}, {}};
    }
    Response response;
    response.type = "text/event-stream";
    response.stream_after = after;
    return response;
}

std::string Routes::event_text(const WatchedEvent& event) {
    return fmt::format("id: {}\ndata: {}\n\n", event.id, dumped(event.event));
}

} // namespace obscura::web
