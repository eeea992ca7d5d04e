// SPDX-License-Identifier: Apache-2.0
// Star field: places and band irradiances of the stars of a scene.
#pragma once

#include "ephemeris/kernels/apparent_place.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Inertial unit vector (J2000 axes) of a right ascension and declination.
[[nodiscard]] Vec3 star_direction(double right_ascension_rad, double declination_rad);

/// Time and place from which stars are seen.
struct StarObserver {
    double years = 0; ///< Julian years after J2000.0
    Vec3 position_au; ///< from the solar system's barycentre, ICRF axes
    /// The Sun from the observer, ICRF axes, for the deflection of light; 0: none.
    Vec3 sun_m{};
};

/// Place of a star at J2000.0 and what moves it.
struct StarPlace {
    Vec3 direction; ///< unit, inertial
    Vec3 motion;    ///< proper motion, rad per Julian year
    double parallax_rad = 0;

    /// Unit direction for an observer.
    [[nodiscard]] Vec3 from(const StarObserver& observer) const {
        const Vec3 shift = motion * observer.years - observer.position_au * parallax_rad;
        const Vec3 straight = shift == Vec3{0, 0, 0} ? direction : normalized(direction + shift);
        return observer.sun_m == Vec3{0, 0, 0}
                   ? straight
                   : ephemeris::starlight_deflected_by_sun(straight, observer.sun_m);
    }
};

/// Number of points that no catalogue numbers: those of galaxies, and stars of known irradiance.
constexpr std::uint32_t no_star = std::numeric_limits<std::uint32_t>::max();

/// Stars that are near a field of view, by ascending number; then the points that have none.
struct FieldStars {
    std::vector<std::uint32_t> numbers;
    std::vector<StarPlace> places;
    std::vector<double> irradiance_w_m2; ///< all bands of the first star, then of the next one

    void clear();
};

/// Irradiances of stars of known magnitude in the bands of a scene; the same as star_irradiance_w_m2(), from
/// tables. Immutable; thread-safe.
class StarPhotometry {
public:
    StarPhotometry(const std::vector<SpectralBand>& bands, scene::StarSpectrum spectrum);

    /// Fills `irradiance_w_m2`, one for each band. StarSpectrum: that of the constructor. Real-time safe.
    void irradiance(const scene::Star& star, std::span<double> irradiance_w_m2) const;

private:
    /// Irradiances at V = 0 of each template, or of each black body from the bluest B-V on.
    std::vector<double> zero_w_m2_;
    scene::StarSpectrum spectrum_;
};

/// Stars of a scene, by the numbers of scene::star_of().
/// Immutable; thread-safe.
class StarField {
public:
    /// Throws ConfigError when a listed star's numbers are not finite.
    explicit StarField(const scene::Scene& scene);

    /// Whether there is nothing, neither stars nor galaxies.
    [[nodiscard]] bool empty() const { return size() == 0 && point_directions_.empty(); }
    [[nodiscard]] std::size_t size() const { return directions_.size() + (file_ ? file_->size() : 0); }
    [[nodiscard]] StarPlace place(std::uint32_t number) const;
    /// Irradiance of a star in a band, W/m2.
    [[nodiscard]] double irradiance(std::uint32_t number, std::size_t band) const;

    /// Fills `stars` with those that an observer sees within the cone about the unit vector `axis`, inertial,
    /// and perhaps some beside it.
    void inside(Vec3 axis, double half_angle_rad, const StarObserver& observer, FieldStars& stars) const;

private:
    void add_galaxy(const scene::SkyObject& galaxy, const std::vector<SpectralBand>& bands);
    void add_measured(const scene::SkyObject& star);
    void add(std::uint32_t number, FieldStars& stars) const;
    void irradiance_of(std::uint32_t number, std::span<double> irradiance_w_m2) const;

    std::vector<Vec3> directions_;        ///< of the listed ones
    std::vector<double> irradiance_w_m2_; ///< of the listed ones, bands of each
    std::vector<Vec3> point_directions_;
    std::vector<double> point_irradiance_w_m2_; ///< bands of each
    std::shared_ptr<const ephemeris::StarFile> file_;
    double limiting_v_;
    scene::StarSpectrum spectrum_;
    StarPhotometry photometry_;
    std::size_t bands_;
};

} // namespace obscura::renderer
