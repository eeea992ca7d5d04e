// SPDX-License-Identifier: Apache-2.0
#include "host/irradiance_image.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::host {

std::string band_name(const SpectralBand& band) {
    return fmt::format("{}-{}nm", std::lround(1e9 * band.from_m), std::lround(1e9 * band.to_m));
}

std::vector<images::ExrChannel> irradiance_channels(std::span<const float> image,
                                                    const std::vector<SpectralBand>& bands) {
    const std::size_t plane = image.size() / bands.size();
    std::vector<images::ExrChannel> channels;
    for (std::size_t i = 0; i < bands.size(); ++i) {
        std::string name = "irradiance." + band_name(bands[i]);
        const auto same = [&](const images::ExrChannel& c) { return c.name == name; };
        if (std::any_of(channels.begin(), channels.end(), same)) name += fmt::format("-{}", i);
        channels.push_back({std::move(name), "W m-2", image.subspan(i * plane, plane)});
    }
    // Readers of pictures (OpenCV, FFmpeg) know a picture of one channel by this name.
    if (bands.size() == 1) channels.push_back({"Y", "W m-2", image});
    return channels;
}

images::Cards band_cards(const std::vector<SpectralBand>& bands) {
    images::Cards cards;
    for (std::size_t i = 0; i < bands.size(); ++i) {
        cards.push_back({fmt::format("B{}_FROM", i), 1e9 * bands[i].from_m, "[nm] lower end of the band"});
        cards.push_back({fmt::format("B{}_TO", i), 1e9 * bands[i].to_m, "[nm] upper end of the band"});
    }
    return cards;
}

} // namespace obscura::host
