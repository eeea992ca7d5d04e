// SPDX-License-Identifier: Apache-2.0
#include "emulator/control/probe_call.hpp"

#include "core/camera/camera.hpp"
#include "emulator/control/frame_call.hpp"
#include "transports/watch/watch.hpp"

#include <fmt/format.h>

#include <array>
#include <chrono>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {
namespace {

using nlohmann::json;
using service::Answer;
using service::bad_argument;
using service::Failure;
using service::FailureCode;
using service::Fields;
using service::Work;

struct ProbeFrameArguments {
    std::uint32_t camera = 0;
    std::uint64_t frame = 0;
    double wait_s = 2;

    Fields fields() {
        return {{camera_key(&camera),
                 config::key("frame", &frame)
                     .range(0, 9e15)
                     .help("Number of the frame in its acquisition, one of the newest; 0: the newest"),
                 config::key("wait_s", &wait_s)
                     .unit("s")
                     .range(0, max_frame_wait_s)
                     .help("Longest wait for a frame where none was looked at")}};
    }
};

struct ProbeCallArguments : ProbeFrameArguments {
    std::uint32_t x = 0, y = 0;

    Fields fields() {
        Fields all = ProbeFrameArguments::fields();
        config::Keys place{config::key("x", &x).unit("px").range(0, 65535).required().help(
                               "Column of the image, from 0 on the left"),
                           config::key("y", &y).unit("px").range(0, 65535).required().help(
                               "Row of the image, from 0 on top")};
        all.keys.insert(all.keys.begin() + 1, std::make_move_iterator(place.begin()),
                        std::make_move_iterator(place.end()));
        return all;
    }
};

Failure not_now(const std::string& message, const char* call = "probe") {
    return {FailureCode::not_now, fmt::format("{}: {}", call, message)};
}

/// null where there is none.
template<typename Value>
json probe_json(const std::optional<Value>& value) {
    return value ? json(*value) : json();
}

/// The frame that is meant, if its pixels are its own.
transports::KeptFrame frame_of(transports::WatchTransport& watch, const ProbeFrameArguments& arguments,
                               const Work& work, const char* call) {
    const auto until = std::chrono::steady_clock::now() +
                       std::chrono::microseconds(static_cast<std::int64_t>(arguments.wait_s * 1e6));
    auto frame = watch.kept(arguments.frame, until, work.cancelled());
    if (work.cancelled()) throw service::cancelled();
    if (!frame) throw not_now(fmt::format("no frame came in {} s", arguments.wait_s), call);
    const FrameInfo& info = frame->info;
    if (arguments.frame > 0 && info.frame_id != arguments.frame)
        throw not_now(fmt::format("frame {} is not kept any more, the newest one is {}", arguments.frame,
                                  info.frame_id),
                      call);
    if ((frame->flags & (frame_repeated | frame_dropped)) != 0)
        throw not_now(fmt::format("frame {} has pixels of an earlier frame, or none", info.frame_id), call);
    return std::move(*frame);
}

/// Requested frame, if it has the pixel.
transports::KeptFrame frame_with_pixel(transports::WatchTransport& watch, const ProbeCallArguments& arguments,
                                       const Work& work) {
    transports::KeptFrame frame = frame_of(watch, arguments, work, "probe");
    const FrameInfo& info = frame.info;
    const auto check = [](const char* name, std::uint32_t value, std::int32_t size) {
        if (value < static_cast<std::uint32_t>(size)) return;
        const std::string allowed = fmt::format("0 to {}", size - 1);
        throw bad_argument(
            name, fmt::format("probe: {}: {} is outside of the image, allowed {}", name, value, allowed),
            allowed);
    };
    check("x", arguments.x, info.width);
    check("y", arguments.y, info.height);
    if (arguments.y >= static_cast<std::uint32_t>(frame.rows))
        throw not_now(fmt::format("frame {} has {} rows only", info.frame_id, frame.rows));
    if (!window_of(info, static_cast<std::int32_t>(arguments.x), static_cast<std::int32_t>(arguments.y)))
        throw bad_argument("x", fmt::format("probe: x: {} is right of the window that row {} is of",
                                            arguments.x, arguments.y));
    return frame;
}

/// Electrons of a digital number by the detector's linear model, and its text.
json electrons_of(double dn, const FrameInfo& info, const DetectorSettings& detector,
                  const FrameOrigin& origin, std::string& formula) {
    if (origin.pattern) {
        formula = "none: the digital numbers are those of a test pattern";
        return {};
    }
    formula = fmt::format("(DN - {:g}) / ({:g} DN/e- * 10^({:g} dB / 20 dB))", origin.black_level_dn,
                          detector.gain_dn_per_e, info.gain_db);
    return (dn - origin.black_level_dn) / (detector.gain_dn_per_e * std::pow(10.0, info.gain_db / 20));
}

/// As they were written, without the rounding of metres.
std::array<double, 2> wavelengths_nm(const SpectralBand& band) {
    return {std::round(1e15 * band.from_m) / 1e6, std::round(1e15 * band.to_m) / 1e6};
}

std::string band_name(const SpectralBand& band) {
    const auto [from_nm, to_nm] = wavelengths_nm(band);
    return fmt::format("{}-{}nm", std::lround(from_nm), std::lround(to_nm));
}

json bands_of(const std::vector<SpectralBand>& bands, const std::vector<double>& irradiance_w_m2) {
    json list = json::array();
    for (std::size_t b = 0; b < bands.size(); ++b)
        list.push_back({{"name", band_name(bands[b])},
                        {"wavelength_nm", wavelengths_nm(bands[b])},
                        {"irradiance_w_m2", irradiance_w_m2[b]}});
    return list;
}

Answer probe(const CameraCalls::Cameras& cameras, PixelProbes& probes, const ProbeSourceOf& source_of,
             const ProbeCallArguments& arguments, const Work& work) {
    transports::WatchTransport* const watch = checked_camera(cameras, arguments.camera).watch;
    if (watch == nullptr) throw not_now("the daemon keeps no frames for calls");
    const transports::KeptFrame frame = frame_with_pixel(*watch, arguments, work);
    const FrameInfo& info = frame.info;
    const auto x = static_cast<std::int32_t>(arguments.x), y = static_cast<std::int32_t>(arguments.y);
    const auto kept = watch->pixel(frame, x, y);
    if (!kept) throw not_now(fmt::format("frame {} is not kept any more", info.frame_id));
    const CameraUnit::ProbeSource source = source_of(arguments.camera, info);
    const ProbedPixel pixel =
        probes.probe(arguments.camera, source, info, frame.row_times, x, y, work.cancelled());

    const std::vector<double>& irradiance = pixel.irradiance_w_m2;
    std::string formula;
    json estimated = electrons_of(kept->dn, info, source.settings->sensor.detector, source.origin, formula);
    const std::optional<double> exact = kept->mean_e ? std::optional<double>(*kept->mean_e) : pixel.mean_e;
    return {{{"frame", info.frame_id},
             {"x", arguments.x},
             {"y", arguments.y},
             {"dn", kept->dn},
             {"electrons", {{"estimated", std::move(estimated)}, {"exact", probe_json(exact)}}},
             {"formula", formula},
             {"bands", bands_of(source.scene->bands, irradiance)},
             {"irradiance_w_m2", std::accumulate(irradiance.begin(), irradiance.end(), 0.0)},
             {"body", probe_json(pixel.body)},
             {"range_m", probe_json(pixel.range_m)},
             {"latitude_deg", probe_json(pixel.latitude_deg)},
             {"longitude_deg", probe_json(pixel.longitude_deg)},
             {"incidence_deg", probe_json(pixel.incidence_deg)},
             {"emission_deg", probe_json(pixel.emission_deg)},
             {"phase_deg", probe_json(pixel.phase_deg)},
             {"row_mid_exposure_tai_ns", pixel.row_mid.ns + info.tai_offset_ns},
             {"samples", probe_json(pixel.samples)}}};
}

Answer irradiance(const CameraCalls::Cameras& cameras, PixelProbes& probes, const ProbeSourceOf& source_of,
                  const ProbeFrameArguments& arguments, Work& work) {
    transports::WatchTransport* const watch = checked_camera(cameras, arguments.camera).watch;
    if (watch == nullptr) throw not_now("the daemon keeps no frames for calls", "irradiance");
    const transports::KeptFrame frame = frame_of(*watch, arguments, work, "irradiance");
    const FrameInfo& info = frame.info;
    const CameraUnit::ProbeSource source = source_of(arguments.camera, info);
    const std::vector<SpectralBand>& bands = source.scene->bands;
    const auto width = static_cast<std::size_t>(info.width), height = static_cast<std::size_t>(info.height);
    work.reserve(sizeof(float) * bands.size() * width * height);
    Answer answer{frame_head(info)};
    json list = json::array();
    for (const SpectralBand& band : bands)
        list.push_back({{"name", band_name(band)}, {"wavelength_nm", wavelengths_nm(band)}});
    answer.head["bands"] = std::move(list);
    answer.arrays.push_back(
        {"irradiance",
         {bands.size(), height, width},
         probes.irradiance(arguments.camera, source, info, frame.row_times, work.cancelled())});
    return answer;
}

} // namespace

