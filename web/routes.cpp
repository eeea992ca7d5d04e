// SPDX-License-Identifier: Apache-2.0
#include "web/routes.hpp"

#include "core/latency_histogram.hpp"
#include "tools/support/metrics_text.hpp"
#include "web/fields.hpp"
#include "web/openapi.hpp"
#include "web/page_files.hpp"
#include "web/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <chrono>
#include <utility>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

double seconds_since(std::chrono::steady_clock::time_point at) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - at).count();
}

/// A file of the page; none: there is none of that path.
std::optional<Response> page_answer(std::string_view path) {
    const auto files = page_files();
    const auto file =
        std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == path; });
    if (file == files.end()) return std::nullopt;
    Response response;
    response.type = file->type;
    response.body = file->bytes;
    return response;
}

Response not_allowed(std::string_view allow) {
    Response response = problem(405, "method-not-allowed", fmt::format("this path has {}", allow));
    response.headers.emplace_back("Allow", allow);
    return response;
}

/// "application/json", with parameters or without.
bool is_json(std::string_view type) {
    constexpr std::string_view wanted = "application/json";
    return std::equal(wanted.begin(), wanted.end(), type.begin(),
                      type.begin() + static_cast<std::ptrdiff_t>(std::min(type.size(), wanted.size())),
                      [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); }) &&
           (type.size() == wanted.size() || type[wanted.size()] == ';' || type[wanted.size()] == ' ');
}

/// 304 where the client has the answer already.
void leave_out(Response& response, std::string_view if_none_match) {
    if (response.status != 200 || if_none_match.empty()) return;
    for (const auto& [name, value] : response.headers)
        if (name == "ETag" && names_tag(if_none_match, value)) {
            response.status = 304;
            response.body.clear();
            return;
        }
}

} // namespace

Routes::Routes(Settings settings, const DaemonWatch& watch) : settings_(std::move(settings)), watch_(watch) {}

Response Routes::answer(const Request& request) {
    try {
        return checked_answer(request);
    } catch (const Refusal& refusal) {
        return refusal.response;
    }
}

Response Routes::checked_answer(const Request& request) {
    const std::string_view path = request.target.substr(0, request.target.find('?'));
    const std::string_view query =
        path.size() < request.target.size() ? request.target.substr(path.size() + 1) : std::string_view();
    if (!request.has_host || !settings_.names.allows_host(request.host))
        return problem(421, "wrong-host", "this server is not called so; --host allows further names");
    if (request.has_origin && !settings_.names.allows_origin(request.origin))
        return problem(403, "foreign-origin", "a page of another site has asked");
    if (std::optional<Response> file = page_answer(path))
        return request.method == "GET" || request.method == "HEAD" ? *std::move(file)
                                                                   : not_allowed("GET, HEAD");
    if (path == "/api/v1/live") {
        Response response = problem(426, "upgrade", "a WebSocket of the protocol obscura.v1 is wanted");
        response.headers.emplace_back("Upgrade", "websocket");
        return response;
    }
    const Match found = match(request.method, path);
    if (found.methods.empty()) return problem(404, "no-such-path", "the paths stand in /api/v1/openapi.json");
    if (found.route == nullptr) {
        std::string methods;
        for (const std::string_view method : found.methods)
            methods +=
                fmt::format("{}{}{}", methods.empty() ? "" : ", ", method, method == "GET" ? ", HEAD" : "");
        return not_allowed(methods);
    }
    const Holder holder = found.route->role ? admit(request, *found.route->role) : Holder{};
    Response response = dispatch(request, found, query, holder);
    leave_out(response, request.if_none_match);
    return response;
}

