// SPDX-License-Identifier: Apache-2.0
#include "instrument/link/daemon_link.hpp"

#include <obscura_client.hpp>

#include <string>
#include <string_view>
#include <utility>

namespace obscura::instrument {
namespace {

using client::Map;
using client::ValueView;

/// Longest silence of the daemon, whose main thread answers ten times a second.
constexpr double call_timeout_s = 10;
/// The daemon gives a frame up after 60 s.
constexpr double trigger_timeout_s = 75;

LinkError link_error(const client::Error& error) {
    return {error.code.empty() ? "connection-lost" : error.code, error.field, error.what()};
}

/// The number that stands in the map, as a whole one.
std::uint64_t count_in(ValueView map, const char* name) {
    const auto value = map[name].as<std::int64_t>(0);
    return value < 0 ? 0 : static_cast<std::uint64_t>(value);
}

FeatureValue value_of(ValueView value, std::string_view type) {
    switch (value.type()) {
    case OBSCURA_BOOL:
        return value.as(false);
    case OBSCURA_INT:
    case OBSCURA_NUMBER:
        if (type == "integer") return value.as<std::int64_t>(0);
        return value.as(0.0);
    default:
        return value.string();
    }
}

Latency latency_of(ValueView map, std::string_view name) {
    return {std::string(name), map["count"].as(0.0), map["p50"].as(0.0), map["p99"].as(0.0),
            map["max"].as(0.0)};
}

CameraState camera_of(ValueView map) {
    CameraState camera;
    camera.acquiring = map["acquiring"].as(false);
    camera.trigger_ready = map["trigger_ready"].as(false);
    camera.controller = map["controller"].string();
    camera.health = map["verdict"]["health"].string();
    camera.verdict = map["verdict"]["text"].string();
    camera.clock = map["clock"]["state"].string();
    camera.frame_id = count_in(map, "frame_id");
    const ValueView counters = map["camera"];
    for (std::size_t i = 0; i < counters.size(); ++i) {
        const std::string name(counters.name(i));
        if (counters[i].type() == OBSCURA_INT)
            camera.counters.emplace_back(name, counters[i].as<std::int64_t>(0));
    }
    const ValueView missed = counters["missed_because"];
    for (std::size_t i = 0; i < missed.size(); ++i)
        camera.counters.emplace_back("missed_" + std::string(missed.name(i)), missed[i].as<std::int64_t>(0));
    const ValueView latencies = map["latency_us"];
    for (std::size_t i = 0; i < latencies.size(); ++i)
        camera.latencies.push_back(latency_of(latencies[i], latencies.name(i)));
    return camera;
}

} // namespace

/// A connection that comes back.
class DaemonLink::Connection {
public:
    Connection(const DaemonAddress& address, double timeout_s) : address_(address), timeout_s_(timeout_s) {}

    /// The client, connected. Throws LinkError.
    client::Client& client() {
        try {
            if (!client_)
                client_.emplace(client::connect(address_.address.empty() ? address_.find() : address_.address,
                                                timeout_s_, address_.token_file));
        } catch (const client::Error& error) {
            throw link_error(error);
        }
        return *client_;
    }
    /// The answer of a call. `fields`: makes its fields. `once`: it is not made once more on a new
    /// connection. Throws LinkError.
    template<typename Fields>
    client::Answer call(const char* name, const Fields& fields, bool once = false) {
        for (bool again = client_.has_value() && !once;; again = false) {
            try {
                return client().call(name, fields());
            } catch (const client::ConnectionLost& error) {
                client_.reset();
                if (!again) throw link_error(error);
            } catch (const client::Error& error) {
                throw link_error(error);
            }
        }
    }
    void close() { client_.reset(); }

private:
    const DaemonAddress& address_;
    const double timeout_s_;
    std::optional<client::Client> client_;
};

DaemonLink::DaemonLink(DaemonAddress address)
    : address_(std::move(address)),
      calls_(std::make_unique<Connection>(address_, call_timeout_s)),
      triggers_(std::make_unique<Connection>(address_, trigger_timeout_s)) {}

DaemonLink::~DaemonLink() = default;

DaemonState DaemonLink::state() {
    const client::Answer answer = calls_->call("state", [] { return Map(); });
    DaemonState state;
    // In containers each run may have the same number.
    const ValueView daemon = answer.map()["daemon"];
    // It has no cameras yet: as one that is not there.
    if (const ValueView starting = daemon["starting"]; !starting.is_nil())
        throw LinkError("connection-lost", "", "the daemon is " + starting["text"].string());
    state.run = std::to_string(daemon["pid"].as<std::int64_t>(0)) + ' ' + daemon["started_utc_ns"].string();
    state.version = answer.map()["daemon"]["version"].string();
    const ValueView cameras = answer.map()["cameras"];
    for (std::size_t i = 0; i < cameras.size(); ++i)
        state.cameras.push_back(camera_of(cameras[i]));
    return state;
}

std::vector<Feature> DaemonLink::features(std::uint32_t camera) {
    const client::Answer answer = calls_->call("camera.features", [camera] {
        return Map{{"camera", camera}};
    });
    std::vector<Feature> features;
    const ValueView rows = answer.map()["features"];
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const ValueView row = rows[i];
        features.push_back({row["name"].string(), row["unit"].string(), row["allowed"].string(),
                            row["help"].string(), value_of(row["value"], row["type"].string())});
    }
    return features;
}

