// SPDX-License-Identifier: Apache-2.0
#include "tools/model/chosen_law.hpp"

#include "config/document.hpp"
#include "config/shipped_files.hpp"
#include "core/text/printable.hpp"
#include "core/units.hpp"
#include "host/command_line.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::tools {

renderer::ModelMaterialParameters chosen_law(const std::string& file,
                                             const std::vector<std::string>& settings) {
    const std::string path = config::file_or_shipped(config::shipped_material_models, file).string();
    renderer::ModelMaterialParameters p = renderer::defaults_of(renderer::load_material_model(path));
    std::string text;
    for (const std::string& setting : settings) {
        if (setting.find('=') == std::string::npos)
            throw host::UsageError(fmt::format("--set {}: allowed is NAME=VALUE", printable(setting)));
        text += setting + '\n';
    }
    const config::Value table = config::parse_text(text, "--set");
    (void)config::read_keys(table, {"--set", ""}, scene::keys_of(declare(p)));
    return p;
}

double LawAngles::cos_phase() const {
    const double i = incidence_deg * degree, e = emission_deg * degree;
    return std::cos(i) * std::cos(e) + std::sin(i) * std::sin(e) * std::cos(azimuth_deg * degree);
}

double LawAngles::phase_deg() const {
    return std::acos(std::clamp(cos_phase(), -1.0, 1.0)) / degree;
}

std::vector<double> law_values(const renderer::Material& law, const std::vector<LawAngles>& angles) {
    std::vector<double> values;
    for (std::size_t first = 0; first < angles.size(); first += renderer::packet_size) {
        renderer::ScatterPacket s;
        for (int i = 0; i < renderer::packet_size; ++i) {
            const LawAngles& a = angles[std::min(first + static_cast<std::size_t>(i), angles.size() - 1)];
            s.cos_in[i] = std::cos(a.incidence_deg * degree);
            s.cos_out[i] = std::cos(a.emission_deg * degree);
            s.cos_phase[i] = a.cos_phase();
        }
        renderer::Doubles r;
        law.reflectance(s, r);
        for (int i = 0; i < renderer::packet_size && values.size() < angles.size(); ++i)
            values.push_back(r[i]);
    }
    return values;
}

} // namespace obscura::tools
