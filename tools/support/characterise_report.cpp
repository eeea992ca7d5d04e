// SPDX-License-Identifier: Apache-2.0
#include "tools/support/characterise_report.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string_view>

namespace obscura::tools {
namespace {

constexpr double width = 560, height = 340, left = 80, right = 20, top = 40, bottom = 55;

/// Quantities in the order of the data sheet of EMVA 1288, with the symbols of the standard.
struct Quantity {
    std::string_view name, symbol;
};
constexpr Quantity quantities[] = {
    {.name = "quantum_efficiency", .symbol = "eta"},
    {.name = "responsivity", .symbol = "R"},
    {.name = "gain", .symbol = "K"},
    {.name = "dark_noise_dn", .symbol = "sigma_y.dark"},
    {.name = "dark_noise", .symbol = "sigma_d"},
    {.name = "snr_max", .symbol = "SNR_max"},
    {.name = "threshold", .symbol = "mu_p.min"},
    {.name = "saturation_photons", .symbol = "mu_p.sat"},
    {.name = "saturation", .symbol = "mu_e.sat"},
    {.name = "dynamic_range", .symbol = "DR"},
    {.name = "dsnu", .symbol = "DSNU1288"},
    {.name = "prnu", .symbol = "PRNU1288"},
    {.name = "linearity_error", .symbol = "LE"},
    {.name = "dark_current", .symbol = "mu_I.mean"},
};
const Quantity* quantity(std::string_view name) {
    return std::find_if(std::begin(quantities), std::end(quantities),
                        [&](const Quantity& q) { return q.name == name; });
}
std::string_view symbol(const Parameter& p) {
    const Quantity* found = quantity(p.name);
    return found == std::end(quantities) ? std::string_view{} : found->symbol;
}

std::string escaped(const std::string& text) {
    std::string out;
    for (const char c : text)
        out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
    return out;
}

std::string svg(const Plot& plot) {
    const auto scale = [&](double v) { return plot.logarithmic ? std::log10(v) : v; };
    const auto usable = [&](std::pair<double, double> p) {
        return std::isfinite(p.first) && std::isfinite(p.second) &&
               (!plot.logarithmic || (p.first > 0 && p.second > 0));
    };
    double x0 = 1e300, x1 = -1e300, y0 = plot.logarithmic ? 1e300 : 0, y1 = -1e300;
    for (const auto* set : {&plot.points, &plot.line})
        for (const auto& p : *set)
            if (usable(p)) {
                x0 = std::min(x0, scale(p.first)), x1 = std::max(x1, scale(p.first));
                y0 = std::min(y0, scale(p.second)), y1 = std::max(y1, scale(p.second));
            }
    if (!(x1 > x0)) x0 = std::min(x0, 0.0), x1 = x0 + 1;
    if (!(y1 > y0)) y1 = y0 + 1;
    const auto px = [&](double v) { return left + (scale(v) - x0) / (x1 - x0) * (width - left - right); };
    const auto py = [&](double v) {
        return height - bottom - (scale(v) - y0) / (y1 - y0) * (height - top - bottom);
    };
    std::string out =
        fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" "
                    "font-size=\"12\"><rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>"
                    "<text x=\"{2}\" y=\"22\" font-size=\"15\">{3}</text>\n",
                    width, height, left, escaped(plot.title));
    for (int i = 0; i <= 4; ++i) {
        const double gx = left + (width - left - right) * i / 4,
                     gy = height - bottom - (height - top - bottom) * i / 4;
        const auto value = [&](double low, double high) {
            const double v = low + (high - low) * i / 4;
            return plot.logarithmic ? std::pow(10, v) : v;
        };
        out += fmt::format("<path d=\"M{0:.1f} {1}V{2}M{3} {4:.1f}H{5}\" stroke=\"#ddd\"/>"
                           "<text x=\"{0:.1f}\" y=\"{6}\" text-anchor=\"middle\">{7:.4g}</text>"
                           "<text x=\"{8}\" y=\"{9:.1f}\" text-anchor=\"end\">{10:.4g}</text>\n",
                           gx, top, height - bottom, left, gy, width - right, height - bottom + 17,
                           value(x0, x1), left - 6, gy + 4, value(y0, y1));
    }
    out += fmt::format("<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text><text x=\"15\" y=\"{}\" "
                       "transform=\"rotate(-90 15 {})\" text-anchor=\"middle\">{}</text>\n",
                       (left + width - right) / 2, height - 14, escaped(plot.x_label),
                       (top + height - bottom) / 2, (top + height - bottom) / 2, escaped(plot.y_label));
    if (!plot.line.empty()) {
        out += "<polyline fill=\"none\" stroke=\"#d62728\" points=\"";
        for (const auto& p : plot.line)
            if (usable(p)) out += fmt::format("{:.1f},{:.1f} ", px(p.first), py(p.second));
        out += "\"/>\n";
    }
    for (const auto& p : plot.points) {
        if (!usable(p)) continue;
        if (plot.bars)
            out += fmt::format("<path d=\"M{0:.1f} {1:.1f}V{2}\" stroke=\"#1f77b4\" stroke-width=\"4\"/>",
                               px(p.first), py(p.second), height - bottom);
        else
            out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" fill=\"#1f77b4\"/>", px(p.first),
                               py(p.second));
    }
    return out + "</svg>\n";
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
    using Json = nlohmann::ordered_json;
    Json parameters = Json::object();
    for (const Parameter& p : result.parameters) {
        auto& entry = parameters[p.name];
        entry["symbol"] = symbol(p);
        entry["measured"] = p.measured;
        if (p.upper_limit) entry["upper_limit"] = true;
        if (p.truth) entry["true"] = *p.truth;
        entry["unit"] = p.unit;
        entry["tolerance"] = p.tolerance;
    }
    return Json{{"subject", result.subject}, {"parameters", parameters}, {"notes", result.notes}}.dump(2) +
           "\n";
}

