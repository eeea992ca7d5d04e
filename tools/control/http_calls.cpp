// SPDX-License-Identifier: Apache-2.0
#include "tools/control/http_calls.hpp"

#include "tools/control/daemon_options.hpp"
#include "tools/control/http_client.hpp"
#include "tools/support/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <utility>

namespace obscura::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "raw frames are copied as they come");

/// Counts and instants that the interface writes as strings, since they may not fit a double.
void make_numbers(CallJson& map) {
    for (const char* const name :
         {"id", "number", "frame", "trigger", "edge_tai_ns", "mid_exposure_tai_ns"}) {
        const auto found = map.find(name);
        if (found == map.end() || !found->is_string()) continue;
        const std::string& text = found->get_ref<const std::string&>();
        std::int64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc{} && end == text.data() + text.size()) *found = value;
    }
}

/// The word of docs/control.md for the answer of the server.
std::string code_of(const HttpAnswer& answer, const CallJson& problem) {
    const std::string type = problem.value("type", std::string());
    if (answer.status == 401 || answer.status == 403) return "forbidden";
    if (answer.status == 409) return type.ends_with(":not-now") ? "not-now" : "controlled";
    if (answer.status == 404) return "unknown-call";
    if (answer.status == 429) return "busy";
    return answer.status == 400 || answer.status == 422 ? "bad-argument" : "internal";
}

class HttpCalls final : public DaemonCalls {
public:
    HttpCalls(std::string_view verb, HttpOptions options)
        : verb_(verb),
          camera_(options.camera),
          client_(verb, std::move(options.url), std::move(options.token), options.authority,
                  options.patience_s) {
        const CallJson cameras = daemon().at("cameras");
        if (camera_ >= cameras.size())
            throw CallError("bad-argument",
                            fmt::format("obscura {}: there is no camera {}, allowed 0 to {}", verb_, camera_,
                                        static_cast<int>(cameras.size()) - 1));
        path_ = "/api/v1/cameras/" + cameras[camera_].at("id").get<std::string>();
    }

    [[nodiscard]] CallAnswer call(std::string_view name, const CallJson& fields) override {
        call_ = name;
        if (name == "frame") return frame(fields);
        CallJson answer = head(name, fields);
        make_numbers(answer);
        return {std::move(answer)};
    }

private:
    CallJson head(std::string_view name, const CallJson& fields) {
        if (name == "state") return daemon();
        if (name == "events")
            return get(
                fmt::format("/api/v1/events?follow=0&after={}", fields.value("after", std::uint64_t{0})));
        if (name == "camera.features") return get(path_ + "/features");
        if (name == "camera.get") {
            const CallJson answer = get(path_ + "/features");
            CallJson values = CallJson::object();
            for (const CallJson& row : answer.at("features"))
                values[row.at("name").get<std::string>()] = row.at("value");
            return {{"values", std::move(values)}};
        }
        if (name == "camera.set")
            return ask("PATCH", path_ + "/features" + (fields.value("force", false) ? "?force=true" : ""),
                       fields.at("values"));
        if (name == "camera.start") return {{"started", acquire(true)}};
        if (name == "camera.stop") return {{"stopped", acquire(false)}};
        if (name == "camera.trigger") return ask("POST", path_ + "/trigger", CallJson::object());
        if (name == "timing")
            return get(fmt::format("{}/timing?after={}", path_, fields.value("after", std::uint64_t{0})));
        if (name == "faults.list") return get(path_ + "/faults");
        if (name == "faults.set") return ask("PUT", path_ + "/faults", {{"rules", fields.at("rules")}});
        if (name == "scene.list") return get(path_ + "/scenes");
        if (name == "scene.show") return ask("PUT", path_ + "/scene", {{"file", fields.at("file")}});
        if (name == "configuration") return get(path_ + "/configuration");
        throw CallError("unknown-call", fmt::format("obscura {}: {} does not go over --url", verb_, name));
    }

    bool acquire(bool running) {
        return ask("POST", path_ + "/acquisition", {{"running", running}}).value("changed", false);
    }

