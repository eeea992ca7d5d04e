// SPDX-License-Identifier: Apache-2.0
#include "web/live/web_figures.hpp"

#include <fmt/format.h>

namespace obscura::web {

void WebFigures::answered(std::string_view route, unsigned status) {
    const std::lock_guard lock(mutex_);
    ++answers_[{route, status}];
}

void WebFigures::sent(std::size_t bytes) {
    const std::lock_guard lock(mutex_);
    bytes_ += bytes;
}

void WebFigures::pictured(std::uint64_t skipped) {
    const std::lock_guard lock(mutex_);
    ++pictures_;
    skipped_ += skipped;
}

void WebFigures::add_viewers(int more) {
    const std::lock_guard lock(mutex_);
    viewers_ += more;
}

std::string WebFigures::text() const {
    const std::lock_guard lock(mutex_);
    std::string out;
    const auto family = [&out](std::string_view name, std::string_view type, std::string_view help) {
        out += fmt::format("# HELP obscura_web_{0} {1}\n# TYPE obscura_web_{0} {2}\n", name, help, type);
    };
    family("viewers", "gauge", "Viewers of live pictures.");
    out += fmt::format("obscura_web_viewers {}\n", viewers_);
    family(
        "frames_total", "counter",
        "Pictures for viewers: those sent, and frames that came at the rate that a viewer asks for and were left out.");
    out += fmt::format("obscura_web_frames_total{{outcome=\"sent\"}} {}\n"
                       "obscura_web_frames_total{{outcome=\"skipped\"}} {}\n",
                       pictures_, skipped_);
    family("bytes_total", "counter", "Bytes sent to clients.");
    out += fmt::format("obscura_web_bytes_total {}\n", bytes_);
    if (answers_.empty()) return out;
    family("requests_total", "counter", "Requests answered, by route and status.");
    for (const auto& [key, count] : answers_)
        out += fmt::format("obscura_web_requests_total{{route=\"{}\",code=\"{}\"}} {}\n", key.first,
                           key.second, count);
    return out;
}

} // namespace obscura::web
