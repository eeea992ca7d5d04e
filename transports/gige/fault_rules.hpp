// SPDX-License-Identifier: Apache-2.0
// Fault rules of a GigE Vision camera, as calls list and replace them.
#pragma once

#include "transports/fault_rules.hpp"
#include "transports/gige/channels/gvsp_sender.hpp"
#include "transports/gige/device/device.hpp"

namespace obscura::transports::gige {

/// `device` and `sender` outlive this.
class GigeFaultRules final : public FaultRules {
public:
    GigeFaultRules(Device& device, const SenderCounters& sender) : device_(device), sender_(sender) {}

    [[nodiscard]] std::vector<Kind> kinds() const override;
    [[nodiscard]] Row blank() const override;
    [[nodiscard]] std::vector<Row> armed() const override;
    [[nodiscard]] std::uint64_t newest_frame() const noexcept override {
        return sender_.stream_frames.load(std::memory_order_relaxed);
    }
    void arm(const std::vector<Row>& rows) override;

private:
    Device& device_;
    const SenderCounters& sender_;
};

} // namespace obscura::transports::gige
