// SPDX-License-Identifier: Apache-2.0
// Members of JSON for the fields of a frame's record.
#pragma once

#include "core/camera/frame_record.hpp"

#include <string>
#include <variant>

namespace obscura::host {

/// Adds the fields that are members of JSON to `out`: arrays as such, enumerators by name.
template<typename Json, typename Owner>
void add_members(Json& out, const Owner& owner) {
    const auto one = [&owner](const RecordField<Owner>& field, std::size_t element) {
        if (field.text != nullptr) return Json(field.text(owner, element));
        return std::visit([](const auto& v) { return Json(v); }, field.get(owner, element));
    };
    for (const RecordField<Owner>& field : record_fields<Owner>()) {
        if (field.member.empty()) continue;
        Json& value = out[std::string(field.member)];
        if (field.count == 1) {
            value = one(field, field.first);
            continue;
        }
        value = Json::array();
        const std::size_t used = field.used != nullptr ? field.used(owner) : field.count;
        for (std::size_t i = 0; i < used; ++i)
            value.push_back(one(field, field.first + i));
    }
}

} // namespace obscura::host
