// SPDX-License-Identifier: Apache-2.0
// Verb `obscura probe`: one pixel of a frame of a running camera.
#include "core/text/printable.hpp"
#include "tools/verbs/calls/calling_verb.hpp"

#include <fmt/format.h>

#include <string>

namespace obscura::tools {
namespace {

/// "-" for null.
std::string probe_number(const host::CallJson& value, const char* unit, int digits) {
    return value.is_number() ? fmt::format("{:.{}g} {}", value.get<double>(), digits, unit)
                             : std::string("-");
}

class Probe final : public CallingVerb {
public:
    Probe() : CallingVerb("probe", DaemonOptions::Has::camera) {}

    void declare(host::CommandLine& line) override {
        line.summary = "prints DN, electrons, irradiance and surface point of one pixel";
        line.description =
            "Prints the digital number of a pixel, electrons estimated from it and those expected before any noise, irradiance in each spectral band, and the body behind the centre of the pixel with range, planetocentric latitude and longitude, angles of incidence and emission, and phase. "
            "The daemon renders the pixel again with the scene and the poses of the frame, at the time of its row; "
            "the first time it loads the scene once more, which may take as long as its start.";
        line.positional("X", &x_, "Column of the image, from 0 on the left").max = 65535;
        line.positional("Y", &y_, "Row of the image, from 0 on top").max = 65535;
        line.number("--frame", &frame_, "N", "Number of a frame of the newest few (default: the newest)", 1,
                    9e15);
        declare_daemon(line);
        line.flag("--json", json_, "Print the answer as one JSON object");
        line.examples = {"obscura probe 512 384", "obscura probe 512 384 --json | jq .irradiance_w_m2"};
    }

protected:
    int work() override {
        const auto calls = connect();
        host::CallJson fields = daemon().fields();
        fields["x"] = x_;
        fields["y"] = y_;
        fields["frame"] = frame_;
        const host::CallJson answer = calls->ask("probe", fields);
        if (json_)
            fmt::print("{}\n", answer.dump(-1, ' ', false, host::CallJson::error_handler_t::replace));
        else
            print(answer);
        return exit_ok;
    }

private:
    void print(const host::CallJson& answer) const {
        const auto row = [](const char* name, const std::string& value) {
            fmt::print("{:<22}{}\n", name, value);
        };
        row("frame", fmt::format("{}, pixel {}, {}", answer.at("frame").get<std::uint64_t>(), x_, y_));
        row("digital number", fmt::format("{} DN", answer.at("dn").get<std::uint32_t>()));
        const host::CallJson& electrons = answer.at("electrons");
        row("electrons, estimated", probe_number(electrons.at("estimated"), "e-", 6) + "   " +
                                        for_terminal(answer.at("formula").get<std::string>()));
        row("electrons, expected", probe_number(electrons.at("exact"), "e-", 6));
        for (const host::CallJson& band : answer.at("bands"))
            row("irradiance", probe_number(band.at("irradiance_w_m2"), "W/m2", 6) + "   " +
                                  for_terminal(band.at("name").get<std::string>()));
        const host::CallJson& body = answer.at("body");
        row("body", body.is_string() ? for_terminal(body.get<std::string>()) : "-");
        if (!body.is_string()) return;
        row("range", probe_number(answer.at("range_m"), "m", 9));
        row("latitude, longitude", probe_number(answer.at("latitude_deg"), "deg", 7) + ", " +
                                       probe_number(answer.at("longitude_deg"), "deg", 7));
        row("incidence, emission", probe_number(answer.at("incidence_deg"), "deg", 7) + ", " +
                                       probe_number(answer.at("emission_deg"), "deg", 7));
        row("phase", probe_number(answer.at("phase_deg"), "deg", 7));
    }

    std::uint32_t x_ = 0, y_ = 0;
    std::uint64_t frame_ = 0;
    bool json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_probe() {
    return std::make_unique<Probe>();
}

} // namespace obscura::tools
