// SPDX-License-Identifier: Apache-2.0
#include "web/api/routes.hpp"

#include "core/realtime/latency_histogram.hpp"
#include "core/text/suggestion.hpp"
#include "host/metrics_text.hpp"
#include "host/sha256.hpp"
#include "web/api/fields.hpp"
#include "web/api/openapi.hpp"
#include "web/api/readiness.hpp"
#include "web/page/page_files.hpp"
#include "web/server/content_coding.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <chrono>
#include <utility>

namespace obscura::web {
namespace {

using Json = nlohmann::ordered_json;

double seconds_since(std::chrono::steady_clock::time_point at) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - at).count();
}

/// The answer that `zipped` is the gzip of, in the form that the client takes; the tag differs with the form.
void choose_form(Response& response, const Request& request, std::string_view zipped, std::string_view hash) {
    const bool zip = takes_gzip(request.accept_encoding);
    if (zip) {
        response.body = zipped;
        response.headers.emplace_back("Content-Encoding", "gzip");
    }
    response.headers.emplace_back("Vary", "Accept-Encoding");
    response.headers.emplace_back("ETag", fmt::format("\"{}{}\"", hash, zip ? ".gzip" : ""));
}

/// A file of the page; none: there is none of that path.
std::optional<Response> page_answer(std::string_view path, const Request& request) {
    const std::string_view version = page_version();
    // Below the hash of all files nothing ever changes; elsewhere browsers ask whether it has.
    const bool for_good = path.size() > version.size() + 2 && path.substr(1, version.size()) == version &&
                          path[version.size() + 1] == '/';
    if (for_good) path.remove_prefix(version.size() + 1);
    const auto files = page_files();
    const auto file =
        std::find_if(files.begin(), files.end(), [&](const PageFile& f) { return f.path == path; });
    if (file == files.end()) return std::nullopt;
    Response response;
    response.type = file->type;
    response.body = file->bytes;
    response.headers.emplace_back("Cache-Control",
                                  for_good ? "public, max-age=31536000, immutable" : "no-cache");
    choose_form(response, request, file->zipped, file->hash);
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

/// Whether a header Prefer (RFC 7240) has that preference.
bool prefers(std::string_view header, std::string_view wanted) {
    while (!header.empty()) {
        std::string_view one = header.substr(0, header.find(','));
        header.remove_prefix(std::min(one.size() + 1, header.size()));
        one = one.substr(0, one.find(';'));
        while (one.starts_with(' '))
            one.remove_prefix(1);
        while (one.ends_with(' '))
            one.remove_suffix(1);
        if (one == wanted) return true;
    }
    return false;
}

/// `id` of a camera; empty: there is none.
std::string first_camera(const Sighting& sighting) {
    for (const Json& state : sighting.states)
        for (const Json& camera : state.at("cameras"))
            return camera.value("id", std::string());
    return {};
}

/// The suffix of the form of a frame that suits a header Accept best. Throws Refusal.
std::string_view frame_form(std::string_view accept) {
    double best = 0;
    std::string_view suffix;
    for (const FrameForm& form : frame_forms())
        if (const double weight = accepted(accept, form.type); weight > best) {
            best = weight;
            suffix = form.suffix;
        }
    if (!suffix.empty()) return suffix;
    std::string types;
    for (const FrameForm& form : frame_forms())
        types += fmt::format("{}{}", types.empty() ? "" : ", ", form.type);
    throw Refusal(406, "not-acceptable", fmt::format("a frame can be had as {}", types));
}

/// Paths of the table that a mistyped one may mean, with its own camera.
Response no_such_path(std::string_view path) {
    constexpr std::string_view cameras = "/api/v1/cameras/";
    constexpr std::size_t most = 120;
    std::string detail = "the paths stand in /api/v1/openapi.json";
    if (path.size() <= most) {
        std::string_view camera;
        if (path.starts_with(cameras))
            camera = path.substr(cameras.size(), path.find('/', cameras.size()) - cameras.size());
        std::vector<std::string> paths;
        for (const Route& route : routes()) {
            std::string one(route.path);
            if (const std::size_t at = one.find("{camera}"); at != std::string::npos) {
                if (camera.empty()) continue;
                one.replace(at, 8, camera);
            }
            if (one.find('{') == std::string::npos) paths.push_back(std::move(one));
        }
        if (const auto close = closest_word(path, {paths.begin(), paths.end()}))
            detail += fmt::format("; did you mean {}?", *close);
    }
    return problem(404, "no-such-path", detail);
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
    std::string_view route = "other";
    Response response;
    try {
        response = checked_answer(request, route);
    } catch (const Refusal& refusal) {
        response = refusal.response;
    } catch (const Json::exception& error) { // a daemon of another version has said it
        response = problem(503, "daemon", error.what());
    }
    response.route = route;
    return response;
}

Response Routes::checked_answer(const Request& request, std::string_view& route) {
    const std::string_view path = request.target.substr(0, request.target.find('?'));
    const std::string_view query =
        path.size() < request.target.size() ? request.target.substr(path.size() + 1) : std::string_view();
    const std::string_view host = request.host.substr(0, 80);
    if (!request.has_host || !settings_.names.allows_host(request.host))
        return problem(421, "wrong-host",
                       fmt::format("this server is not called \"{}\"; obscura-web --host {} allows that name",
                                   host, host));
    if (request.has_origin && !settings_.names.allows_origin(request.origin))
        return problem(403, "foreign-origin", "a page of another site has asked");
    if (std::optional<Response> file = page_answer(path, request)) {
        route = "page";
        if (request.method != "GET" && request.method != "HEAD") return not_allowed("GET, HEAD");
        leave_out(*file, request.if_none_match);
        return *std::move(file);
    }
    if (path == "/api/v1/live") {
        route = "live";
        Response response = problem(426, "upgrade", "a WebSocket of the protocol obscura.v1 is wanted");
        response.headers.emplace_back("Upgrade", "websocket");
        return response;
    }
    const Match found = match(request.method, path);
    if (found.methods.empty()) return no_such_path(path);
    if (found.route == nullptr) {
        std::string methods;
        for (const std::string_view method : found.methods)
            methods +=
                fmt::format("{}{}{}", methods.empty() ? "" : ", ", method, method == "GET" ? ", HEAD" : "");
        return not_allowed(methods);
    }
    route = found.route->id;
    const Holder holder = found.route->role ? admit(request, *found.route) : Holder{};
    Response response = dispatch(request, found, query, holder);
    if (found.route->role) response.session = holder.name.empty() ? request.address : holder.name;
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
        response.body = host::metrics_text(watch_.latest()->states) + settings_.figures->text();
        return response;
    case Answers::state:
        return state();
    case Answers::cameras:
        return cameras();
    case Answers::camera:
        return camera(match.camera);
    case Answers::events:
        return events(fields, request.last_event_id);
    case Answers::me:
        return json_answer({{"role", name_of(holder.role)}, {"name", holder.name}});
    case Answers::audit:
        return json_answer(audit_.list(fields.value("after", std::uint64_t{0})));
    case Answers::openapi:
        if (openapi_.empty()) {
            openapi_ = dumped(openapi_document(settings_.version));
            zipped_openapi_ = gzipped(openapi_);
        }
        response.body = openapi_;
        choose_form(response, request, zipped_openapi_, host::sha256_of(openapi_).substr(0, 16));
        return response;
    case Answers::pictures:
        response.pictures_of = seen_camera(match.camera);
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
    std::shared_ptr<KeptAnswers::Command> command;
    if (route.changes() && request.has_idempotency_key) {
        KeptAnswers::Begun begun = kept_.begin(
            request.bearer, request.idempotency_key,
            fmt::format("{} {}\n{}\n{}", request.method, request.target, request.if_match, request.body),
            KeptAnswers::Clock::now());
        if (begun.answer) return *std::move(begun.answer);
        command = std::move(begun.command);
    }
    const bool at_once = route.answers == Answers::trigger && prefers(request.prefer, "respond-async");
    if (at_once) body["wait"] = false;
    const auto sighting = watch_.latest();
    const bool of_daemon = route.answers == Answers::support_bundle || route.answers == Answers::self_test;
    const std::string camera =
        of_daemon ? query.value("camera", first_camera(*sighting)) : camera_id(*sighting, match.camera);
    std::string_view form = route.path.substr(route.path.rfind('.') + 1);
    if (route.answers == Answers::frame) form = frame_form(request.accept);
    // A frame that is kept needs no daemon.
    CameraPlace place;
    if (match.frame && route.answers != Answers::frame_exr)
        place.id = camera;
    else
        place = find_camera(*sighting, camera);
    Response response;
    response.job = jobs_.job({&route, std::move(place), std::string(match.feature), match.frame, form,
                              std::move(query), std::move(body), std::string(request.if_match),
                              fmt::format("{} {}", name_of(holder.role), holder.name), request.address});
    const bool negotiated = route.answers == Answers::frame;
    response.job->step = [step = std::move(response.job->step), command = std::move(command), at_once,
                          negotiated, tags = std::string(request.if_none_match)] {
        std::optional<Response> made = step();
        if (!made) return made;
        if (negotiated) made->headers.emplace_back("Vary", "Accept");
        if (at_once) made->headers.emplace_back("Preference-Applied", "respond-async");
        if (command) command->answered(*made);
        leave_out(*made, tags);
        return made;
    };
    return response;
}

std::string Routes::seen_camera(std::string_view camera) const {
    const auto sighting = watch_.latest();
    if (sighting->states.empty()) throw Refusal(503, "no-daemon", sighting->error);
    const std::string id = camera_id(*sighting, camera);
    for (const Json& state : sighting->states)
        for (const Json& one : state["cameras"])
            if (id.empty() || one["id"] == id) return one["id"];
    throw Refusal(404, "no-such-camera", "the cameras stand in /api/v1/cameras");
}

Response Routes::cameras() const {
    const auto sighting = watch_.latest();
    Json list = Json::array();
    for (const Json& state : sighting->states) {
        const Json& daemon = state.at("daemon");
        std::size_t number = 0;
        for (const Json& camera : state.at("cameras"))
            list.push_back({{"id", camera.at("id")},
                            {"number", number++},
                            {"daemon", daemon.at("pid")},
                            {"config", daemon.at("config")},
                            {"address", camera.at("address")},
                            {"acquiring", camera.at("acquiring")},
                            {"verdict", camera.at("verdict")}});
    }
    return json_answer({{"cameras", std::move(list)}, {"error", sighting->error}});
}

Response Routes::camera(std::string_view id) const {
    const std::string wanted = seen_camera(id);
    const auto sighting = watch_.latest();
    for (const Json& state : sighting->states)
        for (const Json& one : state.at("cameras"))
            if (one.at("id") == wanted) return json_answer(one);
    throw Refusal(404, "no-such-camera", "the cameras stand in /api/v1/cameras");
}

Holder Routes::admit(const Request& request, const Route& route) {
    if (route.answers != Answers::pictures) return admit(request.bearer, request.address, *route.role);
    // Players have no other way to give a token that does not end in the logs of servers and proxies. They
    // are told of that scheme alone: some read the first one only.
    try {
        return admit(request.bearer.empty() ? request.password : request.bearer, request.address,
                     *route.role);
    } catch (Refusal& refusal) {
        if (refusal.response.status == 401)
            refusal.response.headers.emplace_back("WWW-Authenticate", "Basic realm=\"obscura\"");
        throw;
    }
}

Holder Routes::admit(std::string_view token, const std::string& address, Role wanted) {
    const std::optional<Holder> holder = settings_.tokens.holder_of(token);
    if (holder && holder->role >= wanted) return *holder;
    if (holder) throw Refusal(403, "role", fmt::format("the role {} is wanted", name_of(wanted)));
    const auto now = WrongTokens::Clock::now();
    // A client with the right one, perhaps behind the same tunnel, is not kept waiting.
    if (wrong_.too_many(address, now)) {
        Refusal refusal(429, "too-many-wrong-tokens",
                        "too many wrong tokens from this address; wait a minute");
        refusal.response.headers.emplace_back("Retry-After", "60");
        throw refusal;
    }
    if (!token.empty()) wrong_.note(address, now);
    Refusal refusal(401, "token",
                    token.empty() ? "a token is wanted: Authorization: Bearer TOKEN"
                                  : "this token is not known");
    refusal.response.headers.emplace_back("WWW-Authenticate", "Bearer");
    throw refusal;
}

std::optional<std::string> Routes::token_refusal(std::string_view token, const std::string& address) {
    try {
        (void)admit(token, address, Role::viewer);
    } catch (const Refusal& refusal) {
        return refusal.type == "token" ? "this token is not known" : "too many wrong tokens; wait a minute";
    }
    return std::nullopt;
}

Response Routes::ready() const {
    const Readiness found = readiness_of(*watch_.latest());
    Response response = json_answer({{"ready", found.ready}, {"checks", found.checks}});
    if (!found.ready) response.status = 503;
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

Response Routes::events(const Json& query, std::string_view last_id) const {
    auto after = query.value("after", std::uint64_t{0});
    if (query.value("follow", 1) == 0) {
        Json list = Json::array();
        for (const WatchedEvent& one : watch_.events(after, DaemonWatch::max_events))
            list.push_back(one.event);
        return json_answer({{"events", std::move(list)}});
    }
    Response response;
    response.type = "text/event-stream";
    if (!last_id.empty()) {
        const char* const end = last_id.data() + last_id.size();
        const auto [dash, bad] = std::from_chars(last_id.data(), end, after);
        if (bad != std::errc{} || (dash != end && *dash != '-'))
            throw Refusal(400, "last-event-id",
                          "Last-Event-ID: the id of an event of this stream is allowed");
        if (dash != end && std::string_view(dash + 1, end) != watch_.run()) {
            after = 0;
            response.body = lost_text(0, 0);
        }
    }
    response.stream_after = after;
    return response;
}

std::string Routes::event_text(const WatchedEvent& event, const std::string& run) {
    return fmt::format("id: {}-{}\ndata: {}\n\n", event.id, run, dumped(event.event));
}

std::string Routes::lost_text(std::uint64_t after, std::uint64_t next) {
    // An event of its own kind, which listeners to the others do not see.
    return fmt::format("event: lost\ndata: {{\"lost\":{}}}\n\n",
                       next > after ? std::to_string(next - after - 1) : "null");
}

} // namespace obscura::web
