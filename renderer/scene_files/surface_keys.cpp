// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/surface_keys.hpp"

#include "core/units.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

#include <utility>

namespace obscura::scene {

config::Keys keys_of(SurfaceKeys& s, bool turns) {
    config::Keys keys{
        config::key("longitude_deg", config::Scaled{&s.place.longitude_rad, degree})
            .unit("deg")
            .range(longitudes_deg)
            .help("Longitude of a place on the parent, instead of position_m: about the body's z axis, from "
                  "its x axis towards its y axis (east)"),
        config::key("latitude_deg", config::Scaled{&s.place.latitude_rad, degree})
            .unit("deg")
            .range(latitudes_deg)
            .help("Latitude of that place; north is towards the body's z axis"),
        config::key("altitude_m", &s.place.height_m)
            .unit("m")
            .range(anywhere)
            .help("Height of that place, see altitude_above"),
        config::key("altitude_above", &s.above)
            .help("Surface from which heights count: the ellipsoid of the parent's radii, or its ground with "
                  "maps and detail"),
        config::key("latitudes", &s.latitudes)
            .help(
                "Meaning of latitudes: planetocentric (direction from the body's centre, along which heights "
                "count) or planetographic (normal of the ellipsoid, along which heights count; geodetic)"),
    };
    if (turns)
        keys.push_back(
            config::key("axes", &s.axes)
                .help(
                    "Axes from which orientation, boresight, up and attitudes of files count at that place: "
                    "the parent's, or local ones, x east, y north, z up"));
    return keys;
}

bool has_surface_place(const config::ReadTable& table) {
    return table.has("longitude_deg") || table.has("latitude_deg");
}

void check_surface_keys(const config::ReadTable& table, bool rows) {
    const bool place = has_surface_place(table);
    for (const char* key : {"longitude_deg", "latitude_deg"}) {
        if (place && !table.has(key)) table.refuse_table(fmt::format("the key \"{}\" is missing", key));
        exclude(table, key, "position_m");
        exclude(table, key, "trajectory");
    }
    if (table.has("altitude_m") && !place)
        table.refuse("altitude_m", "belongs to \"longitude_deg\" and \"latitude_deg\"");
    for (const char* key : {"altitude_above", "latitudes", "axes"})
        if (table.has(key) && !place && !rows)
            table.refuse(key,
                         "belongs to \"longitude_deg\" and \"latitude_deg\", or to a trajectory with these "
                         "columns");
    if (!place && !rows) return;
    const char* const key = rows                         ? "trajectory"
                            : table.has("longitude_deg") ? "longitude_deg"
                                                         : "latitude_deg";
    if (table.has("relative_to"))
        table.refuse(key, "needs \"parent\", the body that it is on; \"relative_to\" does not turn with it");
    else if (!table.has("parent"))
        table.refuse(key, "needs \"parent\", the body that it is on");
    if (rows && table.has("max_extrapolation_s") && !table.has("attitude"))
        table.refuse("max_extrapolation_s", "belongs to a trajectory in metres or to \"attitude\": places "
                                            "by longitude hold");
}

std::shared_ptr<const SurfaceTrack> surface_track(const SurfaceKeys& keys, std::vector<SurfacePlace> rows,
                                                  const config::ReadTable& table) {
    SurfaceTrack track;
    const bool file = !rows.empty();
    track.places = file ? std::move(rows) : std::vector{keys.place};
    track.latitudes = keys.latitudes;
    track.above = keys.above;
    track.axes = keys.axes;
    track.position = fmt::format("{}: {}", table.position_text(),
                                 table.where().in(file ? "trajectory" : "longitude_deg").path);
    return std::make_shared<const SurfaceTrack>(std::move(track));
}

} // namespace obscura::scene
