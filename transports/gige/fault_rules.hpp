// SPDX-License-Identifier: Apache-2.0
// Fault rules of a GigE Vision camera, as calls list and replace them.
#pragma once

#include "transports/fault_rules.hpp"
#include "transports/gige/device/device.hpp"

namespace obscura::transports::gige {

/// `device` outlives this.
class GigeFaultRules final : public FaultRules {
public:
    explicit GigeFaultRules(Device& device) : device_(device) {}

    [[nodiscard]] std::vector<Kind> kinds() const override;
    [[nodiscard]] Row blank() const override;
    [[nodiscard]] std::vector<Row> armed() const override;
    void arm(const std::vector<Row>& rows) override;

private:
    Device& device_;
};

} // namespace obscura::transports::gige
