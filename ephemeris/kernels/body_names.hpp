// SPDX-License-Identifier: Apache-2.0
// Names and NAIF integer codes of bodies and spacecraft.
#pragma once

#include "ephemeris/kernels/kernel_pool.hpp"

#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::ephemeris {

/// Names as in NAIF's "NAIF Integer ID Codes", and those that kernels add (NAIF_BODY_NAME, NAIF_BODY_CODE).
/// Case does not matter, nor does the number of blanks. Immutable, thread-safe.
class BodyNames {
public:
    /// The built-in names, and those of `pool`, of which the last holds.
    explicit BodyNames(const KernelPool& pool);

    /// Code of a body by name, or by the code itself as text. Empty: unknown.
    [[nodiscard]] std::optional<int> id(std::string_view name) const;
    /// Name of a body, its code as text if it has none.
    [[nodiscard]] std::string name(int id) const;
    /// Advice for a message about an unknown name.
    [[nodiscard]] std::string suggestion(std::string_view name) const;
    /// Which names of the pool are not used, and why, as one line; empty: all are.
    [[nodiscard]] const std::string& problem() const { return problem_; }

private:
    std::map<std::string, int> ids_;
    std::map<int, std::string> names_;
    std::string problem_;
};

} // namespace obscura::ephemeris
