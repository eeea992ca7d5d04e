// SPDX-License-Identifier: Apache-2.0
// Epoch of a scene whose file is being read.
#pragma once

#include "ephemeris/time/epoch.hpp"

#include <memory>
#include <optional>
#include <string>

namespace obscura::scene {

/// The key `epoch`: keys of a file are read before its tables, which may need the instant, and checked after
/// them.
struct SceneEpoch {
    std::string text;                        ///< empty: none
    std::optional<ephemeris::Epoch> given{}; ///< instead of the text: of a scene that was read before

    /// The instant; none without a text. Throws ConfigError if the text is no time.
    [[nodiscard]] std::optional<ephemeris::Epoch> get() const;
    /// The instant, for the file `dated`. Throws ConfigError if there is none. A text that is no time gives
    /// any instant: the check of the key reports it.
    [[nodiscard]] ephemeris::Epoch required(const std::string& dated) const;
};
using SharedEpoch = std::shared_ptr<const SceneEpoch>;

} // namespace obscura::scene
