// SPDX-License-Identifier: Apache-2.0
// Keys of scene files for a place on a body by longitude, latitude and height.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/surface_place.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

/// Place of the camera, a lamp, a body or a point on its parent, as keys give it.
struct SurfaceKeys {
    SurfacePlace place{};
    Latitudes latitudes = Latitudes::planetocentric;
    HeightAbove above = HeightAbove::reference;
    PlaceAxes axes = PlaceAxes::parent;
};
/// `turns`: it has an attitude, too.
[[nodiscard]] config::Keys keys_of(SurfaceKeys& keys, bool turns);

/// Whether the table gives a place by longitude and latitude.
[[nodiscard]] bool has_surface_place(const config::ReadTable& table);

/// Reports keys of `keys` that do not fit each other or the rest of the table; `rows`: its trajectory is one
/// over a body.
void check_surface_keys(const config::ReadTable& table, bool rows);

/// The places of `keys`, or those of a trajectory if there are any.
[[nodiscard]] std::shared_ptr<const SurfaceTrack>
surface_track(const SurfaceKeys& keys, std::vector<SurfacePlace> rows, const config::ReadTable& table);

} // namespace obscura::scene
