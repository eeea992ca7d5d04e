// SPDX-License-Identifier: Apache-2.0
#include "sensors/poisson_table.hpp"

#include <algorithm>

namespace obscura::sensors {

PoissonTable::PoissonTable() noexcept : guide{} {
    constexpr double inverse_e = 0.36787944117144233;
    for (std::int32_t q = 0; q < means; ++q) {
        // Multiply instead of calling exp(): the same table on every platform.
        double p = 1;
        for (std::int32_t i = 0; i < q; ++i)
            p *= inverse_e;
        double cumulated = 0;
        std::int32_t* const row = threshold.data() + q * counts;
        for (std::int32_t k = 0; k < counts; ++k) {
            cumulated += p;
            p *= static_cast<double>(q) / (k + 1);
            const double scaled = std::min(cumulated * 0x1p32, 0x1p32 - 1);
            const bool last = k == counts - 1;
            row[k] = static_cast<std::int32_t>((last ? 0xFFFFFFFFU : static_cast<std::uint32_t>(scaled)) ^
                                               0x80000000U);
        }
        std::int32_t k = 0;
        for (std::uint32_t byte = 0; byte < 256; ++byte) {
            const auto word = static_cast<std::int32_t>((byte << 24) ^ 0x80000000U);
            while (k < counts - 1 && word >= row[k])
                ++k;
            guide[static_cast<std::size_t>(q) * 256 + byte] = static_cast<std::uint8_t>(k);
        }
    }
}

const PoissonTable& PoissonTable::get() noexcept {
    static const PoissonTable table;
    return table;
}

} // namespace obscura::sensors
