// SPDX-License-Identifier: Apache-2.0
// Report of an EMVA 1288 characterisation as text, JSON or one self-contained HTML page.
#pragma once

#include "sensors/emva1288.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {

/// One result of the characterisation.
struct Parameter {
    std::string name;
    double measured = 0;
    std::optional<double> truth; ///< true value of a simulated sensor, if known
    std::string unit;
    double tolerance = 0;     ///< relative
    bool upper_limit = false; ///< the true value is at most `measured`

    /// True if the truth is unknown or the measurement is within the tolerance of it.
    [[nodiscard]] bool good() const;
};

/// Plot of measured points and a model curve.
struct Plot {
    std::string title, x_label, y_label;
    std::vector<std::pair<double, double>> points; ///< measured
    std::vector<std::pair<double, double>> line;   ///< model
    bool logarithmic = false;
    bool bars = false; ///< draw a histogram
};

struct Characterisation {
    std::string subject;
    std::vector<std::string> notes;
    std::vector<Parameter> parameters;
    std::vector<Plot> plots;

    /// Adds a parameter without a known true value.
    Parameter& add(std::string name, double measured, std::string unit) {
        parameters.push_back({std::move(name), measured, {}, std::move(unit), 0, false});
        return parameters.back();
    }
    /// Brings the parameters into the order of the data sheet of EMVA 1288.
    void sort();
};

/// {"subject": text, "parameters": {NAME: {"symbol": text, "measured": x, "upper_limit": true, "true": x,
/// "unit": u, "tolerance": relative}}, "notes": [text]}. "upper_limit" and "true" only where they apply.
[[nodiscard]] std::string to_json(const Characterisation& result);
[[nodiscard]] std::string to_html(const Characterisation& result);
[[nodiscard]] std::string to_text(const Characterisation& result);

/// Adds the plots of photon transfer, signal-to-noise ratio and linearity.
void add_series_plots(const std::vector<sensors::emva1288::Level>& levels,
                      const sensors::emva1288::LinearModel& model, Characterisation& result);
/// Note on a dark noise that is an upper limit.
[[nodiscard]] std::string quantisation_note();
/// Histogram of `values`, which are in `unit`.
[[nodiscard]] Plot histogram(std::string title, const std::vector<double>& values, const std::string& unit);

} // namespace obscura::tools
