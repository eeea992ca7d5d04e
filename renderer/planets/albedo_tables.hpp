// SPDX-License-Identifier: Apache-2.0
// Tables [[body.albedo]] of scene files: albedo maps of a planet or terrain and how they are laid over each
// other.
#pragma once

#include "config/section.hpp"
#include "core/text/enum_names.hpp"
#include "terrain/maps/map_source.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::renderer {

constexpr std::size_t max_albedo_tables = 64; ///< of a body

/// How the numbers of an image stand for factors.
enum class AlbedoCoding : std::uint8_t { linear, srgb };
constexpr auto enum_names(AlbedoCoding /*type*/) {
    return std::array{EnumName{AlbedoCoding::linear, "linear"}, EnumName{AlbedoCoding::srgb, "srgb"}};
}

/// One table.
struct AlbedoTable {
    std::string file;
    terrain::MapKeys map; ///< place alone
    std::int32_t priority = 0;
    double feather_m = 0; ///< 0: by the pixels
    double scale = 1;
    AlbedoCoding coding = AlbedoCoding::linear;
};

/// The list of tables; `tables` must outlive it.
[[nodiscard]] config::List albedo_list(std::vector<AlbedoTable>& tables);

/// All values of the tables, as text: tables of the same text have the same factors.
[[nodiscard]] std::string identity_of(const std::vector<AlbedoTable>& tables);

} // namespace obscura::renderer
