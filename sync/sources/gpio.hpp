// SPDX-License-Identifier: Apache-2.0
// Trigger source "gpio": edges of a GPIO line.
#pragma once

#include "sync/inputs/gpio_input.hpp"
#include "sync/source_kind.hpp"

#include <string>

namespace obscura::sync {

/// Makes an EdgeTrigger on a GPIO line.
class GpioKind final : public SourceKindOf<GpioKind> {
public:
    static constexpr SourceTraits description{.name = "gpio", .help = "edges of a GPIO line"};

    std::string line; ///< name, or chip and offset; see parse_gpio_line()
    GpioEdge edge = GpioEdge::rising;

    [[nodiscard]] config::Keys keys() override;
    void check(const TriggerLineSettings& camera_line, const Refuse& refuse) const override;
    [[nodiscard]] LineEdges edges() const override;
    [[nodiscard]] std::unique_ptr<TriggerSource> make(const TriggerLineSettings& camera_line,
                                                      const Clock& clock,
                                                      const ThreadSettings& thread) const override;

    bool operator==(const GpioKind&) const = default;
};

} // namespace obscura::sync