service::Call irradiance_call(const CameraCalls::Cameras& cameras, PixelProbes& probes,
                              ProbeSourceOf source) {
    service::Call call = service::call<ProbeFrameArguments>(
        "irradiance", service::Permission::view,
        "Renders all pixels of a frame again, without a detector: at full quality, with the scene and the poses of that frame at the times of its rows, on the thread of `probe`, which is of idle priority. "
        "Takes seconds.",
        [&cameras, &probes, source = std::move(source)](const ProbeFrameArguments& arguments, Work& work) {
            return irradiance(cameras, probes, source, arguments, work);
        });
    call.results = {
        {"irradiance", "array float32 [bands, height, width]", "W/m2",
         "At the entrance pupil, first row on top; 0 beside narrow windows"},
        {"bands", "array of maps", "", "Spectral bands of the camera: name, wavelength_nm (from, to)"}};
    for (service::Result& result : frame_head_results())
        call.results.push_back(std::move(result));
    return call;
}

service::Call probe_call(const CameraCalls::Cameras& cameras, PixelProbes& probes, ProbeSourceOf source) {
    service::Call call = service::call<ProbeCallArguments>(
        "probe", service::Permission::view,
        "Tells of one pixel of a frame its digital number, electrons, irradiance, and what its centre shows. "
        "The pixel is rendered again, at full quality, with the scene and the poses of that frame at the time of its row: on a thread of idle priority, which loads the scene at the first call and gives it back after 5 minutes without one.",
        [&cameras, &probes, source = std::move(source)](const ProbeCallArguments& arguments, Work& work) {
            return probe(cameras, probes, source, arguments, work);
        });
    call.results = {
        {"frame", "integer", "", "Number of the frame in its acquisition"},
        {"x", "integer", "px", "Column of the image"},
        {"y", "integer", "px", "Row of the image"},
        {"dn", "integer", "DN", "Digital number"},
        {"electrons", "map", "e-",
         "estimated: from the digital number by the formula, nil for a test pattern; "
         "exact: expected value before any noise, from the truth of the frame's pixels if the daemon keeps it, else rendered again; "
         "nil where lines of a push-broom sensor exchange charge"},
        {"formula", "string", "",
         "How electrons are estimated: black level, gain of the detector, analog gain"},
        {"bands", "array of maps", "",
         "Spectral bands of the camera: name, wavelength_nm (from, to), irradiance_w_m2 at the entrance pupil"},
        {"irradiance_w_m2", "number", "W/m2", "Sum of the bands"},
        {"body", "string", "",
         "Body on the ray through the centre of the pixel, or \"sun\"; nil: none, and nil in what follows"},
        {"range_m", "number", "m", "From the camera to its surface"},
        {"latitude_deg", "number", "deg", "Planetocentric latitude there, in the axes of the body"},
        {"longitude_deg", "number", "deg", "Longitude there, -180 to 180, from +x towards +y"},
        {"incidence_deg", "number", "deg", "Between the normal and the Sun; nil on the Sun itself"},
        {"emission_deg", "number", "deg", "Between the normal and the camera"},
        {"phase_deg", "number", "deg", "Between Sun and camera, seen from there; nil on the Sun itself"},
        {"row_mid_exposure_tai_ns", "integer", "ns",
         "Middle of the exposure of the pixel's row, or of the pixel where it has a time of its own, TAI, for which geometry and body hold"},
        {"samples", "number", "", "Rays of the pixel; nil of a push-broom sensor"}};
    return call;
}

} // namespace obscura::emulator
