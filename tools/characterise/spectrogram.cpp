// SPDX-License-Identifier: Apache-2.0
#include "tools/characterise/spectrogram.hpp"

#include <cmath>
#include <complex>
#include <numbers>

namespace obscura::tools {
namespace {

using Complex = std::complex<double>;

std::size_t smallest_factor(std::size_t n) {
    for (std::size_t p = 2; p * p <= n; ++p)
        if (n % p == 0) return p;
    return n;
}

/// Discrete Fourier transform of any length (Cooley and Tukey 1965, decimation in time).
std::vector<Complex> transformed(const std::vector<Complex>& in) {
    const std::size_t n = in.size();
    if (n < 2) return in;
    const std::size_t p = smallest_factor(n), m = n / p;
    std::vector<std::vector<Complex>> parts(p, std::vector<Complex>(m));
    for (std::size_t i = 0; i < n; ++i)
        parts[i % p][i / p] = in[i];
    for (std::vector<Complex>& part : parts)
        part = transformed(part);
    std::vector<Complex> out(n);
    for (std::size_t k = 0; k < n; ++k) {
        const Complex step =
            std::polar(1.0, -2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(n));
        Complex factor = 1;
        for (std::size_t r = 0; r < p; ++r, factor *= step)
            out[k] += factor * parts[r][k % m];
    }
    return out;
}

} // namespace

std::vector<std::pair<double, double>> spectrogram(const std::vector<double>& values, std::size_t width,
                                                   bool along_rows) {
    if (width == 0 || values.size() < width) return {};
    const std::size_t height = values.size() / width;
    const std::size_t length = along_rows ? width : height, lines = along_rows ? height : width;
    std::vector<double> power(length / 2 + 1);
    std::vector<Complex> line(length);
    // Two real lines make one complex transform: their spectra are its even and odd parts.
    for (std::size_t k = 0; k < lines; k += 2) {
        for (std::size_t i = 0; i < length; ++i) {
            const auto at = [&](std::size_t l) {
                return l >= lines ? 0.0 : along_rows ? values[l * width + i] : values[i * width + l];
            };
            line[i] = {at(k), at(k + 1)};
        }
        const std::vector<Complex> spectrum = transformed(line);
        for (std::size_t f = 1; f < power.size(); ++f)
            power[f] += 0.5 * (std::norm(spectrum[f]) + std::norm(spectrum[length - f]));
    }
    std::vector<std::pair<double, double>> out;
    for (std::size_t f = 1; f < power.size(); ++f)
        out.emplace_back(static_cast<double>(f) / static_cast<double>(length),
                         std::sqrt(power[f] / static_cast<double>(lines) / static_cast<double>(length)));
    return out;
}

} // namespace obscura::tools
