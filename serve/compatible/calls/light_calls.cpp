// SPDX-License-Identifier: Apache-2.0
// Commands of light sources: Sun, spot lights, stars.
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/objects.hpp"
#include "serve/compatible/stars.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::serve::compatible {
namespace {

Channels light_of(Request& r, std::string_view argument, double most) {
    const std::vector<double> given = r.arguments.vector(argument, channels);
    if (!std::all_of(given.begin(), given.end(), [&](double v) { return v >= 0 && v <= most; }))
        throw r.arguments.refused(argument, "is negative or too large", fmt::format("0 to {}", most));
    Channels light{};
    std::copy(given.begin(), given.end(), light.begin());
    return light;
}

/// Integral over solid angle of 1 - (angle / cutoff)^exponent, sr; exponent 0: of 1.
double beam_sr(double cutoff_rad, double exponent) {
    constexpr int steps = 2000;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double share = (i + 0.5) / steps;
        const double falls = exponent > 0 ? std::pow(share, exponent) : 0;
        sum += (1 - falls) * std::sin(share * cutoff_rad);
    }
    return 2 * std::numbers::pi * sum * cutoff_rad / steps;
}

/// A beam with the power of the light. Its fall-off towards the edge is that of a uniform or Gaussian beam.
void create_light(Request& r) {
    const Channels power_w = light_of(r, "spectrum", 1e20);
    const double cutoff_deg = r.arguments.number("cutoff", 0.001, 180);
    const double exponent = r.arguments.number("exponent", 0, 1e6);
    const double cutoff_rad = cutoff_deg * std::numbers::pi / 180;
    const std::string& name = r.arguments.text("light_name");
    if (name == "camera" || name == "sun")
        throw r.arguments.refused("light_name", "is no light", "another name");
    Object light;
    light.kind = Object::Kind::light;
    light.placement.attitude = {0, 1, 0, 0}; // along -z, as the camera at the start
    if (r.client_state.find(name) != nullptr) light.placement = r.client_state.inherited_placement(name);
    constexpr double flat = 8;
    double beam = 0;
    if (exponent > 0 && exponent < flat) {
        const double half_rad = cutoff_rad * exponent / (exponent + 1);
        light.keys = {{"beam", "gaussian"}, {"half_angle_deg", half_rad * 180 / std::numbers::pi}};
        constexpr int steps = 4000;
        for (int i = 0; i < steps; ++i) {
            const double angle = (i + 0.5) / steps * std::numbers::pi;
            beam += std::exp(-2 * angle * angle / (half_rad * half_rad)) * std::sin(angle);
        }
        beam *= 2 * std::numbers::pi * std::numbers::pi / steps;
        r.reply.warn("createLight: exponent: the beam is a Gaussian one of the same power");
    } else {
        light.keys = {{"beam", cutoff_deg < 180 ? "uniform" : "point"}};
        if (cutoff_deg < 180) light.keys["half_angle_deg"] = cutoff_deg;
        beam = beam_sr(cutoff_rad, 0);
    }
    for (const double w : power_w)
        light.keys["intensity_w_sr"].push_back(w / beam);
    put(r.client_state.objects, r.arguments, "light_name", std::move(light));
}

} // namespace

void add_light_calls(Handlers& handlers) {
    // Power of irradiances up to 1e8 W/m2 at 1 au.
    constexpr double max_w_sr = 1e8 * au_m * au_m;
    handlers["setSunPower"] = [](Request& r) {
        r.client_state.sun_power_w_sr = light_of(r, "sun_color", max_w_sr);
    };
    handlers["setSunPowerAtDistance"] = [](Request& r) {
        const double distance_m = r.arguments.number("distance", 1, 1e15);
        Channels power = light_of(r, "sun_color", max_w_sr / (distance_m * distance_m));
        for (double& w : power)
            w *= distance_m * distance_m;
        r.client_state.sun_power_w_sr = power;
    };
    handlers["getSunPower"] = [](Request& r) {
        const Channels& power = r.client_state.sun_power_w_sr;
        r.reply.set("sun_power", List(power.begin(), power.end()));
    };
    handlers["createLight"] = create_light;
    handlers["setStarThreshold"] = [](Request& r) {
        r.client_state.background.threshold_w_m2 = r.arguments.number("threshold", 0, 1e10);
        write_stars(r.client_state);
    };
    handlers["setBackground"] = [](Request& r) { set_background(r); };
}

} // namespace obscura::serve::compatible
