// SPDX-License-Identifier: Apache-2.0
// Rules between keys that several tables of a scene file share.
#pragma once

#include "config/section.hpp"
#include "core/geometry.hpp"

#include <string_view>

namespace obscura::scene {

/// Reports `key` if `other` is given too.
void exclude(const config::ReadTable& table, std::string_view key, std::string_view other);

/// Reports the table, which is in the file, if `key` is missing.
void require(const config::ReadTable& table, std::string_view key);

/// Reports `key` if it is given and is a zero vector.
void require_direction(const config::ReadTable& table, Vec3 value, std::string_view key);

} // namespace obscura::scene
