// SPDX-License-Identifier: Apache-2.0
// Layer of boulders as domes, by a power law of sizes, denser on the ejecta of young craters.
#pragma once

#include "terrain/detail/craters.hpp"
#include "terrain/detail/scattered_features.hpp"
#include "terrain/feature_search.hpp"
#include "terrain/height_layer.hpp"

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace obscura::terrain {

struct Boulder {
    std::uint64_t id = 0;
    Vec3 position_m;       ///< of its centre on the reference surface
    double diameter_m = 0; ///< longest axis
    double height_m = 0;   ///< above the ground around it
};

/// Half ellipsoids, horizontal axes 2 : sqrt 2 (Michikami, Hagermann, Boulder sizes and shapes on asteroids,
/// Icarus 357, 2021), turned at random, 0.2 to 0.45 diameters high: partly buried. Where they overlap, the
/// highest counts. They fade in from three to six vertices across. With `rock_cells`, those higher than the
/// shortest of the axes 2 : sqrt 2 : 1 is long by half, which overhang, are left out of finer tiles: there
/// they are rocks of those axes that stand on the ground, with the same place, top and direction.
class Boulders final : public HeightLayer {
public:
    struct Settings {
        double per_m2 = 3e-4; ///< N(>1 m) without ejecta; 3e-4 and 2.482: the Moon as VIPER's team has it
        double index = 2.482; ///< N(>D) = per_m2 (D / 1 m)^-index
        double min_diameter_m = 0.2;
        double largest_diameter_m = 10;
        /// At the rim of a fresh crater there are 1 + ejecta times as many, less by exp(-(r - 1) / 0.7) at r
        /// radii and in proportion to the age, up to 0.3 Ga, when boulders are gone (Basilevsky, Head, Horz,
        /// Survival times of meter-sized boulders on the surface of the Moon, PSS 89, 2013).
        double ejecta = 20;
        /// Vertices across from which those that overhang are rocks, at least whole_cells; 0: none.
        double rock_cells = 0;
    };
    /// Vertices across from which domes are whole.
    static constexpr double whole_cells = 6;

    /// `craters` may be null.
    Boulders(const SurfaceDomain& domain, const Settings& settings, std::uint64_t seed,
             std::shared_ptr<const Craters> craters);

    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override;
    [[nodiscard]] HeightRange range(const Cap& cap, double spacing_m, HeightRange below) const override;
    [[nodiscard]] double sample_spacing_m(Vec3 /*position_m*/) const override { return 0; }

    void add_rocks(TileKey tile, std::vector<StandingRock>& rocks) const override;
    [[nodiscard]] double above_ground_m(Vec3 vertex_m, double spacing_m) const override;
    void find_features(FeatureSearch& search) const override;
    [[nodiscard]] double share_left(const SurfaceFeature& feature, double sample_spacing_m) const override;

    /// Boulders of at least a diameter that touch the cap.
    [[nodiscard]] std::vector<Boulder> near(const Cap& cap, double min_diameter_m) const;

private:
    /// A boulder with what its shape follows from.
    struct Dome {
        Boulder boulder;
        Vec3 along, across; ///< over the semi-axes: the unit circle is its foot
        std::uint32_t form = 0;
        /// Share of its height that it has at a place, seen from its centre.
        [[nodiscard]] double profile(Vec3 way_m) const;
    };
    [[nodiscard]] std::vector<Dome> domes(const Cap& cap, double min_diameter_m) const;
    /// Height of a dome's top in tiles of a spacing.
    [[nodiscard]] double top_m(const Boulder& boulder, double spacing_m) const;
    /// Whether tiles of a spacing have the boulder as a rock.
    [[nodiscard]] bool is_rock(const Boulder& boulder, double spacing_m) const;
    [[nodiscard]] bool exists(double diameter_m) const {
        return diameter_m >= settings_.min_diameter_m && diameter_m <= settings_.largest_diameter_m;
    }
    [[nodiscard]] double diameter_m(const Feature& feature) const;
    /// Whether there is a boulder in that place, by the craters around.
    [[nodiscard]] bool stands(const Feature& feature, std::span<const Crater> around) const;

    bool plane_;
    Settings settings_;
    std::shared_ptr<const Craters> craters_;
    FeatureField field_;
};

} // namespace obscura::terrain
