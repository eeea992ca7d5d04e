// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/characterise_report.hpp"

#include "core/text/text.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string_view>

namespace obscura::tools {
namespace {

/// Quantities in the order of the data sheet of EMVA 1288, with the names and symbols of the standard.
struct Quantity {
    std::string_view name, symbol, html, label;
};
constexpr Quantity quantities[] = {
    {.name = "quantum_efficiency", .symbol = "eta", .html = "η", .label = "Quantum efficiency"},
    {.name = "responsivity", .symbol = "R", .html = "R", .label = "Responsivity"},
    {.name = "gain", .symbol = "K", .html = "K", .label = "Overall system gain"},
    {.name = "dark_noise_dn",
     .symbol = "sigma_y.dark",
     .html = "σ<sub>y.dark</sub>",
     .label = "Temporal dark noise in DN"},
    {.name = "dark_noise", .symbol = "sigma_d", .html = "σ<sub>d</sub>", .label = "Temporal dark noise"},
    {.name = "snr_max",
     .symbol = "SNR_max",
     .html = "SNR<sub>max</sub>",
     .label = "Maximum signal-to-noise ratio"},
    {.name = "threshold",
     .symbol = "mu_p.min",
     .html = "μ<sub>p.min</sub>",
     .label = "Absolute sensitivity threshold"},
    {.name = "saturation_photons",
     .symbol = "mu_p.sat",
     .html = "μ<sub>p.sat</sub>",
     .label = "Saturation irradiation"},
    {.name = "saturation", .symbol = "mu_e.sat", .html = "μ<sub>e.sat</sub>", .label = "Saturation capacity"},
    {.name = "dynamic_range", .symbol = "DR", .html = "DR", .label = "Dynamic range"},
    {.name = "dsnu",
     .symbol = "DSNU1288",
     .html = "DSNU<sub>1288</sub>",
     .label = "Dark signal nonuniformity"},
    {.name = "dsnu_row",
     .symbol = "DSNU1288.row",
     .html = "DSNU<sub>1288.row</sub>",
     .label = "Dark signal nonuniformity from row to row"},
    {.name = "dsnu_column",
     .symbol = "DSNU1288.col",
     .html = "DSNU<sub>1288.col</sub>",
     .label = "Dark signal nonuniformity from column to column"},
    {.name = "dsnu_pixel",
     .symbol = "DSNU1288.pixel",
     .html = "DSNU<sub>1288.pixel</sub>",
     .label = "Dark signal nonuniformity from pixel to pixel"},
    {.name = "prnu",
     .symbol = "PRNU1288",
     .html = "PRNU<sub>1288</sub>",
     .label = "Photo response nonuniformity"},
    {.name = "prnu_row",
     .symbol = "PRNU1288.row",
     .html = "PRNU<sub>1288.row</sub>",
     .label = "Photo response nonuniformity from row to row"},
    {.name = "prnu_column",
     .symbol = "PRNU1288.col",
     .html = "PRNU<sub>1288.col</sub>",
     .label = "Photo response nonuniformity from column to column"},
    {.name = "prnu_pixel",
     .symbol = "PRNU1288.pixel",
     .html = "PRNU<sub>1288.pixel</sub>",
     .label = "Photo response nonuniformity from pixel to pixel"},
    {.name = "linearity_error", .symbol = "LE", .html = "LE", .label = "Linearity error"},
    {.name = "dark_current", .symbol = "mu_I.mean", .html = "μ<sub>I.mean</sub>", .label = "Dark current"},
};
const Quantity* quantity(std::string_view name) {
    return std::find_if(std::begin(quantities), std::end(quantities),
                        [&](const Quantity& q) { return q.name == name; });
}
/// The row of `p`, or one that states nothing but its name.
Quantity row_of(const Parameter& p) {
    const Quantity* found = quantity(p.name);
    return found == std::end(quantities) ? Quantity{p.name, "", "", p.name} : *found;
}

std::string unit_html(const std::string& unit) {
    std::string out = escaped_xml(unit);
    if (const auto at = out.find("e-"); at != std::string::npos) out.replace(at, 2, "e<sup>−</sup>");
    return out;
}

/// "pass", "FAIL" or nothing, for a parameter without a true value.
std::string_view verdict(const Parameter& p) {
    return !p.truth ? "" : p.good() ? "pass" : "FAIL";
}

/// One sentence on the parameters that have a true value; empty if none has.
std::string summary(const Characterisation& result) {
    std::size_t compared = 0, passed = 0;
    for (const Parameter& p : result.parameters)
        if (p.truth) ++compared, passed += p.good() ? 1U : 0U;
    if (compared == 0) return {};
    return fmt::format("{}: {} of {} results that have a true value are within their tolerance",
                       passed == compared ? "PASS" : "FAIL", passed, compared);
}

using Json = nlohmann::ordered_json;

Json profile_json(const Profile& p) {
    return {{"mean", p.mean}, {"min", p.min}, {"max", p.max}, {"middle", p.middle}};
}

Json snr_json(const std::vector<SnrPoint>& points) {
    Json out = Json::object();
    const auto column = [&](const char* name, double SnrPoint::*value) {
        for (const SnrPoint& p : points)
            out[name].push_back(p.*value);
    };
    column("photons", &SnrPoint::photons);
    column("measured", &SnrPoint::measured);
    column("total", &SnrPoint::total);
    column("model", &SnrPoint::model);
    column("total_model", &SnrPoint::total_model);
    return out;
}

} // namespace

bool Parameter::good() const {
    if (truth && upper_limit) return *truth <= (1 + tolerance) * measured;
    return !truth || std::fabs(measured - *truth) <= tolerance * std::fabs(*truth);
}

void Characterisation::sort() {
    std::stable_sort(parameters.begin(), parameters.end(), [](const Parameter& a, const Parameter& b) {
        return quantity(a.name) < quantity(b.name);
    });
}

std::string to_json(const Characterisation& result) {
    Json parameters = Json::object();
    for (const Parameter& p : result.parameters) {
        auto& entry = parameters[p.name];
        entry["symbol"] = row_of(p).symbol;
        entry["label"] = row_of(p).label;
        entry["measured"] = p.measured;
        if (p.upper_limit) entry["upper_limit"] = true;
        if (p.truth) entry["true"] = *p.truth;
        entry["unit"] = p.unit;
        entry["tolerance"] = p.tolerance;
        if (p.truth) entry["pass"] = p.good();
    }
    Json conditions = Json::object();
    for (const auto& [name, value] : result.conditions)
        conditions[name] = value;
    Json profiles = Json::object();
    for (const PatternProfiles& p : result.profiles) {
        std::string name = p.name;
        std::transform(name.begin(), name.end(), name.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        profiles[name] = {{"unit", p.unit},
                          {"horizontal", profile_json(p.horizontal)},
                          {"vertical", profile_json(p.vertical)}};
    }
    std::string text = Json{
        {"subject", result.subject},
        {"conditions", conditions},
        {"parameters", parameters},
        {"notes",
         result.notes}}.dump(2);
    // Thousands of numbers, which do not have a line each.
    text.resize(text.size() - 2); // "\n}"
    if (!result.snr.empty()) text += ",\n  \"snr\": " + snr_json(result.snr).dump();
    if (!result.profiles.empty()) text += ",\n  \"profiles\": " + profiles.dump();
    return text + "\n}\n";
}

std::string to_text(const Characterisation& result) {
    std::string out = result.subject + "\n";
    for (const Parameter& p : result.parameters)
        out += fmt::format("  {:<15}{:<20} {:>1}{:>13.6g} {:<10} {}\n", row_of(p).symbol, p.name,
                           p.upper_limit ? "<" : "", p.measured, p.unit,
                           p.truth ? fmt::format("true {:.6g} ({:+.2f} %) {}", *p.truth,
                                                 100 * (p.measured / *p.truth - 1),
                                                 p.good() ? "pass" : "OUTSIDE ITS TOLERANCE")
                                   : "");
    if (const std::string verdicts = summary(result); !verdicts.empty()) out += "  " + verdicts + "\n";
    for (const auto& [name, value] : result.conditions)
        out += fmt::format("  {}: {}\n", name, value);
    for (const std::string& note : result.notes)
        out += "  " + note + "\n";
    return out;
}

std::string to_html(const Characterisation& result) {
    std::string out = fmt::format(
        "<!DOCTYPE html>\n"
        "<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title><style>body{{font-family:sans-serif;max-width:1180px;margin:2em auto;color:#222}}table{{border-collapse:collapse;margin:.5em 0 1.5em}}td,th{{padding:.25em 1em;text-align:right;border-bottom:1px solid #ddd}}td:first-child,th:first-child{{text-align:left}}table.conditions td{{text-align:left}}.good{{color:#070}}.bad{{color:#c00;font-weight:bold}}</style></head><body>\n"
        "<h1>{0}</h1>\n",
        escaped_xml(result.subject));
    if (const std::string verdicts = summary(result); !verdicts.empty())
        out += fmt::format("<p class=\"{}\"><b>{}.</b></p>\n", verdicts.starts_with("PASS") ? "good" : "bad",
                           verdicts);
    out +=
        "<h2>Test conditions</h2>\n"
        "<table class=\"conditions\"><tr><td>Method</td><td>EMVA standard 1288, release 4, linear camera model</td></tr>\n";
    for (const auto& [name, value] : result.conditions)
        out += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped_xml(name), escaped_xml(value));
    out +=
        "</table>\n"
        "<h2>Results</h2>\n"
        "<table><tr><th>quantity</th><th>symbol</th><th>measured</th><th>unit</th><th>true value</th><th>deviation</th><th>tolerance</th><th>verdict</th></tr>\n";
    for (const Parameter& p : result.parameters)
        out += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{}{:.5g}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td class=\"{}\">{}</td></tr>\n",
            row_of(p).label, row_of(p).html, p.upper_limit ? "&lt; " : "", p.measured, unit_html(p.unit),
            p.truth ? fmt::format("{:.5g}", *p.truth) : "",
            p.truth ? fmt::format("{:+.2f} %", 100 * (p.measured / *p.truth - 1)) : "",
            p.truth ? fmt::format("{:.3g} %", 100 * p.tolerance) : "", p.good() ? "good" : "bad", verdict(p));
    out += "</table>\n";
    for (const std::string& note : result.notes)
        out += "<p>" + escaped_xml(note) + "</p>\n";
    out += "<h2>Plots</h2>\n";
    for (const Plot& plot : result.plots)
        out += svg(plot);
    return out + "</body></html>\n";
}

void add_nonuniformity_parts(const std::string& name, const sensors::emva1288::SpatialVariances& parts,
                             double scale, const std::string& unit, Characterisation& result) {
    const auto add = [&](const char* part, double variance) {
        result.add(name + part, scale * std::sqrt(std::max(0.0, variance)), unit);
    };
    add("_row", parts.row);
    add("_column", parts.column);
    add("_pixel", parts.pixel);
}

std::string quantisation_note() {
    return fmt::format(
        "The temporal dark noise is below {} DN^2, where quantisation hides it: its upper limit is given, {} DN and 0.40 DN / K.",
        sensors::emva1288::min_variance_dn2, sensors::emva1288::limit_of_noise_dn);
}

} // namespace obscura::tools
