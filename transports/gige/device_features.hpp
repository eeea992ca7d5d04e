// SPDX-License-Identifier: Apache-2.0
// Features of a GigE Vision camera by their GenICam names, as calls list and set them.
#pragma once

#include "core/camera/camera.hpp"
#include "transports/device_features.hpp"
#include "transports/gige/device/device.hpp"
#include "transports/gige/registers/feature.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::transports::gige {

/// Reads and writes registers by the rows of the feature table. Where a selector chooses among items, each
/// item is a feature of its own: "TriggerMode[AcquisitionStart]". Regions that are off have RegionMode only.
/// Bootstrap registers, which belong to the client, are shown and not written. Thread-bound: control thread.
/// The references outlive this.
class GigeFeatures final : public DeviceFeatures {
public:
    GigeFeatures(Device& device, const CameraControl& control) : device_(device), control_(control) {}

    [[nodiscard]] std::vector<Row> list() override;
    [[nodiscard]] std::string set(std::string_view name, const Value& value) override;

private:
    /// A feature of the table, or one item of it.
    struct Item {
        const Feature* feature = nullptr;
        std::uint32_t address = 0;
        std::string name;
    };

    [[nodiscard]] std::vector<Item> items_of(const Feature& f) const;
    [[nodiscard]] std::optional<Value> value_of(const Item& item) const;
    [[nodiscard]] std::optional<double> bound_of(const Feature& f, const FeatureBound& bound) const;
    [[nodiscard]] bool writable(const Item& item) const;
    /// Whether it is about a region that is off, but for its switch.
    [[nodiscard]] bool is_idle(const Item& item) const;

    Device& device_;
    const CameraControl& control_;
};

} // namespace obscura::transports::gige
