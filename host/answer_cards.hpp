// SPDX-License-Identifier: Apache-2.0
// Metadata of a frame that a daemon has handed out by its call `frame`, for the file that keeps it.
#pragma once

#include "images/writers/card.hpp"

#include <nlohmann/json.hpp>

namespace obscura::host {

/// `head`: of the answer. The keys are those of images::frame_cards(), times are TAI. Members of the wrong
/// type, or missing ones, are left out.
[[nodiscard]] images::Cards cards_of_answer(const nlohmann::ordered_json& head);

} // namespace obscura::host