void DaemonLink::set(std::uint32_t camera, const std::string& feature, const FeatureValue& value) {
    (void)calls_->call("camera.set", [&] {
        Map values;
        values.put(feature.c_str(), std::visit([](const auto& one) { return client::Value(one); }, value));
        return Map{{"camera", camera}, {"values", std::move(values)}};
    });
}

void DaemonLink::start(std::uint32_t camera) {
    (void)calls_->call("camera.start", [camera] { return Map{{"camera", camera}}; });
}

void DaemonLink::stop(std::uint32_t camera) {
    (void)calls_->call("camera.stop", [camera] { return Map{{"camera", camera}}; });
}

void DaemonLink::begin_trigger(std::uint32_t camera) {
    try {
        triggers_->client().begin("camera.trigger", Map{{"camera", camera}});
        pending_ = true;
    } catch (const client::Error& error) {
        triggers_->close();
        throw link_error(error);
    }
}

std::optional<TriggerResult> DaemonLink::trigger_result(double wait_s) {
    try {
        const std::optional<client::Answer> answer = triggers_->client().wait(wait_s);
        if (!answer) return std::nullopt;
        pending_ = false;
        const ValueView map = answer->map();
        return TriggerResult{map["outcome"].string(), count_in(map, "frame"), count_in(map, "late_rows"),
                             map["edge_tai_ns"].as<std::int64_t>(0), map["seconds"].as(0.0)};
    } catch (const client::Error& error) {
        pending_ = false;
        if (dynamic_cast<const client::ConnectionLost*>(&error) != nullptr) triggers_->close();
        throw link_error(error);
    }
}

TimingAnswer DaemonLink::timing(std::uint32_t camera, std::uint64_t after) {
    constexpr int most = 256;
    const client::Answer answer = calls_->call(
        "timing",
        [&] {
            return Map{
                {"camera", camera}, {"after", after}, {"most", most}, {"early", true}, {"saturated", true}};
        },
        true);
    const ValueView map = answer.map();
    TimingAnswer timing;
    timing.last = count_in(map, "last");
    if (map["tai_offset_ns"].type() == OBSCURA_INT)
        timing.tai_offset_ns = map["tai_offset_ns"].as<std::int64_t>(0);
    const ValueView columns = map["columns"], rows = map["rows"];
    for (std::size_t i = 0; i < columns.size(); ++i)
        timing.columns.push_back(columns[i].string());
    for (std::size_t i = 0; i < rows.size(); ++i) {
        auto& row = timing.rows.emplace_back();
        for (std::size_t j = 0; j < rows[i].size(); ++j)
            row.push_back(rows[i][j].type() == OBSCURA_INT ? std::optional(rows[i][j].as<std::int64_t>(0))
                                                           : std::nullopt);
    }
    return timing;
}

} // namespace obscura::instrument
