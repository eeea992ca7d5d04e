// SPDX-License-Identifier: Apache-2.0
// Plots of the data sheet of EMVA 1288, release 4.
#include "tools/characterise/characterise_report.hpp"
#include "tools/characterise/spectrogram.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;
using Points = std::vector<std::pair<double, double>>;

/// Values from `low` to `high` in equal ratios.
std::vector<double> geometric(double low, double high, int count) {
    std::vector<double> out;
    for (int i = 0; i < count; ++i)
        out.push_back(low * std::pow(high / low, static_cast<double>(i) / (count - 1)));
    return out;
}

std::vector<SnrPoint> snr_of(const std::vector<emva::Level>& levels, const emva::LinearModel& m,
                             const emva::Nonuniformity& pattern) {
    std::vector<SnrPoint> out;
    for (const emva::Level& l : levels) {
        const double signal = l.bright.mean - l.dark.mean;
        const double total = l.bright.variance + std::max(0.0, l.bright.spatial_variance);
        out.push_back({l.photons, signal / std::sqrt(l.bright.variance), signal / std::sqrt(total),
                       emva::model_snr(m, l.photons), emva::model_snr(m, l.photons, pattern)});
    }
    return out;
}

Plot snr_plot(const std::vector<SnrPoint>& levels, const emva::LinearModel& m,
              const emva::Nonuniformity& pattern, const std::string& light) {
    Plot plot{"Signal-to-noise ratio", light, "SNR", true, true, {}, {}};
    PlotSeries data{"measured", Drawn::points, {}}, model{"model", Drawn::line, {}},
        all{"total", Drawn::points, {}}, all_model{"total, model", Drawn::line, {}},
        ideal{"photons alone", Drawn::dashed, {}};
    double least = m.saturation_photons;
    for (const SnrPoint& l : levels) {
        data.points.emplace_back(l.photons, l.measured);
        all.points.emplace_back(l.photons, l.total);
        if (l.photons > 0) least = std::min(least, l.photons);
    }
    const bool known = light.starts_with("photons");
    if (known) least = std::min(least, std::max(m.threshold_photons, 1e-3 * least));
    constexpr int count = 100;
    for (const double photons : geometric(least, m.saturation_photons, count)) {
        model.points.emplace_back(photons, emva::model_snr(m, photons));
        all_model.points.emplace_back(photons, emva::model_snr(m, photons, pattern));
        if (known) ideal.points.emplace_back(photons, std::sqrt(photons));
    }
    plot.series = {data, model, all, all_model};
    if (known) plot.series.push_back(ideal);
    if (known && m.threshold_photons > 0) plot.marks.push_back({m.threshold_photons, "threshold", false});
    plot.marks.push_back({m.saturation_photons, "saturation", false});
    return plot;
}

Plot deviation_plot(const std::vector<emva::Level>& levels, const emva::LinearModel& m,
                    const std::string& light) {
    Plot plot{"Deviation from linearity", light, "deviation, %", false, false, {}, {}};
    PlotSeries data{"measured, 5 to 95 % of saturation", Drawn::points, {}};
    for (const emva::Level& l : levels) {
        const double signal = l.bright.mean - l.dark.mean, share = signal / m.saturation_signal_dn;
        if (!(share > 0.05 && share < 0.95) || l.photons > m.saturation_photons) continue;
        const double line = m.linearity_offset_dn + m.linearity_slope_dn_per_photon * l.photons;
        data.points.emplace_back(l.photons, 100 * (signal / line - 1));
    }
    plot.series = {data};
    plot.marks = {{0, "", true},
                  {m.linearity_error_percent, fmt::format("LE {:.2g} %", m.linearity_error_percent), true},
                  {-m.linearity_error_percent, "", true}};
    return plot;
}

/// Points of a profile by the index of their column or row.
Points by_index(const std::vector<double>& values) {
    Points out;
    for (std::size_t i = 0; i < values.size(); ++i)
        out.emplace_back(static_cast<double>(i), values[i]);
    return out;
}

Plot profile_plot(const PatternProfiles& p, Along along) {
    const bool rows = along == Along::rows;
    const Profile& lines = rows ? p.horizontal : p.vertical;
    return {fmt::format("{} profile {}", rows ? "Horizontal" : "Vertical", p.name),
            rows ? "column" : "row",
            fmt::format("{}, {}", p.name, p.unit),
            false,
            false,
            {{"max", Drawn::line, by_index(lines.max)},
             {rows ? "middle row" : "middle column", Drawn::line, by_index(lines.middle)},
             {"mean", Drawn::line, by_index(lines.mean)},
             {"min", Drawn::line, by_index(lines.min)}},
            {}};
}

} // namespace

