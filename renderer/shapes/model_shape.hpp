// SPDX-License-Identifier: Apache-2.0
// Surface that a user has written in SuMoL.
#pragma once

#include "models/kinds/shape_program.hpp"
#include "models/values/model_values.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// Parameters of ModelShape: those that the model declares.
struct ModelShapeParameters : models::ModelValues {
    static constexpr std::string_view kind = "model";
    static constexpr std::string_view help =
        "A surface of your own in a SuMoL file, see models.md: shape = { model = \"FILE.shp\", PARAMETER = VALUE }.";
    using Family = scene::ShapeFamily;

    Vec3 radii_m{}; ///< of the ellipsoid under height()
};
[[nodiscard]] scene::ParameterList declare(ModelShapeParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const ModelShapeParameters& p, ShapeContext& context);
/// Keys beside those of the parameters of the model: of the ellipsoid under height().
[[nodiscard]] config::Keys ellipsoid_keys(ModelShapeParameters& p);
/// What the shape is made of beside its parameters: text, globals and instruction set.
[[nodiscard]] std::string identity_of(const ModelShapeParameters& p);

/// The surface for these values. Throws ConfigError.
[[nodiscard]] std::shared_ptr<const models::ShapeProgram> shape_program(const ModelShapeParameters& p);

/// Goes along rays by models::trace().
class ModelShape final : public Shape {
public:
    /// Throws ConfigError for a model that is no surface.
    explicit ModelShape(const ModelShapeParameters& p);

    [[nodiscard]] double bounding_radius_m() const override { return program_->bounding_radius_m(); }
    [[nodiscard]] bool shadows_itself() const override { return true; }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;
    [[nodiscard]] bool counts_doubts() const override { return true; }
    [[nodiscard]] std::vector<std::string> warnings() const override { return warnings_; }

private:
    std::shared_ptr<const models::ShapeProgram> program_;
    std::vector<std::string> warnings_;
};

} // namespace obscura::renderer