    /// The newest state of the only daemon behind the server.
    CallJson daemon() {
        const CallJson daemons = get("/api/v1/state").at("daemons");
        if (daemons.empty())
            throw HardwareError(fmt::format("obscura {}: no daemon runs behind that address", verb_));
        if (daemons.size() > 1)
            throw UsageError(
                fmt::format("obscura {}: {} daemons run behind that address: let obscura-web ask "
                            "one by its --socket",
                            verb_, daemons.size()));
        return daemons.front();
    }

    CallAnswer frame(const CallJson& fields) {
        const auto after = fields.value("after", std::uint64_t{0});
        constexpr double longest_wait_s = 30; // that the interface takes
        const double wait_s = std::min(fields.value("wait_s", 10.0), longest_wait_s);
        // Pixels and metadata come one after the other: a newer frame may stand between them.
        constexpr int most_tries = 10;
        for (int i = 0; i < most_tries; ++i) {
            const std::string query = fmt::format("?after={}&wait={}", after, wait_s);
            const HttpAnswer raw = checked(client_.ask("GET", path_ + "/frames/latest.raw" + query));
            if (raw.status == 204)
                throw CallError("not-now", fmt::format("obscura {}: none came in {} s", verb_, wait_s));
            CallAnswer answer{parsed(checked(client_.ask("GET", path_ + "/frames/latest.json" + query)))};
            make_numbers(answer.head);
            const auto id = answer.head.at("id").get<std::uint64_t>();
            const auto tag = raw.headers.find("x-obscura-id");
            if (tag == raw.headers.end() || tag->second != std::to_string(id)) continue;
            answer.head["number"] = id;
            answer.width = answer.head.at("width").get<std::int32_t>();
            answer.height = answer.head.at("height").get<std::int32_t>();
            constexpr std::int32_t longest = 65536;
            if (answer.width < 1 || answer.height < 1 || answer.width > longest || answer.height > longest ||
                raw.body.size() !=
                    2 * static_cast<std::size_t>(answer.width) * static_cast<std::size_t>(answer.height))
                throw HardwareError(fmt::format("obscura {}: a frame of another size than it says", verb_));
            answer.pixels.resize(raw.body.size() / 2);
            std::memcpy(answer.pixels.data(), raw.body.data(), raw.body.size());
            return answer;
        }
        throw HardwareError(
            fmt::format("obscura {}: frames come faster than this connection gets them", verb_));
    }

    CallJson get(const std::string& path) { return parsed(checked(client_.ask("GET", path))); }
    CallJson ask(std::string_view method, const std::string& path, const CallJson& body) {
        return parsed(checked(client_.ask(method, path, body.dump())));
    }

    [[nodiscard]] CallJson parsed(const HttpAnswer& answer) const {
        CallJson json = CallJson::parse(answer.body, nullptr, false);
        if (json.is_object()) return json;
        throw HardwareError(fmt::format("obscura {}: what answers there is no obscura-web", verb_));
    }

    /// Throws for a refusal.
    [[nodiscard]] HttpAnswer checked(HttpAnswer answer) const {
        if (answer.status >= 200 && answer.status < 300) return answer;
        const CallJson problem = CallJson::parse(answer.body, nullptr, false);
        const bool told = problem.is_object() && problem.contains("detail") && problem["detail"].is_string();
        const std::string line = refusal_line(
            verb_, call_,
            told ? problem["detail"].get<std::string>() : fmt::format("HTTP status {}", answer.status), "");
        if (!told || answer.status == 503) throw HardwareError(line);
        throw CallError(code_of(answer, problem), line);
    }

    std::string verb_;
    std::uint32_t camera_;
    HttpClient client_;
    std::string path_;
    std::string call_; ///< in progress, for messages
};

} // namespace

std::unique_ptr<DaemonCalls> connect_by_http(std::string_view verb, HttpOptions options) {
    try {
        return std::make_unique<HttpCalls>(verb, std::move(options));
    } catch (const CallJson::exception& error) {
        throw HardwareError(fmt::format("obscura {}: the answer is not as expected: {}", verb, error.what()));
    }
}

} // namespace obscura::tools
