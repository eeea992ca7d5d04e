// SPDX-License-Identifier: Apache-2.0
// Verb `obscura texture bake`: heights of a terrain, all its sources and detail together, as a giant texture.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"
#include "core/text/suggestion.hpp"
#include "core/units.hpp"
#include "host/interrupt.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/shape_context.hpp"
#include "tools/check/report.hpp"
#include "tools/scene/progress.hpp"
#include "tools/scene/terrain_source.hpp"
#include "tools/verbs/texture.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <optional>

namespace obscura::tools {
namespace {

using namespace terrain;

class TextureBake final : public Verb {
public:
    void declare(host::CommandLine& line) override {
        line.summary = "writes the heights of a scene's terrain as a giant texture";
        line.description =
            "Makes the heights of a planet or terrain of a scene, all its height sources and detail together, at the samples of a map, and writes them as a giant texture (.obt) in u16 with steps by tile. "
            "The map is simple cylindrical, between --west, --east, --south and --north, or polar stereographic within --within degrees of the pole; "
            "of a planar terrain, all of it. "
            "A bake that was interrupted goes on where it stopped when it is called again.";
        line.positional("SCENE", &scene_, "Scene file");
        line.option("-o,--output", &output_, "FILE", "File to write").required = true;
        host::Option& spacing =
            line.number("--spacing", &spacing_m_, "M", "Distance of samples on the map, m", 1e-6, 1e9);
        spacing.required = true;
        line.option("--body", &body_, "NAME",
                    "Body of the scene (default: the first one with such a surface)");
        line.option("--projection", &projection_, "KIND", "Projection of the map (not of planar terrains)")
            .choices = {"simple_cylindrical", "north_polar_stereographic", "south_polar_stereographic"};
        line.number("--west", &west_, "DEG", "Left edge, degrees east", -360, 360);
        line.number("--east", &east_, "DEG", "Right edge, degrees east", -360, 720);
        line.number("--south", &south_, "DEG", "Lower edge, degrees of latitude", -90, 90);
        line.number("--north", &north_, "DEG", "Upper edge, degrees of latitude", -90, 90);
        line.number("--within", &within_, "DEG", "Polar maps: degrees from the pole to the middle of an edge",
                    1e-6, 80);
        line.number("--finest-step", &finest_exponent_, "N",
                    "Heights are rounded to 2^N m where a tile's relief allows it", -20, 10);
        line.flag("--restart", restart_, "Begin anew, whatever an interrupted bake left");
        line.flag("--json", json_, "Print one JSON object");
        line.examples = {
            "obscura texture bake moon.toml --spacing 1000 -o moon.obt",
            "obscura texture bake moon.toml --projection south_polar_stereographic --within 2 --spacing 20 -o pole.obt"};
    }

    [[nodiscard]] bool keeps_work() const override { return true; }

    int run() override {
        const scene::Scene scene = scene::load_scene(config::file_or_shipped(config::shipped_scenes, scene_));
        renderer::ShapeContext context;
        const std::shared_ptr<const renderer::Shape> shape = find(scene, context);
        const TileMaker& maker = shape->tiles()->maker();
        ObtMetadata m = describe(maker.domain());
        TerrainSource source(maker, m.frame(), spacing_m_);
        ObtWriteReport written;
        {
            std::optional<Progress> progress;
            ObtWriteOptions options;
            options.resume = !restart_;
            options.progress = [&](std::uint64_t done, std::uint64_t total) {
                if (!progress) progress.emplace("bake", total);
                progress->done(done);
                return !host::interrupted();
            };
            written = write_obt(output_, m, source, options);
        }
        if (!written.finished) {
            print_message(fmt::format("{}: interrupted: call it again to go on", output_));
            return exit_failure;
        }
        Report report;
        report.add("file", "file", output_);
        report.add("width", "width", m.width);
        report.add("height", "height", m.height);
        report.add("tiles", "tiles with samples", static_cast<std::int64_t>(written.tiles));
        report.add("constant", "tiles of one number", static_cast<std::int64_t>(written.constant));
        report.add("resumed", "tiles of an earlier call", static_cast<std::int64_t>(written.resumed));
        report.add("bytes", "bytes", static_cast<std::int64_t>(written.bytes));
        report.add("least_m", "lowest", written.metadata.statistics[0].least, "m", 3);
        report.add("largest_m", "highest", written.metadata.statistics[0].largest, "m", 3);
        report.print(json_);
        return exit_ok;
    }

private:
    /// A map has no overhangs.
    template<typename Parameters>
    static void keep_domes(scene::Shape& shape) {
        if (auto* const parameters = shape.get_if<Parameters>())
            parameters->relief.detail.boulder_rock_px = 0;
    }

