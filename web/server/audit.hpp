// SPDX-License-Identifier: Apache-2.0
// Record of changes that were made through the web server: who, what, from which value to which.
#pragma once

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <deque>
#include <mutex>
#include <string>

namespace obscura::web {

/// A change that a daemon has made.
struct Change {
    std::string who;    ///< role and name of the token
    std::string peer;   ///< address of the client
    std::string what;   ///< id of the operation, "features.set"
    std::string camera; ///< id of the camera
    nlohmann::ordered_json before, after;
    bool forced = false; ///< although another client controls the camera
};

/// Each change is also a line of the log, which the journal keeps. Thread-safe.
class Audit {
public:
    static constexpr std::size_t most = 256; ///< that are kept

    void note(Change change);
    /// Changes with ids above `after`, oldest first, as the answer to GET audit has them. An id that has not
    /// been given yet is of another run: all are later than that.
    [[nodiscard]] nlohmann::ordered_json list(std::uint64_t after) const;

private:
    mutable std::mutex mutex_;
    std::uint64_t last_ = 0;
    std::deque<nlohmann::ordered_json> rows_;
};

} // namespace obscura::web
