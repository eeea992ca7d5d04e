// SPDX-License-Identifier: Apache-2.0
// Places of the SPK kernel of planets, Moon and Sun that is used where no kernel is named.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

namespace obscura::ephemeris {

/// Files in the order in which they are looked for: obscura/de405.bsp in the folders for data of the XDG Base
/// Directory Specification, those of the user ($XDG_DATA_HOME, ~/.local/share) and of the machine
/// ($XDG_DATA_DIRS, /usr/local/share, /usr/share).
[[nodiscard]] std::vector<std::filesystem::path> default_ephemeris_places();
/// The first of them that exists; none: there is none.
[[nodiscard]] std::optional<std::filesystem::path> find_default_ephemeris();
/// Where `obscura import ephemeris` writes it: the place of the user, for root that of the machine.
[[nodiscard]] std::filesystem::path place_of_new_default_ephemeris();

} // namespace obscura::ephemeris
