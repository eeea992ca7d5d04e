// SPDX-License-Identifier: Apache-2.0
// The GenICam feature table: every category, and the address of each feature's register.
#pragma once

#include "transports/gige/registers/feature.hpp"

#include <cstdint>
#include <span>
#include <string_view>

namespace obscura::transports::gige {

/// Categories in the order of Root. Static storage.
[[nodiscard]] std::span<const FeatureCategory> feature_table();

/// The row of `name`. Throws std::logic_error when there is none.
[[nodiscard]] const Feature& feature(std::string_view name);

/// Address of the register of `name` for item `index` of its selector; "WidthMin", "WidthMax" and "WidthStep"
/// name registers of limits. Throws std::logic_error when there is none.
[[nodiscard]] std::uint32_t address_of(std::string_view name, std::uint32_t index = 0);

/// Adds the registers of all rows from manufacturer_begin on to the bank of `d`.
void add_feature_registers(DeviceContext& d);

// One function per category, defined in its own file with its rows and their functions.
[[nodiscard]] FeatureCategory device_control();
[[nodiscard]] FeatureCategory image_format_control();
[[nodiscard]] FeatureCategory acquisition_control();
[[nodiscard]] FeatureCategory analog_control();
[[nodiscard]] FeatureCategory digital_io_control();
[[nodiscard]] FeatureCategory counter_and_timer_control();
[[nodiscard]] FeatureCategory sequencer_control();
[[nodiscard]] FeatureCategory chunk_data_control();
[[nodiscard]] FeatureCategory action_control();
[[nodiscard]] FeatureCategory event_control();
[[nodiscard]] FeatureCategory user_set_control();
[[nodiscard]] FeatureCategory test_control();
[[nodiscard]] FeatureCategory transport_layer_control();
[[nodiscard]] FeatureCategory gige_vision();
[[nodiscard]] FeatureCategory ptp_control();
[[nodiscard]] FeatureCategory stream_statistics();

} // namespace obscura::transports::gige
