// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/stars.hpp"

#include "config/shipped_files.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "serve/compatible/scene_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <string>

namespace obscura::serve::compatible {
namespace {

/// Stars that a map may have.
constexpr std::size_t max_stars = 200'000;

/// A text: the count, then x y z and the irradiances of the channels of each star.
Background read_map(Request& r, const std::filesystem::path& file) {
    std::ifstream in(file);
    std::size_t count = 0;
    const auto refused = [&](const std::string& what) {
        return r.arguments.refused("background", what,
                                   "a star map: the number of stars, then x y z e0 e1 e2 e3 of each");
    };
    if (!(in >> count)) throw refused("the file does not begin with a number of stars");
    if (count > max_stars) throw refused(fmt::format("{} stars, allowed {}", count, max_stars));
    Background stars;
    for (std::size_t i = 0; i < count; ++i) {
        Vec3 direction;
        Channels light{};
        in >> direction.x >> direction.y >> direction.z;
        for (double& e : light)
            in >> e;
        const double length = obscura::length(direction);
        if (!in || !(length > 0) || !std::isfinite(length) ||
            !std::all_of(light.begin(), light.end(), [](double e) { return e >= 0 && std::isfinite(e); }))
            throw refused(fmt::format("star {} of {} cannot be read", i + 1, count));
        stars.directions.push_back(direction / length);
        stars.irradiance_w_m2.push_back(light);
    }
    return stars;
}

/// The shipped catalogue, in the bands of the channels.
Background shipped_stars(const std::array<ChannelBand, channels>& bands) {
    const auto file = config::find_shipped(config::shipped_stars, "bright");
    if (!file) throw Failure(FailureCode::internal, "setBackground: the shipped star catalogue is missing");
    Background stars;
    for (const scene::Star& star : scene::read_stars(*file, 40)) {
        stars.directions.push_back(renderer::star_direction(star.right_ascension_rad, star.declination_rad));
        Channels light{};
        for (std::size_t c = 0; c < channels; ++c)
            light[c] = renderer::star_irradiance_w_m2(
                star, SpectralBand{bands[c].from_nm * 1e-9, bands[c].to_nm * 1e-9});
        stars.irradiance_w_m2.push_back(light);
    }
    return stars;
}

} // namespace

void set_background(Request& r) {
    const std::string& name = r.arguments.text("background");
    Background& background = r.client_state.background;
    Background stars;
    if (name.ends_with(".bin")) {
        stars = shipped_stars(r.client_state.bands);
        r.reply.warn(fmt::format(
            "setBackground: binary star maps are not public: {} stars of the Bright Star Catalogue instead",
            stars.directions.size()));
    } else if (!name.empty()) {
        stars = read_map(r, r.client_state.files.existing(name));
    }
    stars.name = name;
    stars.threshold_w_m2 = background.threshold_w_m2;
    stars.file = background.file;
    background = std::move(stars);
    write_stars(r.client_state);
}

void write_stars(ClientState& client_state) {
    Background& b = client_state.background;
    client_state.own.remove(std::exchange(b.file, {}));
    std::string text = "x,y,z,e1,e2,e3,e4\n";
    bool any = false;
    for (std::size_t i = 0; i < b.directions.size(); ++i) {
        const Vec3& d = b.directions[i];
        const Channels& e = b.irradiance_w_m2[i];
        if (!(*std::max_element(e.begin(), e.end()) > b.threshold_w_m2)) continue;
        any = true;
        text += fmt::format("{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g},{:.17g}\n", d.x, d.y, d.z, e[0],
                            e[1], e[2], e[3]);
    }
    if (any) b.file = client_state.own.write(".csv", text);
}

} // namespace obscura::serve::compatible
