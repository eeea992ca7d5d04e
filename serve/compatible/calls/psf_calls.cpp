// SPDX-License-Identifier: Apache-2.0
// Commands of the point spread function.
#include "core/text/printable.hpp"
#include "serve/compatible/handlers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <numeric>
#include <tuple>

namespace obscura::serve::compatible {
namespace {

/// Blocks that FITS files are made of.
constexpr std::size_t fits_block = 2880;

/// An image of float32 as a FITS file, with the samples per pixel that scene files ask for.
std::string fits_of(const Psf& psf) {
    std::string text;
    const auto card = [&](std::string_view name, const auto& value) {
        text += fmt::format("{:<80}", fmt::format("{:<8}= {:>20}", name, value));
    };
    card("SIMPLE", "T");
    card("BITPIX", -32);
    card("NAXIS", 2);
    card("NAXIS1", psf.width);
    card("NAXIS2", psf.height);
    card("OVERSAMP", fmt::format("{:.12E}", psf.width / psf.support_w));
    card("OVERSAMY", fmt::format("{:.12E}", psf.height / psf.support_h));
    text += fmt::format("{:<80}", "END");
    text.resize((text.size() + fits_block - 1) / fits_block * fits_block, ' ');
    for (const float weight : psf.weights) {
        const auto bits = std::bit_cast<std::uint32_t>(weight);
        for (int shift = 24; shift >= 0; shift -= 8)
            text.push_back(static_cast<char>(bits >> shift & 0xFFU));
    }
    text.resize((text.size() + fits_block - 1) / fits_block * fits_block, '\0');
    return text;
}

/// Takes the function, whose file is made.
void use(ClientState& client_state, Psf psf) {
    const std::string before = client_state.camera.psf.file;
    if (psf.width > 0) psf.file = client_state.own.write(".fits", fits_of(psf));
    client_state.camera.psf = std::move(psf);
    client_state.own.remove(before);
}

/// An image of weights among the arguments, named with a suffix: "", "_tail".
Psf psf_of(const Arguments& arguments, const std::string& suffix) {
    constexpr std::int64_t largest = 2048;
    Psf psf;
    psf.width = static_cast<std::int32_t>(arguments.integer("w" + suffix, 0, largest));
    psf.height = static_cast<std::int32_t>(arguments.integer("h" + suffix, 0, largest));
    const std::string& data = arguments.bytes("psf" + suffix);
    const std::size_t count = static_cast<std::size_t>(psf.width) * static_cast<std::size_t>(psf.height);
    if (data.size() != count * sizeof(float))
        throw arguments.refused("psf" + suffix, fmt::format("{} bytes", data.size()),
                                fmt::format("{}", count * sizeof(float)));
    if (count == 0) return {};
    psf.weights.resize(count);
    std::memcpy(psf.weights.data(), data.data(), data.size());
    if (!std::all_of(psf.weights.begin(), psf.weights.end(),
                     [](float w) { return w >= 0 && std::isfinite(w); }))
        throw arguments.refused("psf" + suffix, "has a weight that is negative or not finite",
                                "weights from 0 up");
    if (!(std::accumulate(psf.weights.begin(), psf.weights.end(), 0.0) > 0))
        throw arguments.refused("psf" + suffix, "all weights are 0", "light");
    const auto support = [&](const std::string& name, std::int32_t samples) {
        const double px = arguments.number(name + suffix);
        if (px < 0) return static_cast<double>(samples);
        return arguments.number(name + suffix, samples / 256.0, std::min(256.0, samples * 10.0));
    };
    psf.support_w = support("support_w", psf.width);
    psf.support_h = support("support_h", psf.height);
    if (psf.support_w > 256 || psf.support_h > 256)
        throw arguments.refused("support_w" + suffix, "covers too many pixels", "256 px at most");
    return psf;
}

double weight_at(const Psf& psf, double x_px, double y_px) {
    const auto column = static_cast<std::int32_t>(std::floor((x_px / psf.support_w + 0.5) * psf.width));
    const auto row = static_cast<std::int32_t>(std::floor((y_px / psf.support_h + 0.5) * psf.height));
    if (column < 0 || row < 0 || column >= psf.width || row >= psf.height) return 0;
    return static_cast<double>(
        psf.weights[static_cast<std::size_t>(row) * static_cast<std::size_t>(psf.width) +
                    static_cast<std::size_t>(column)]);
}

/// One axis of a grid for two functions.
struct BlendedAxis {
    std::int32_t samples = 0;
    double support = 0;                        ///< pixels
    double core_support = 0, tail_support = 0; ///< of the functions on it: that of a point is one sample
};

/// An odd number of samples, so that one is in the middle. Where a function is a point, they are as dense as
/// the renderer's tables, or a multiple of that.
BlendedAxis blended_axis(std::int32_t core, double core_support, std::int32_t tail, double tail_support) {
    constexpr double most = 1023, table_per_pixel = 8, largest_px = 256;
    BlendedAxis axis{1, std::max(core_support, tail_support), core_support, tail_support};
    const double finer = std::max(core / core_support, tail / tail_support);
    if (core > 1 && tail > 1) {
        axis.samples = static_cast<std::int32_t>(std::clamp(std::ceil(axis.support * finer), 3.0, most)) | 1;
        return axis;
    }
    if (core == 1) axis.core_support = 0;
    if (tail == 1) axis.tail_support = 0;
    axis.support = std::max(axis.core_support, axis.tail_support);
    double rate = table_per_pixel;
    if (axis.support > 0) {
        const double needed = core == 1 ? tail / tail_support : core / core_support;
        rate *=
            std::clamp(std::ceil(needed / rate), 1.0, std::max(1.0, std::floor(most / axis.support / rate)));
        axis.samples = static_cast<std::int32_t>(std::ceil(std::min(axis.support, largest_px) * rate)) | 1;
    }
    axis.support = axis.samples / rate;
    if (core == 1) axis.core_support = 1 / rate;
    if (tail == 1) axis.tail_support = 1 / rate;
    return axis;
}

/// Both functions on one grid: `share` of the light is in the tail.
Psf blended(Psf core, Psf tail, double share) {
    const BlendedAxis across = blended_axis(core.width, core.support_w, tail.width, tail.support_w);
    const BlendedAxis down = blended_axis(core.height, core.support_h, tail.height, tail.support_h);
    core.support_w = across.core_support, core.support_h = down.core_support;
    tail.support_w = across.tail_support, tail.support_h = down.tail_support;
    Psf both;
    both.width = across.samples, both.height = down.samples;
    both.support_w = across.support, both.support_h = down.support;
    const auto light = [](const Psf& psf) {
        return std::accumulate(psf.weights.begin(), psf.weights.end(), 0.0) * psf.support_w * psf.support_h /
               (static_cast<double>(psf.width) * psf.height);
    };
    const double core_light = light(core), tail_light = light(tail);
    for (std::int32_t row = 0; row < both.height; ++row)
        for (std::int32_t column = 0; column < both.width; ++column) {
            const double x = ((column + 0.5) / both.width - 0.5) * both.support_w;
            const double y = ((row + 0.5) / both.height - 0.5) * both.support_h;
            both.weights.push_back(static_cast<float>((1 - share) * weight_at(core, x, y) / core_light +
                                                      share * weight_at(tail, x, y) / tail_light));
        }
    return both;
}

/// A Gaussian, integrated over its samples, out to `radius` standard deviations.
Psf gaussian(double sigma_px, double radius) {
    constexpr std::int32_t per_pixel = 8;
    const auto half_px = static_cast<std::int32_t>(std::ceil(std::min(sigma_px * radius, 60.0)));
    Psf psf;
    psf.width = psf.height = 2 * half_px * per_pixel + 1;
    psf.support_w = psf.support_h = static_cast<double>(psf.width) / per_pixel;
    const auto share = [&](std::int32_t i) {
        const double from = (i - 0.5 - half_px * per_pixel) / per_pixel, to = from + 1.0 / per_pixel;
        return (std::erf(to / sigma_px / std::sqrt(2.0)) - std::erf(from / sigma_px / std::sqrt(2.0))) / 2;
    };
    for (std::int32_t row = 0; row < psf.height; ++row)
        for (std::int32_t column = 0; column < psf.width; ++column)
            psf.weights.push_back(static_cast<float>(share(row) * share(column)));
    return psf;
}

} // namespace

void add_psf_calls(Handlers& handlers) {
    handlers["setPSF"] = [](Request& r) { use(r.client_state, psf_of(r.arguments, "")); };
    handlers["setPSFWithTail"] = [](Request& r) {
        const Psf core = psf_of(r.arguments, ""), tail = psf_of(r.arguments, "_tail");
        const double share = r.arguments.number("PSF_tail_coef", 0, 1);
        if (core.width == 0 || tail.width == 0)
            use(r.client_state, core.width == 0 ? tail : core);
        else
            use(r.client_state, blended(core, tail, share));
    };
    handlers["getPSF"] = [](Request& r) {
        Psf psf = r.client_state.camera.psf;
        if (psf.width == 0) psf = {1, 1, {1.0F}, 1, 1, {}}; // all light in one pixel
        r.reply.set("width", psf.width);
        r.reply.set("height", psf.height);
        std::string data(psf.weights.size() * sizeof(float), '\0');
        std::memcpy(data.data(), psf.weights.data(), data.size());
        r.reply.set_bytes("psf", std::move(data));
    };
    handlers["loadPSFModel"] = [](Request& r) {
        const std::string& name = r.arguments.text("filename");
        if (name.empty()) return use(r.client_state, {});
        if (name != "gaussian.psf")
            throw r.arguments.refused("filename", fmt::format("\"{}\" is not known", printable(name, 60)),
                                      "gaussian.psf");
        double sigma_px = 0.5, radius = 5;
        for (const auto& [field, target, most] :
             {std::tuple{"sigma", &sigma_px, 20.0}, std::tuple{"sigma_radius", &radius, 10.0}}) {
            const auto* const parameters = r.arguments.value("parameters").as<service::compatible::Fields>();
            const Value* const value =
                parameters == nullptr ? nullptr : service::compatible::find(*parameters, field);
            if (value == nullptr) continue;
            if (!to_number(*value, *target) || !(*target > 0 && *target <= most))
                throw r.arguments.refused("parameters", field, fmt::format("a number above 0 to {}", most));
        }
        use(r.client_state, gaussian(sigma_px, radius));
    };
}

} // namespace obscura::serve::compatible
