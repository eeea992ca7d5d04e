// SPDX-License-Identifier: Apache-2.0
#include "tools/control/http_calls.hpp"

#include "host/command_line.hpp"
#include "tools/control/rest_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {
namespace {

static_assert(std::endian::native == std::endian::little, "raw frames are copied as they come");

/// Counts and instants that the interface writes as strings, since they may not fit a double.
void make_numbers(host::CallJson& map) {
    for (const char* const name : {"id", "number", "frame", "trigger", "edge_tai_ns", "mid_exposure_tai_ns",
                                   "row_mid_exposure_tai_ns"}) {
        const auto found = map.find(name);
        if (found == map.end() || !found->is_string()) continue;
        const std::string& text = found->get_ref<const std::string&>();
        std::int64_t value = 0;
        const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
        if (error == std::errc{} && end == text.data() + text.size()) *found = value;
    }
}

class HttpCalls final : public host::DaemonCalls {
public:
    HttpCalls(std::string_view verb, const HttpOptions& options)
        : verb_(verb), camera_(options.camera), client_(verb, options) {
        const host::CallJson state = daemon();
        for (const host::CallJson& camera : state.at("cameras"))
            ids_.push_back(camera.at("id").get<std::string>());
        choose(camera_);
    }

    [[nodiscard]] host::CallAnswer call(std::string_view name, const host::CallJson& fields) override {
        client_.set_call(name);
        choose(fields.value("camera", camera_));
        if (name == "frame") return frame(fields);
        host::CallJson answer = head(name, fields);
        make_numbers(answer);
        return {std::move(answer)};
    }

private:
    /// The camera of the paths from now on.
    void choose(std::uint32_t camera) {
        if (camera >= ids_.size())
            throw host::CallError("bad-argument",
                                  fmt::format("obscura {}: there is no camera {}, allowed 0 to {}", verb_,
                                              camera, static_cast<int>(ids_.size()) - 1));
        path_ = "/api/v1/cameras/" + ids_[camera];
    }

    host::CallJson head(std::string_view name, const host::CallJson& fields) {
        if (name == "state") return daemon();
        if (name == "events") return {{"events", client_.events(fields.value("after", std::uint64_t{0}))}};
        if (name == "camera.features") return client_.get(path_ + "/features");
        if (name == "camera.get") {
            const host::CallJson answer = client_.get(path_ + "/features");
            host::CallJson values = host::CallJson::object();
            for (const host::CallJson& row : answer.at("features"))
                values[row.at("name").get<std::string>()] = row.at("value");
            return {{"values", std::move(values)}};
        }
        if (name == "camera.set")
            return client_.ask("PATCH",
                               path_ + "/features" + (fields.value("force", false) ? "?force=true" : ""),
                               fields.at("values"));
        if (name == "camera.start") return {{"started", acquire(true)}};
        if (name == "camera.stop") return {{"stopped", acquire(false)}};
        if (name == "camera.trigger")
            return client_.ask("POST", path_ + "/trigger", host::CallJson::object());
        if (name == "timing")
            return client_.get(
                fmt::format("{}/timing?after={}", path_, fields.value("after", std::uint64_t{0})));
        if (name == "probe")
            return client_.get(
                fmt::format("{}/probe?x={}&y={}&frame={}", path_, fields.at("x").get<std::uint32_t>(),
                            fields.at("y").get<std::uint32_t>(), fields.value("frame", std::uint64_t{0})));
        if (name == "faults.list") return client_.get(path_ + "/faults");
        if (name == "faults.set")
            return client_.ask("PUT", path_ + "/faults", {{"rules", fields.at("rules")}});
        if (name == "scene.list") return client_.get(path_ + "/scenes");
        if (name == "scene.show") return client_.ask("PUT", path_ + "/scene", {{"file", fields.at("file")}});
        if (name == "configuration") return client_.get(path_ + "/configuration");
        throw host::CallError("unknown-call",
                              fmt::format("obscura {}: {} does not go over --url", verb_, name));
    }

    bool acquire(bool running) {
        return client_.ask("POST", path_ + "/acquisition", {{"running", running}}).value("changed", false);
    }

    /// The newest state of the only daemon behind the server.
    host::CallJson daemon() {
        std::vector<host::CallJson> daemons = client_.states();
        if (daemons.size() > 1)
            throw host::UsageError(fmt::format(
                "obscura {}: {} daemons run behind that address: let obscura-web ask one by its --socket",
                verb_, daemons.size()));
        return std::move(daemons.front());
    }

    host::CallAnswer frame(const host::CallJson& fields) {
        const auto after = fields.value("after", std::uint64_t{0}),
                   number = fields.value("number", std::uint64_t{0});
        constexpr double max_wait_s = 30; // that the interface takes
        const double wait_s = std::min(fields.value("wait_s", 10.0), max_wait_s);
        // Pixels and metadata come one after the other: a newer frame may stand between them.
        constexpr int max_tries = 10;
        for (int i = 0; i < max_tries; ++i) {
            const auto path = [&](const char* suffix) {
                return number != 0 ? fmt::format("{}/frames/{}.{}", path_, number, suffix)
                                   : fmt::format("{}/frames/latest.{}?after={}&wait={}", path_, suffix, after,
                                                 wait_s);
            };
            const HttpAnswer raw = client_.get_bytes(path("raw"));
            if (raw.status == 204)
                throw host::CallError("not-now", fmt::format("obscura {}: none came in {} s", verb_, wait_s));
            host::CallAnswer answer{client_.get(path("json"))};
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

    std::string verb_;
    std::uint32_t camera_;
    RestClient client_;
    std::vector<std::string> ids_; ///< of the cameras
    std::string path_;
};

} // namespace

std::unique_ptr<host::DaemonCalls> connect_by_http(std::string_view verb, const HttpOptions& options) {
    try {
        return std::make_unique<HttpCalls>(verb, options);
    } catch (const host::CallJson::exception& error) {
        throw HardwareError(fmt::format("obscura {}: the answer is not as expected: {}", verb, error.what()));
    }
}

} // namespace obscura::tools
