// The report of a characterisation: JSON for machines, one self-contained HTML page for people.
#pragma once

#include "sensors/emva1288.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {

struct Parameter {
    std::string name;
    double measured = 0;
    std::optional<double> truth; ///< what went in, where it is known
    std::string unit;
    double tolerance = 0; ///< relative

    [[nodiscard]] bool good() const;
};

/// A picture with two kinds of points.
struct Plot {
    std::string title, x_label, y_label;
    std::vector<std::pair<double, double>> points; ///< measured
    std::vector<std::pair<double, double>> line;   ///< model
    bool logarithmic = false;
    bool bars = false; ///< histogram
};

struct Characterisation {
    std::string subject;
    std::vector<std::string> notes;
    std::vector<Parameter> parameters;
    std::vector<Plot> plots;

    /// A parameter whose true value is not known.
    void add(std::string name, double measured, std::string unit) {
        parameters.push_back({std::move(name), measured, {}, std::move(unit), 0});
    }
};

/// {"parameters": {NAME: {"measured": x, "true": x, "unit": u, "tolerance": relative}}}
[[nodiscard]] std::string to_json(const Characterisation& result);
[[nodiscard]] std::string to_html(const Characterisation& result);
[[nodiscard]] std::string to_text(const Characterisation& result);

/// The plots of the photon transfer, the signal-to-noise ratio and the linearity.
void add_series_plots(const std::vector<sensors::emva1288::Level>& levels,
                      const sensors::emva1288::LinearModel& model, Characterisation& result);
/// A histogram of values in units of `unit`.
[[nodiscard]] Plot histogram(std::string title, const std::vector<double>& values, const std::string& unit);

} // namespace obscura::tools