Response Routes::dispatch(const Request& request, const Match& match, std::string_view query,
                          const Holder& holder) {
    const Route& route = *match.route;
    // Pages and scrapers add queries of their own.
    Json fields = route.is_api() ? read_query(query, route.query) : Json::object();
    Response response;
    response.type = route.type;
    switch (route.answers) {
    case Answers::page:
        break;
    case Answers::alive:
        response.body = "ok\n";
        return response;
    case Answers::ready:
        return ready();
    case Answers::metrics:
        response.body = tools::metrics_text(watch_.latest()->states);
        return response;
    case Answers::state:
        return state();
    case Answers::events:
        return events(fields);
    case Answers::me:
        return json_answer({{"role", name_of(holder.role)}, {"name", holder.name}});
    case Answers::audit:
        return json_answer(audit_.list(fields.value("after", std::uint64_t{0})));
    case Answers::openapi:
        if (openapi_.empty()) openapi_ = dumped(openapi_document(settings_.version));
        response.body = openapi_;
        return response;
    default:
        return camera_job(request, match, std::move(fields), holder);
    }
    return problem(404, "no-such-path", "the paths stand in /api/v1/openapi.json");
}

Response Routes::camera_job(const Request& request, const Match& match, Json query, const Holder& holder) {
    const Route& route = *match.route;
    Json body = Json::object();
    if (route.changes()) {
        // A form of another site cannot have this type.
        if (!is_json(request.content_type))
            return problem(415, "media-type", "a change is wanted as Content-Type: application/json");
        body = read_body(request.body, route);
    }
    if (query.value("force", false) && holder.role < Role::admin)
        return problem(403, "role", "the role admin is wanted for force");
    Response response;
    response.job = jobs_.job({&route, find_camera(*watch_.latest(), match.camera), std::move(query),
                              std::move(body), std::string(request.if_match),
                              fmt::format("{} {}", name_of(holder.role), holder.name), request.address});
    if (!request.if_none_match.empty())
        response.job->step = [step = std::move(response.job->step),
                              tags = std::string(request.if_none_match)] {
            std::optional<Response> made = step();
            if (made) leave_out(*made, tags);
            return made;
        };
    return response;
}

Holder Routes::admit(const Request& request, Role wanted) {
    const std::optional<Holder> holder = settings_.tokens.holder_of(request.bearer);
    if (holder && holder->role >= wanted) return *holder;
    if (holder) throw Refusal(403, "role", fmt::format("the role {} is wanted", name_of(wanted)));
    const auto now = WrongTokens::Clock::now();
    // A client with the right one, perhaps behind the same tunnel, is not kept waiting.
    if (wrong_.too_many(request.address, now)) {
        Refusal refusal(429, "too-many-wrong-tokens",
                        "too many wrong tokens from this address; wait a minute");
        refusal.response.headers.emplace_back("Retry-After", "60");
        throw refusal;
    }
    if (!request.bearer.empty()) wrong_.note(request.address, now);
    Refusal refusal(401, "token",
                    request.bearer.empty() ? "a token is wanted: Authorization: Bearer TOKEN"
                                           : "this token is not known");
    refusal.response.headers.emplace_back("WWW-Authenticate", "Bearer");
    throw refusal;
}

std::optional<std::string> Routes::token_refusal(std::string_view token, const std::string& address) {
    Request request;
    request.bearer = token;
    request.address = address;
    try {
        (void)admit(request, Role::viewer);
    } catch (const Refusal& refusal) {
        return refusal.type == "token" ? "this token is not known" : "too many wrong tokens; wait a minute";
    }
    return std::nullopt;
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
    Response response = json_answer({{"ready", good}, {"checks", checks}});
    if (!good) response.status = 503;
    return response;
}

Response Routes::state() const {
    const auto sighting = watch_.latest();
    Json all{{"age_s", seconds_since(sighting->at)},
             {"web", {{"version", settings_.version}, {"latency_bounds_us", latency_bounds_us}}}};
    all["error"] = sighting->error;
    all["daemons"] = sighting->states;
    return json_answer(all);
}

Response Routes::events(const Json& query) const {
    const auto after = query.value("after", std::uint64_t{0});
    if (query.value("follow", 1) == 0) {
        Json list = Json::array();
        for (const WatchedEvent& one : watch_.events(after, DaemonWatch::most_events))
            list.push_back(one.event);
        return json_answer({{"events", std::move(list)}});
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
