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

LawCosines LawAngles::cosines() const {
    const double i = incidence_deg * degree, e = emission_deg * degree;
    return {std::cos(i), std::cos(e),
            std::cos(i) * std::cos(e) + std::sin(i) * std::sin(e) * std::cos(azimuth_deg * degree)};
}

double LawAngles::phase_deg() const {
    return std::acos(std::clamp(cosines().phase, -1.0, 1.0)) / degree;
}

std::vector<renderer::ScatterPacket> packets_of(const std::vector<LawCosines>& directions) {
    std::vector<renderer::ScatterPacket> packets;
    for (std::size_t first = 0; first < directions.size(); first += renderer::packet_size) {
        renderer::ScatterPacket& s = packets.emplace_back();
        for (int i = 0; i < renderer::packet_size; ++i) {
            const LawCosines& d =
                directions[std::min(first + static_cast<std::size_t>(i), directions.size() - 1)];
            s.cos_in[i] = d.in;
            s.cos_out[i] = d.out;
            s.cos_phase[i] = d.phase;
        }
    }
    return packets;
}

std::vector<double> law_values(const renderer::Material& law, const std::vector<LawCosines>& directions) {
    std::vector<double> values;
    for (const renderer::ScatterPacket& s : packets_of(directions)) {
        renderer::Doubles r;
        law.reflectance(s, r);
        for (int i = 0; i < renderer::packet_size && values.size() < directions.size(); ++i)
            values.push_back(r[i]);
    }
    return values;
}

} // namespace obscura::tools
