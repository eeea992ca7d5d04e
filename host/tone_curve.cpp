// SPDX-License-Identifier: Apache-2.0
#include "host/tone_curve.hpp"

#include "host/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <numeric>
#include <optional>

namespace obscura::host {
namespace {

struct KindRow {
    StretchKind kind;
    std::string_view name, parameters;
    std::size_t count; ///< number of parameters, if any are given
};
constexpr KindRow kinds[] = {
    {.kind = StretchKind::automatic, .name = "auto", .parameters = "", .count = 0},
    {.kind = StretchKind::linear, .name = "linear", .parameters = "[:BLACK,WHITE]", .count = 2},
    {.kind = StretchKind::percentile, .name = "percentile", .parameters = "[:LOW,HIGH]", .count = 2},
    {.kind = StretchKind::asinh, .name = "asinh", .parameters = "[:SOFTENING]", .count = 1},
    {.kind = StretchKind::logarithm, .name = "log", .parameters = "[:RANGE]", .count = 1},
};

/// Comma-separated numbers; nullopt if one is none.
std::optional<std::vector<double>> numbers(std::string_view text) {
    std::vector<double> out;
    while (true) {
        const std::string_view word = text.substr(0, text.find(','));
        double value = 0;
        const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
        if (error != std::errc{} || end != word.data() + word.size() || !std::isfinite(value))
            return std::nullopt;
        out.push_back(value);
        if (word.size() == text.size()) return out;
        text.remove_prefix(word.size() + 1);
    }
}

bool allowed(StretchKind kind, const std::vector<double>& p) {
    switch (kind) {
    case StretchKind::linear:
        return p[0] < p[1];
    case StretchKind::percentile:
        return p[0] >= 0 && p[0] < p[1] && p[1] <= 100;
    case StretchKind::asinh:
        return p[0] >= 1e-6 && p[0] <= 1;
    case StretchKind::logarithm:
        return p[0] >= 1 && p[0] <= 1e9;
    case StretchKind::automatic:
        break;
    }
    return true;
}

} // namespace

std::vector<std::uint8_t> display_levels(std::span<const std::uint64_t> counts, int bits,
                                         const Stretch& stretch) {
    const std::uint64_t total = std::accumulate(counts.begin(), counts.end(), std::uint64_t{0});
    const auto quantile = [&](double part) {
        if (total == 0) return 0.0;
        const auto index = static_cast<std::uint64_t>(part * static_cast<double>(total - 1));
        std::uint64_t below = 0;
        for (std::size_t dn = 0; dn < counts.size(); ++dn)
            if ((below += counts[dn]) > index) return static_cast<double>(dn);
        return static_cast<double>(counts.size() - 1);
    };
    const ToneCurve curve(stretch, quantile, std::exp2(bits) - 1);
    // From white on all are white: the formulas need not be worked out.
    std::vector<std::uint8_t> out(counts.size(), 255);
    for (std::size_t dn = 0; dn < counts.size() && static_cast<double>(dn) < curve.white(); ++dn)
        out[dn] = static_cast<std::uint8_t>(std::lround(255 * curve.level(static_cast<double>(dn))));
    return out;
}

Stretch Stretch::parse(std::string_view verb, std::string_view text, double gamma) {
    const std::size_t colon = text.find(':');
    const auto row = std::find_if(std::begin(kinds), std::end(kinds),
                                  [&](const KindRow& r) { return r.name == text.substr(0, colon); });
    bool good = row != std::end(kinds);
    Stretch out;
    out.gamma = gamma;
    if (good) {
        out.kind = row->kind;
        if (colon != std::string_view::npos) {
            const auto parameters = numbers(text.substr(colon + 1));
            good = parameters && parameters->size() == row->count && row->count > 0 &&
                   allowed(row->kind, *parameters);
            if (good) out.parameters = *parameters;
        }
    }
    if (!good) {
        std::string forms;
        for (const KindRow& r : kinds)
            forms += fmt::format("{}{}{}", forms.empty() ? "" : ", ", r.name, r.parameters);
        throw UsageError(
            fmt::format("obscura {}: --stretch \"{}\": allowed are {}, for example percentile:1,99.5; "
                        "BLACK < WHITE, 0 <= LOW < HIGH <= 100, SOFTENING 1e-6 to 1, RANGE 1 to 1e9",
                        verb, text.substr(0, 60), forms));
    }
    return out;
}

ToneCurve::ToneCurve(const Stretch& stretch, const std::function<double(double)>& quantile, double full_scale)
    : kind_(stretch.kind), gamma_(stretch.gamma) {
    const std::vector<double>& p = stretch.parameters;
    switch (kind_) {
    case StretchKind::linear:
        black_ = p.empty() ? 0 : p[0], white_ = p.empty() ? full_scale : p[1];
        break;
    case StretchKind::percentile:
        black_ = quantile(p.empty() ? 0.005 : p[0] / 100), white_ = quantile(p.empty() ? 0.995 : p[1] / 100);
        break;
    default:
        black_ = quantile(0.05), white_ = quantile(0.9999);
    }
    if (kind_ == StretchKind::asinh) parameter_ = p.empty() ? 0.01 : p[0];
    if (kind_ == StretchKind::logarithm) parameter_ = p.empty() ? 1000 : p[0];
    // A star field has fewer bright pixels than that.
    if (!(white_ > black_)) white_ = quantile(1);
    if (!(white_ > black_)) white_ = black_ + 1;
}

ToneCurve::ToneCurve(const Stretch& stretch, const std::vector<float>& image)
    : ToneCurve(
          stretch,
          [sorted = std::vector<float>(), &image](double part) mutable {
              if (sorted.empty())
                  std::copy_if(image.begin(), image.end(), std::back_inserter(sorted),
                               [](float v) { return std::isfinite(v); });
              if (sorted.empty()) return 0.0;
              const auto index = static_cast<std::ptrdiff_t>(part * static_cast<double>(sorted.size() - 1));
              std::nth_element(sorted.begin(), sorted.begin() + index, sorted.end());
              return static_cast<double>(sorted[static_cast<std::size_t>(index)]);
          },
          image.empty() ? 1 : static_cast<double>(*std::max_element(image.begin(), image.end()))) {}

double ToneCurve::level(double value) const {
    const double x = std::clamp((value - black_) / (white_ - black_), 0.0, 1.0);
    if (!(x > 0)) return 0;
    double tone = x;
    if (kind_ == StretchKind::automatic) {
        // Mix mostly display gamma, which keeps the shading of a body, with some logarithm for faint stars.
        constexpr double faint = 1e-3;
        tone = 0.8 * std::pow(x, 1 / 2.2) + 0.2 * std::asinh(x / faint) / std::asinh(1 / faint);
    } else if (kind_ == StretchKind::asinh) {
        tone = std::asinh(x / parameter_) / std::asinh(1 / parameter_);
    } else if (kind_ == StretchKind::logarithm) {
        tone = std::log1p(parameter_ * x) / std::log1p(parameter_);
    }
    return gamma_ == 1 ? tone : std::pow(tone, 1 / gamma_);
}

std::vector<std::uint8_t> stretched(const std::vector<float>& image, const Stretch& stretch) {
    if (image.empty()) return {};
    const ToneCurve curve(stretch, image);
    std::vector<std::uint8_t> out;
    out.reserve(image.size());
    for (const float value : image)
        out.push_back(static_cast<std::uint8_t>(std::lround(255 * curve.level(static_cast<double>(value)))));
    return out;
}

} // namespace obscura::host