void add_series_plots(const std::vector<emva::Level>& levels, const emva::LinearModel& m,
                      const emva::Nonuniformity& pattern, Characterisation& result,
                      const std::string& light) {
    Plot sensitivity{"Sensitivity", light, "mean less dark, DN", false, false, {}, {}};
    Plot transfer{
        "Photon transfer", "mean less dark, DN", "temporal variance less dark, DN²", false, false, {}, {}};
    Points means, variances, response, gain;
    for (const emva::Level& l : levels) {
        const double signal = l.bright.mean - l.dark.mean;
        means.emplace_back(l.photons, signal);
        variances.emplace_back(signal, l.bright.variance - l.dark.variance);
        if (l.photons > m.saturation_photons) continue;
        response.emplace_back(l.photons, m.responsivity_dn_per_photon * l.photons);
        gain.emplace_back(signal, m.gain_dn_per_e * signal);
    }
    const std::string range = fmt::format(" over {:.0f} % of saturation", 100 * m.fit_range);
    sensitivity.series = {{"measured", Drawn::points, means}, {"fit R" + range, Drawn::line, response}};
    sensitivity.marks = {{m.saturation_photons, "saturation", false}};
    transfer.series = {{"measured", Drawn::points, variances}, {"fit K" + range, Drawn::line, gain}};
    transfer.marks = {{m.saturation_signal_dn, "saturation", false}};
    result.snr = snr_of(levels, m, pattern);
    result.plots.insert(result.plots.begin(), {sensitivity, transfer, snr_plot(result.snr, m, pattern, light),
                                               deviation_plot(levels, m, light)});
}

void add_pattern_plots(const PatternPlots& pattern, Characterisation& result) {
    const std::vector<double>& values = pattern.deviations;
    if (values.empty()) return;
    PatternProfiles profiles{pattern.name, pattern.unit, profile(values, pattern.width, Along::rows),
                             profile(values, pattern.width, Along::columns)};
    result.plots.push_back(profile_plot(profiles, Along::rows));
    result.plots.push_back(profile_plot(profiles, Along::columns));
    result.profiles.push_back(std::move(profiles));
    for (const bool along_rows : {true, false}) {
        Plot plot{fmt::format("{} spectrogram {}", along_rows ? "Horizontal" : "Vertical", pattern.name),
                  "spatial frequency, cycles per pixel",
                  fmt::format("amplitude, {}", pattern.unit),
                  false,
                  true,
                  {},
                  {}};
        plot.series = {{"", Drawn::line, spectrogram(values, pattern.width, along_rows)}};
        if (pattern.temporal > 0) plot.marks = {{pattern.temporal, "temporal noise left", true}};
        result.plots.push_back(std::move(plot));
    }
    double squares = 0, largest = 0;
    for (const double v : values)
        squares += v * v / static_cast<double>(values.size()), largest = std::max(largest, std::fabs(v));
    const double sigma = std::sqrt(squares);
    if (!(sigma > 0)) return;

    constexpr std::size_t bins = 101;
    const double step = 2 * largest / bins * 1.000001;
    std::vector<double> count(bins), beyond(bins);
    for (const double v : values) {
        ++count[static_cast<std::size_t>((v + largest) / step)];
        ++beyond[static_cast<std::size_t>(std::fabs(v) / (largest * 1.000001) * bins)];
    }
    PlotSeries bars{"pixels", Drawn::bars, {}}, normal{"normal distribution", Drawn::line, {}},
        more{"pixels beyond", Drawn::line, {}};
    const auto n = static_cast<double>(values.size());
    double sum = 0;
    for (std::size_t i = 0; i < bins; ++i) {
        const double v = -largest + (static_cast<double>(i) + 0.5) * step;
        if (count[i] > 0) bars.points.emplace_back(v, count[i]);
        const double expected =
            n * step / (sigma * std::sqrt(2 * std::acos(-1.0))) * std::exp(-0.5 * v * v / (sigma * sigma));
        if (expected >= 0.5) normal.points.emplace_back(v, expected);
    }
    for (std::size_t i = bins; i-- > 0;) {
        sum += beyond[i];
        more.points.emplace_back(static_cast<double>(i) * largest / bins, 100 * sum / n);
    }
    std::reverse(more.points.begin(), more.points.end());
    const std::string from = fmt::format("deviation from the mean, {}", pattern.unit);
    result.plots.push_back({pattern.name + " histogram", from, "pixels", false, true, {bars, normal}, {}});
    result.plots.push_back({pattern.name + " accumulated histogram",
                            "absolute " + from,
                            "pixels beyond, %",
                            false,
                            true,
                            {{"", Drawn::line, more.points}},
                            {}});
}

} // namespace obscura::tools
