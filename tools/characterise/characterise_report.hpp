// SPDX-License-Identifier: Apache-2.0
// Report of an EMVA 1288 characterisation as text, JSON or one self-contained HTML page.
#pragma once

#include "sensors/emva1288.hpp"
#include "tools/characterise/pattern_profiles.hpp"
#include "tools/pictures/plot.hpp"

#include <cstddef>
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

/// Signal-to-noise ratio at one level of the series.
struct SnrPoint {
    double photons = 0;
    double measured = 0;
    double total = 0; ///< measured, with the fixed pattern counted as noise
    double model = 0, total_model = 0;
};

/// Profiles of one fixed pattern.
struct PatternProfiles {
    std::string name; ///< "DSNU" or "PRNU"
    std::string unit;
    Profile horizontal, vertical;
};

struct Characterisation {
    std::string subject;
    /// Test conditions, such as {"Wavelength", "550 nm"}, in the order of the report.
    std::vector<std::pair<std::string, std::string>> conditions;
    std::vector<std::string> notes;
    std::vector<Parameter> parameters;
    std::vector<Plot> plots;
    std::vector<SnrPoint> snr; ///< of each level, in the order of the series
    std::vector<PatternProfiles> profiles;

    /// Adds a parameter without a known true value.
    Parameter& add(std::string name, double measured, std::string unit) {
        parameters.push_back({std::move(name), measured, {}, std::move(unit), 0, false});
        return parameters.back();
    }
    void add_condition(std::string name, std::string value) {
        conditions.emplace_back(std::move(name), std::move(value));
    }
    /// Brings the parameters into the order of the data sheet of EMVA 1288.
    void sort();
};

/// {"subject": text, "conditions": {name: text}, "parameters": {NAME: {"symbol": text, "label": text,
/// "measured": x, "upper_limit": true, "true": x, "unit": u, "tolerance": relative, "pass": true}}, "notes":
/// [text], "snr": {"photons": [x], "measured": [x], "total": [x], "model": [x], "total_model": [x]},
/// "profiles": {"dsnu": {"unit": u, "horizontal": {"mean": [x], "min": [x], "max": [x], "middle": [x]},
/// "vertical": {...}}, "prnu": {...}}}. "upper_limit", "true" and "pass" only where they apply; "snr" and
/// "profiles" on one line each.
[[nodiscard]] std::string to_json(const Characterisation& result);
[[nodiscard]] std::string to_html(const Characterisation& result);
[[nodiscard]] std::string to_text(const Characterisation& result);

/// Adds the plots of sensitivity, photon transfer, signal-to-noise ratio and deviation from linearity before
/// all others, and the figures of the signal-to-noise ratio. `light` is the label of the light, whose unit is
/// known if it begins with "photons".
void add_series_plots(const std::vector<sensors::emva1288::Level>& levels,
                      const sensors::emva1288::LinearModel& model,
                      const sensors::emva1288::Nonuniformity& pattern, Characterisation& result,
                      const std::string& light = "photons per pixel");
/// Adds the standard deviations of a fixed pattern over rows, columns and pixels, `name` "dsnu" or "prnu":
/// roots of `parts` times `scale`; 0 where noise exceeds the pattern.
void add_nonuniformity_parts(const std::string& name, const sensors::emva1288::SpatialVariances& parts,
                             double scale, const std::string& unit, Characterisation& result);
/// Note on a dark noise that is an upper limit.
[[nodiscard]] std::string quantisation_note();

/// Fixed pattern: deviations of the pixels' means from the mean of all, row-major.
struct PatternPlots {
    std::string name; ///< "DSNU" or "PRNU"
    const std::vector<double>& deviations;
    std::size_t width; ///< columns
    std::string unit;
    /// Standard deviation of the temporal noise that is left in the deviations, drawn beside them; 0:
    /// unknown.
    double temporal = 0;
};
/// Adds the horizontal and vertical profiles and spectrograms, the logarithmic histogram with a normal
/// distribution beside it, and the accumulated histogram of a fixed pattern.
void add_pattern_plots(const PatternPlots& pattern, Characterisation& result);

} // namespace obscura::tools
