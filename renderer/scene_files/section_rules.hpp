// SPDX-License-Identifier: Apache-2.0
// Rules between keys that several tables of a scene file share.
#pragma once

#include "config/section.hpp"
#include "core/geometry.hpp"

#include <string_view>

namespace obscura::scene {

/// `key` is a mistake where `other` is given, too.
void exclude(const config::ReadTable& table, std::string_view key, std::string_view other);

/// The table, which the file has, is a mistake without `key`.
void require(const config::ReadTable& table, std::string_view key);

/// `key`, where it is given, must have a direction.
void require_direction(const config::ReadTable& table, Vec3 value, std::string_view key);

} // namespace obscura::scene
