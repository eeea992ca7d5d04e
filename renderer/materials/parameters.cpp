#include "renderer/materials/parameters.hpp"

#include "renderer/materials/material.hpp"

#include <array>
#include <cassert>
#include <type_traits>

namespace obscura::renderer {
namespace {

/// A law without a list has none.
template<typename Law>
struct Named {
    std::string_view name;
    double Law::*member;
};

template<typename Law>
constexpr std::array<Named<Law>, 0> list{};
template<>
constexpr std::array<Named<scene::Minnaert>, 1> list<scene::Minnaert>{
    {{"exponent", &scene::Minnaert::exponent}}};
template<>
constexpr std::array<Named<scene::OrenNayar>, 1> list<scene::OrenNayar>{
    {{"slope", &scene::OrenNayar::slope_rad}}};
template<>
constexpr std::array<Named<scene::Phong>, 3> list<scene::Phong>{{{"diffuse", &scene::Phong::diffuse},
                                                                 {"specular", &scene::Phong::specular},
                                                                 {"exponent", &scene::Phong::exponent}}};
template<>
constexpr std::array<Named<scene::Hapke>, 9> list<scene::Hapke>{
    {{"single_scattering_albedo", &scene::Hapke::single_scattering_albedo},
     {"phase_b", &scene::Hapke::phase_b},
     {"phase_c", &scene::Hapke::phase_c},
     {"shadow_hiding_b0", &scene::Hapke::shadow_hiding_b0},
     {"shadow_hiding_h", &scene::Hapke::shadow_hiding_h},
     {"backscatter_b0", &scene::Hapke::backscatter_b0},
     {"backscatter_h", &scene::Hapke::backscatter_h},
     {"roughness", &scene::Hapke::roughness_rad},
     {"filling_factor", &scene::Hapke::filling_factor}}};
template<>
constexpr std::array<Named<scene::Ggx>, 3> list<scene::Ggx>{{{"roughness", &scene::Ggx::roughness},
                                                             {"reflectance_f0", &scene::Ggx::reflectance_f0},
                                                             {"base_albedo", &scene::Ggx::base_albedo}}};
static_assert(list<scene::Hapke>.size() <= most_parameters);

} // namespace

std::vector<Parameter> parameters_of(const scene::Material& material) {
    return std::visit(
        [](const auto& law) {
            using Law = std::decay_t<decltype(law)>;
            std::vector<Parameter> out;
            if constexpr (std::is_same_v<Law, scene::LunarLambert>)
                out.push_back({"weight", law.weight[0]});
            else
                for (const Named<Law>& parameter : list<Law>)
                    out.push_back({parameter.name, law.*parameter.member});
            return out;
        },
        material);
}

void set_parameter(scene::Material& material, std::size_t index, double value) {
    std::visit(
        [&](auto& law) {
            using Law = std::decay_t<decltype(law)>;
            assert(index < parameters_of(material).size());
            if constexpr (std::is_same_v<Law, scene::LunarLambert>)
                law.weight = {value, 0, 0, 0};
            else if constexpr (!list<Law>.empty())
                law.*(list<Law>[index].member) = value;
        },
        material);
}

} // namespace obscura::renderer
