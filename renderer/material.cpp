#include "renderer/material.hpp"

#include "core/error.hpp"
#include "renderer/lambert.hpp"
#include "renderer/lommel_seeliger.hpp"

#include <fmt/format.h>

namespace obscura::renderer {
namespace {

void check_albedo(double albedo, const std::string& place) {
    if (!(albedo >= 0 && albedo <= 1))
        throw ConfigError(fmt::format("{}: albedo {}: allowed 0 to 1", place, albedo));
}

} // namespace

std::unique_ptr<Material> make_material(const scene::Material& description, const std::string& place) {
    struct Maker {
        const std::string& place;
        std::unique_ptr<Material> operator()(const scene::Lambert& d) const {
            check_albedo(d.albedo, place);
            return std::make_unique<Lambert>(d);
        }
        std::unique_ptr<Material> operator()(const scene::LommelSeeliger& d) const {
            check_albedo(d.albedo, place);
            return std::make_unique<LommelSeeliger>(d);
        }
    };
    return std::visit(Maker{place}, description);
}

} // namespace obscura::renderer