std::string to_text(const Characterisation& result) {
    std::string out = result.subject + "\n";
    for (const Parameter& p : result.parameters)
        out += fmt::format("  {:<13}{:<20} {:>1}{:>13.6g} {:<10} {}\n", symbol(p), p.name,
                           p.upper_limit ? "<" : "", p.measured, p.unit,
                           p.truth ? fmt::format("true {:.6g} ({:+.2f} %){}", *p.truth,
                                                 100 * (p.measured / *p.truth - 1),
                                                 p.good() ? "" : "  OUTSIDE ITS TOLERANCE")
                                   : "");
    for (const std::string& note : result.notes)
        out += "  " + note + "\n";
    return out;
}

std::string to_html(const Characterisation& result) {
    std::string out =
        fmt::format("<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{0}</title>"
                    "<style>body{{font-family:sans-serif;max-width:1180px;margin:2em auto}}"
                    "td,th{{padding:.2em 1em;text-align:right}}td:first-child{{text-align:left}}"
                    ".bad{{color:#c00}}</style></head><body>\n<h1>{0}</h1>\n"
                    "<p>Method: EMVA standard 1288, release 4, linear camera model.</p>\n"
                    "<table><tr><th>parameter</th><th>symbol</th><th>measured</th><th>true</th><th>unit</th>"
                    "<th>deviation</th></tr>\n",
                    escaped(result.subject));
    for (const Parameter& p : result.parameters)
        out += fmt::format(
            "<tr{}><td>{}</td><td>{}</td><td>{}{:.5g}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
            p.good() ? "" : " class=\"bad\"", escaped(p.name), symbol(p), p.upper_limit ? "&lt; " : "",
            p.measured, p.truth ? fmt::format("{:.5g}", *p.truth) : "", escaped(p.unit),
            p.truth ? fmt::format("{:+.2f} %", 100 * (p.measured / *p.truth - 1)) : "");
    out += "</table>\n";
    for (const std::string& note : result.notes)
        out += "<p>" + escaped(note) + "</p>\n";
    for (const Plot& plot : result.plots)
        out += svg(plot);
    return out + "</body></html>\n";
}

void add_series_plots(const std::vector<sensors::emva1288::Level>& levels,
                      const sensors::emva1288::LinearModel& m, Characterisation& result) {
    Plot transfer{"Photon transfer", "mean less dark, DN", "temporal variance less dark, DN^2", {}, {}};
    Plot snr{"Signal-to-noise ratio", "photons per pixel", "SNR", {}, {}, true};
    Plot linearity{"Linearity", "photons per pixel", "mean less dark, DN", {}, {}};
    for (const auto& l : levels) {
        const double signal = l.bright.mean - l.dark.mean;
        transfer.points.push_back({signal, l.bright.variance - l.dark.variance});
        if (l.photons <= m.saturation_photons) transfer.line.push_back({signal, m.gain_dn_per_e * signal});
        snr.points.push_back({l.photons, signal / std::sqrt(l.bright.variance)});
        const double electrons = m.quantum_efficiency * l.photons;
        const double noise = l.dark.variance / (m.gain_dn_per_e * m.gain_dn_per_e) + electrons;
        if (l.photons <= m.saturation_photons) snr.line.push_back({l.photons, electrons / std::sqrt(noise)});
        linearity.points.push_back({l.photons, signal});
        if (l.photons <= m.saturation_photons)
            linearity.line.push_back({l.photons, m.responsivity_dn_per_photon * l.photons});
    }
    result.plots.insert(result.plots.end(), {transfer, snr, linearity});
}

std::string quantisation_note() {
    return fmt::format(
        "The temporal dark noise is below {} DN^2, where quantisation hides it: its upper limit "
        "is given, {} DN and 0.40 DN / K.",
        sensors::emva1288::least_variance_dn2, sensors::emva1288::limit_of_noise_dn);
}

Plot histogram(std::string title, const std::vector<double>& values, const std::string& unit) {
    Plot plot{std::move(title), unit, "pixels", {}, {}, false, true};
    if (values.empty()) return plot;
    std::vector<double> sorted(values);
    std::sort(sorted.begin(), sorted.end());
    // Leave out the outermost pixels: outliers would compress all others into one bar.
    const double low = sorted[sorted.size() / 1000], high = sorted[sorted.size() - 1 - sorted.size() / 1000];
    constexpr std::size_t bins = 100;
    std::vector<double> count(bins);
    const double step = std::max(high - low, 1e-12) / bins;
    for (const double v : sorted)
        if (v >= low && v <= high) ++count[std::min(bins - 1, static_cast<std::size_t>((v - low) / step))];
    for (std::size_t b = 0; b < bins; ++b)
        plot.points.push_back({low + (static_cast<double>(b) + 0.5) * step, count[b]});
    return plot;
}

} // namespace obscura::tools
