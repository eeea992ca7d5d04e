// SPDX-License-Identifier: Apache-2.0
// Layer of impact craters, stamped in order of age.
#pragma once

#include "terrain/detail/crater_law.hpp"
#include "terrain/detail/scattered_features.hpp"
#include "terrain/detail/slope_loss.hpp"
#include "terrain/feature_search.hpp"
#include "terrain/height_layer.hpp"

#include <array>
#include <cstdint>
#include <memory_resource>
#include <vector>

namespace obscura::terrain {

using CraterProfile = std::array<double, CraterProfiles::steps + 2>;

struct Crater {
    std::uint64_t id = 0;
    Vec3 position_m; ///< of its centre on the reference surface
    double diameter_m = 0;
    double age_ga = 0;
};

/// Every octave of diameters is a sum of profiles of its own, clamped. A crater removes what older, smaller
/// octaves have on its floor, rim and near ejecta, not what larger ones or layers below have there. Craters
/// fade in from three to six vertices across; where there are samples below, those of more than two to six
/// samples across are left out, as the samples have the real ones.
class Craters final : public HeightLayer {
public:
    struct Settings {
        double age_ga = 3.9;
        double min_diameter_m = 0.5;
        double largest_diameter_m = CraterLaw::largest_diameter_m;
    };

    /// Not larger than a third of the least radius, or of half the edge of a plane. `over_maps`: there may be
    /// layers of samples below.
    Craters(const SurfaceDomain& domain, const Settings& settings, std::uint64_t seed,
            bool over_maps = false);

    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override;
    [[nodiscard]] HeightRange range(const Cap& cap, double spacing_m, HeightRange below) const override;
    [[nodiscard]] double sample_spacing_m(Vec3 /*position_m*/) const override { return 0; }
    /// Without the removal of older craters by later ones.
    void add_lost_slopes(std::span<const Vec3> positions_m, double spacing_m,
                         std::span<const double> sample_spacings_m, std::span<double> lost) const override;

    void find_features(FeatureSearch& search) const override;
    /// Depth in the middle over that of a fresh one, less what later, larger craters removed.
    [[nodiscard]] double share_left(const SurfaceFeature& feature, double sample_spacing_m) const override;

    /// Craters of at least a diameter whose rims, or `radii` times their radii, reach into the cap.
    [[nodiscard]] std::vector<Crater> near(const Cap& cap, double min_diameter_m, double radii = 1) const;
    /// Appends the craters of at least a diameter that are younger than an age and whose radii, `radii`
    /// times, reach into the cap.
    void add_young(const Cap& cap, double min_diameter_m, double age_ga, double radii,
                   std::pmr::vector<Crater>& craters) const;
    /// Share of a crater of a diameter that is added over samples of that spacing.
    [[nodiscard]] static double share(double diameter_m, double sample_spacing_m);
    /// Mean square difference of heights at a distance that the craters make, m2, without the removal of
    /// older ones.
    [[nodiscard]] double deviation_m2(double baseline_m) const;
    [[nodiscard]] const CraterLaw& law() const { return law_; }

private:
    /// A crater on its way into a grid.
    struct Stamp {
        Feature feature;
        double diameter_m = 0, chronology = 0;
        double whole = 0; ///< share of it that is added
        double reach_m = 0;
        CraterProfile profile{};
    };
    struct Placed;
    class Octaves;
    /// What follows from the law for an octave of diameters from low_m to twice that.
    struct OctaveLaw {
        static constexpr std::size_t nodes = 8;
        double low_m;
        std::array<double, nodes + 1> log2_counts; ///< of N(>D) / N(>low), D in even ratios
        double oldest_low, oldest_high;
        double diffusivity_low, diffusivity_high;
    };
    /// Order of stamping.
    [[nodiscard]] static bool older(const Stamp& a, const Stamp& b);
    [[nodiscard]] Stamp stamp_of(const Feature& feature) const;
    /// kappa t over the squared radius.
    [[nodiscard]] double wear(std::size_t octave, double diameter_m, double chronology) const;
    [[nodiscard]] double wear(const Stamp& stamp) const;
    /// Range of an octave's sum.
    [[nodiscard]] HeightRange clamp_of(std::size_t octave) const;
    /// The mean of D^4 of N ~ D^-2 within an octave is that of this diameter.
    [[nodiscard]] double middle_diameter_m(std::size_t octave) const;
    /// As deviation_m2(), of one octave.
    [[nodiscard]] double octave_deviation_m2(std::size_t octave, double baseline_m) const;
    /// Share of the octave's middle diameter, over samples that are 2 to the power `log2_spacing` m apart.
    [[nodiscard]] double octave_share(std::size_t octave, double log2_spacing) const;

    [[nodiscard]] bool exists(const Stamp& stamp) const {
        return stamp.diameter_m >= min_diameter_m_ && stamp.diameter_m <= largest_diameter_m_;
    }

    bool over_maps_;
    double min_diameter_m_, largest_diameter_m_;
    CraterLaw law_;
    std::vector<OctaveLaw> laws_;          ///< of each octave
    std::vector<CraterProfiles> profiles_; ///< of each octave
    FeatureField field_;
    std::vector<SlopeLoss> losses_; ///< of each octave, by its least diameter
};

} // namespace obscura::terrain
