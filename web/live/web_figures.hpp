// SPDX-License-Identifier: Apache-2.0
// Counters of obscura-web itself, as metrics for Prometheus.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::web {

/// Thread-safe.
class WebFigures {
public:
    /// `route`: id of a row of the table of routes, or another word of this program; lives as long as it.
    void answered(std::string_view route, unsigned status);
    /// Bytes of answers, events and pictures that the system has taken.
    void sent(std::size_t bytes);
    /// A picture went to a viewer, who should have got `skipped` others since the one before.
    void pictured(std::uint64_t skipped);
    void viewer_joined() { add_viewers(1); }
    void viewer_left() { add_viewers(-1); }

    /// Families obscura_web_... in the text format of Prometheus.
    [[nodiscard]] std::string text() const;

private:
    void add_viewers(int more);

    mutable std::mutex mutex_; ///< of what follows
    std::map<std::pair<std::string_view, unsigned>, std::uint64_t> answers_;
    std::uint64_t bytes_ = 0, pictures_ = 0, skipped_ = 0;
    std::int64_t viewers_ = 0;
};

} // namespace obscura::web
