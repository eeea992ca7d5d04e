// SPDX-License-Identifier: Apache-2.0
// Metrics of running daemons in the text format of Prometheus.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include <span>
#include <string>

namespace obscura::host {

/// Exposition in text format 0.0.4 (https://prometheus.io/docs/instrumenting/exposition_formats) of the
/// answers to the call `state`, one for each daemon, whose configuration's path is the label `config`, with
/// its process's number as `pid` where several have one configuration; that of a camera is its number. All
/// values of a daemon are of one moment. Counters that an answer lacks, one of another version, are left out.
/// At most some 250 series a camera.
[[nodiscard]] std::string metrics_text(std::span<const nlohmann::ordered_json> states);

} // namespace obscura::host