    [[nodiscard]] std::shared_ptr<const renderer::Shape> find(const scene::Scene& scene,
                                                              renderer::ShapeContext& context) const {
        for (const scene::Body& body : scene.bodies) {
            if (!body_.empty() && body.name != body_) continue;
            // Shapes of other kinds may be expensive to make, but most scenes have few.
            context.place = body.name;
            scene::Shape described = body.shape;
            keep_domes<renderer::PlanetParameters>(described);
            keep_domes<renderer::TerrainParameters>(described);
            auto shape = renderer::make_shape(described, context);
            if (shape->tiles() != nullptr) return shape;
            if (!body_.empty())
                throw ConfigError(fmt::format("{}: body '{}' is no planet or terrain", scene_, body_));
        }
        throw ConfigError(body_.empty() ? fmt::format("{}: no body is a planet or terrain", scene_)
                                        : fmt::format("{}: there is no body '{}', {}", scene_, body_,
                                                      allowed_words(body_, scene::names_of(scene.bodies))));
    }

    [[nodiscard]] ObtMetadata describe(const SurfaceDomain& domain) const {
        ObtMetadata m;
        m.type = SampleType::u16;
        m.lattice = true;
        m.finest_exponent = finest_exponent_;
        m.coarsest_exponent = std::max(0, finest_exponent_);
        m.title = "Heights";
        m.source = fmt::format("obscura texture bake {}", scene_).substr(0, 511);
        const double s = spacing_m_;
        const auto samples = [&](double length_m) {
            return static_cast<std::int64_t>(std::clamp(std::round(length_m / s), 1.0, 0x1p41));
        };
        if (domain.is_plane()) {
            m.projection.kind = ProjectionKind::planar;
            const double half = domain.half_edge_m();
            m.width = m.height = samples(2 * half);
            const double step = 2 * half / static_cast<double>(m.width);
            m.transform = {-half, step, 0, half, 0, -step};
            return m;
        }
        m.semi_axes_m = domain.radii_m();
        const double radius = std::max({m.semi_axes_m.x, m.semi_axes_m.y, m.semi_axes_m.z});
        if (projection_ != "simple_cylindrical") {
            const auto kind = *enum_named<ProjectionKind>(projection_);
            m.projection = Projection::of_sphere(kind, radius);
            const double half = 2 * radius * std::tan(within_ * degree / 2);
            m.width = m.height = samples(2 * half);
            const double step = 2 * half / static_cast<double>(m.width);
            m.transform = {-half, step, 0, half, 0, -step};
            return m;
        }
        if (!(east_ > west_ && east_ - west_ <= 360) || !(north_ > south_))
            throw host::UsageError(fmt::format(
                "obscura texture bake: {} to {} E, {} to {} N: allowed are west < east, at most 360 degrees, and south < north",
                west_, east_, south_, north_));
        m.projection =
            Projection::of_sphere(ProjectionKind::simple_cylindrical, radius, 0.5 * (west_ + east_) * degree);
        m.width = samples(radius * (east_ - west_) * degree);
        m.height = samples(radius * (north_ - south_) * degree);
        const MapFrame frame =
            MapFrame::by_edges(m.projection, Registration::pixel, m.width, m.height, west_ * degree,
                               east_ * degree, north_ * degree, south_ * degree);
        m.projection = frame.projection();
        m.transform = frame.transform();
        return m;
    }

    std::string scene_, output_, body_, projection_ = "simple_cylindrical";
    double spacing_m_ = 0, west_ = -180, east_ = 180, south_ = -90, north_ = 90, within_ = 5;
    std::int32_t finest_exponent_ = -4;
    bool restart_ = false, json_ = false;
};

} // namespace

std::unique_ptr<Verb> make_texture_bake() {
    return std::make_unique<TextureBake>();
}

} // namespace obscura::tools
