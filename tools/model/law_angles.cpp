// SPDX-License-Identifier: Apache-2.0
#include "tools/model/law_angles.hpp"

#include "core/units.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::tools {

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
