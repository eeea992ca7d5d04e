// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/characterise_series.hpp"

#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "tools/receive/emva_series.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <vector>

namespace obscura::tools {
namespace {

namespace emva = sensors::emva1288;

/// Fixed pattern of images under one illumination.
struct Pattern {
    emva::ImageStack images;
    double variance = 0;   ///< spatial variance in DN^2, corrected for temporal noise
    double background = 0; ///< mean of the dark images of the same exposure time; only for bright images
    std::string source;
    emva::SpatialVariances parts{}; ///< of the variance

    void correct(double temporal, const EmvaFormat& format) {
        variance = images.spatial_variance(temporal);
        parts = images.spatial_parts(static_cast<std::size_t>(format.width), temporal);
    }
};

struct DarkSignal {
    emva::Line variance, mean; ///< against the exposure time in ns
};

/// Dark signal against exposure time; needs 3 exposure times (sections 6.6 and 7).
std::optional<DarkSignal> dark_signal(const EmvaSeries& series) {
    if (series.dark.size() < 3) return std::nullopt;
    std::vector<double> times, means, variances;
    for (const EmvaDarkPair& d : series.dark) {
        times.push_back(d.exposure_ns);
        means.push_back(d.pair.mean);
        variances.push_back(d.pair.variance);
    }
    return DarkSignal{emva::fit_line(times, variances), emva::fit_line(times, means)};
}

/// The measurement of `choices` that is nearest to `photons`.
const EmvaMeasurement* nearest(const std::vector<const EmvaMeasurement*>& choices, double photons) {
    const auto found = std::min_element(choices.begin(), choices.end(), [&](const auto* a, const auto* b) {
        return std::fabs(a->photons - photons) < std::fabs(b->photons - photons);
    });
    return found == choices.end() ? nullptr : *found;
}

Pattern stack_pattern(const EmvaSeries& series, const EmvaMeasurement& stack) {
    Pattern result{series.stack(stack), 0, 0, fmt::format("a stack of {} images", stack.images.size())};
    result.correct(result.images.temporal_variance(), series.format);
    return result;
}

/// Dark pattern from all dark pairs: their mean exposure time is about that of 50 % of saturation. The
/// temporal variance is that of the pairs, free of the drift from pair to pair.
Pattern dark_pattern_of_pairs(const EmvaSeries& series) {
    Pattern result{series.stack(series.dark_pairs.front()), 0, 0,
                   fmt::format("{} dark pairs", series.dark_pairs.size())};
    double temporal = 0;
    for (std::size_t i = 0; i < series.dark.size(); ++i) {
        if (i > 0) series.add_images(series.dark_pairs[i], result.images);
        temporal += series.dark[i].pair.variance / static_cast<double>(series.dark.size());
    }
    result.correct(temporal, series.format);
    return result;
}

/// Pattern of the bright pair nearest to `photons`.
Pattern bright_pattern_of_pair(const EmvaSeries& series, double photons) {
    std::vector<const EmvaMeasurement*> pairs;
    for (const EmvaMeasurement& pair : series.bright_pairs)
        pairs.push_back(&pair);
    const EmvaMeasurement* pair = nearest(pairs, photons);
    const emva::Level& level = series.levels[static_cast<std::size_t>(pair - series.bright_pairs.data())];
    Pattern result{series.stack(*pair), 0, level.dark.mean, "a bright pair"};
    result.correct(level.bright.variance, series.format);
    return result;
}

/// Adds DSNU1288 and PRNU1288 with their plots, and returns them.
emva::Nonuniformity add_nonuniformity(const EmvaSeries& series, const emva::LinearModel& m,
                                      Characterisation& result) {
    emva::Nonuniformity found;
    std::vector<const EmvaMeasurement*> bright_stacks, dark_stacks;
    for (const EmvaMeasurement& stack : series.stacks)
        (stack.photons > 0 ? bright_stacks : dark_stacks).push_back(&stack);
    const EmvaMeasurement* bright_stack = nearest(bright_stacks, m.saturation_photons / 2);
    const EmvaMeasurement* dark_stack = dark_stacks.empty() ? nullptr : dark_stacks.front();
    for (const EmvaMeasurement* stack : dark_stacks)
        if (bright_stack != nullptr && stack->exposure_ns == bright_stack->exposure_ns) dark_stack = stack;
    const Pattern dark =
        dark_stack != nullptr ? stack_pattern(series, *dark_stack) : dark_pattern_of_pairs(series);
    Pattern bright = bright_stack != nullptr ? stack_pattern(series, *bright_stack)
                                             : bright_pattern_of_pair(series, m.saturation_photons / 2);
    if (bright_stack != nullptr) {
        bright.background = dark.images.mean();
        const auto measured = series.dark_at(bright_stack->exposure_ns);
        const bool same = dark_stack != nullptr && dark_stack->exposure_ns == bright_stack->exposure_ns;
        if (!same && measured) bright.background = measured->mean;
    }
    const double response = bright.images.mean() - bright.background;
    result.notes.push_back(
        fmt::format("DSNU1288 was measured from {}, PRNU1288 from {} at {:.0f} % of the saturation.{}",
                    dark.source, bright.source, 100 * response / m.saturation_signal_dn,
                    dark_stack == nullptr || bright_stack == nullptr
                        ? " The standard wants stacks of images, in the dark and at 50 %."
                        : ""));

    if (dark.variance >= 0) {
        found.dsnu_e = std::sqrt(dark.variance) / m.gain_dn_per_e;
        result.add("dsnu", found.dsnu_e, "e-");
        add_nonuniformity_parts("dsnu", dark.parts, 1 / m.gain_dn_per_e, "e-", result);
    } else
        result.notes.push_back("DSNU1288 is hidden by temporal noise.");
    const double pattern = bright.variance - std::max(0.0, dark.variance);
    if (pattern >= 0 && response > 0) {
        found.prnu = std::sqrt(pattern) / response;
        result.add("prnu", 100 * found.prnu, "%");
        add_nonuniformity_parts("prnu", bright.parts - dark.parts, 100 / response, "%", result);
    } else
        result.notes.push_back("PRNU1288 is hidden by temporal noise.");

    std::vector<double> dark_values(dark.images.pixels()), bright_values(bright.images.pixels());
    const double dark_level = dark.images.mean(), mean = bright.images.mean() - dark_level;
    for (std::size_t i = 0; i < dark_values.size(); ++i) {
        dark_values[i] = (dark.images.pixel(i) - dark_level) / m.gain_dn_per_e;
        bright_values[i] = 100 * ((bright.images.pixel(i) - dark.images.pixel(i)) / mean - 1);
    }
    const auto columns = static_cast<std::size_t>(series.format.width);
    add_pattern_plots({"DSNU", dark_values, columns, "e-", 0}, result);
    add_pattern_plots({"PRNU", bright_values, columns, "%", 0}, result);
    return found;
}

} // namespace

Characterisation characterise_series(const std::filesystem::path& folder_or_descriptor) {
    const EmvaSeries series = read_emva_series(folder_or_descriptor);
    const std::optional<DarkSignal> dark = dark_signal(series);
    Characterisation result;
    const std::filesystem::path folder = absolute_path(series.descriptor).parent_path();
    result.subject = fmt::format("series {}, {} levels, {} exposure times in the dark, {} stacks",
                                 folder.filename().string(), series.levels.size(), series.dark.size(),
                                 series.stacks.size());
    emva::LinearModel m;
    try {
        m = emva::evaluate(series.levels, emva::Method::standard,
                           dark ? std::max(0.0, dark->variance.offset) : series.dark.front().pair.variance);
    } catch (const std::invalid_argument& error) {
        // What was left out is why levels are missing.
        throw InputError(fmt::format("{}: {}{}{}", series.descriptor.string(), error.what(),
                                     series.notes.empty() ? "" : "; ", fmt::join(series.notes, " ")));
    }
    result.add_condition("Series", folder.filename().string());
    result.add_condition("Images", fmt::format("{} x {} pixels", series.format.width, series.format.height));
    result.add_condition("Bit depth", fmt::format("{} bit", series.format.bits));
    result.add_condition("Levels", fmt::format("{}, up to {:.4g} photons per pixel", series.levels.size(),
                                               series.levels.back().photons));
    result.add_condition("Dark exposure times", fmt::format("{}, {:.4g} to {:.4g} ms", series.dark.size(),
                                                            1e-6 * series.dark.front().exposure_ns,
                                                            1e-6 * series.dark.back().exposure_ns));
    result.add_condition("Stacks", fmt::format("{}", series.stacks.size()));
    result.notes = series.notes;
    result.notes.push_back(
        "K and R were fitted over 70 % of the saturation, which is the level of the largest temporal variance.");
    if (m.saturation_photons == series.levels.back().photons)
        result.notes.push_back(
            "The variance is largest at the last level: the series does not reach saturation.");
    result.add("quantum_efficiency", m.quantum_efficiency, "");
    result.add("responsivity", m.responsivity_dn_per_photon, "DN/photon");
    result.add("gain", m.gain_dn_per_e, "DN/e-");
    result.add("dark_noise_dn", m.dark_noise.dn, "DN").upper_limit = m.dark_noise.upper_limit;
    result.add("dark_noise", m.dark_noise.electrons, "e-").upper_limit = m.dark_noise.upper_limit;
    if (m.dark_noise.upper_limit) result.notes.push_back(quantisation_note());
    result.add("snr_max", m.snr_max_db, "dB");
    result.add("threshold", m.threshold_photons, "photons").upper_limit = m.dark_noise.upper_limit;
    result.add("saturation_photons", m.saturation_photons, "photons");
    result.add("saturation", m.saturation_e, "e-");
    result.add("dynamic_range", m.dynamic_range_db, "dB");
    const emva::Nonuniformity pattern = add_nonuniformity(series, m, result);
    add_series_plots(series.levels, m, pattern, result);
    result.add("linearity_error", m.linearity_error_percent, "%");
    if (dark) {
        result.add("dark_current", 1e9 * dark->mean.slope / m.gain_dn_per_e, "e-/s");
        result.notes.push_back("Exposure times are nanoseconds, as the descriptor format states.");
    }
    return result;
}

} // namespace obscura::tools
