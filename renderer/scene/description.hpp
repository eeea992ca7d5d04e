// SPDX-License-Identifier: Apache-2.0
// Type-erased description of one kind of a family, such as shapes or materials: name of the kind and values
// of its parameters.
#pragma once

#include <any>
#include <concepts>
#include <string_view>
#include <utility>

namespace obscura::scene {

/// The parameters of a kind are a struct of its own that names the kind and its family:
///     struct LambertParameters {
///         static constexpr std::string_view kind = "lambert";
///         using Family = scene::MaterialFamily;
///         double albedo = 0.1;
///     };
template<typename P, typename Family>
concept ParametersOf = std::same_as<typename P::Family, Family>;

/// Holds the parameters of any kind of `TheFamily` by value; their type is known only at run time, so that a
/// new kind changes nothing here. Any struct of parameters of the family converts to it.
template<typename TheFamily>
class Description {
public:
    /// Empty: has no kind.
    Description() = default;
    template<typename P>
    requires ParametersOf<P, TheFamily> Description(P parameters)
        : kind_(P::kind), parameters_(std::move(parameters)) {}

    /// Name of the kind; empty: none.
    [[nodiscard]] std::string_view kind() const noexcept { return kind_; }
    /// The parameters if they are a P, else null.
    template<typename P>
    [[nodiscard]] P* get_if() noexcept {
        return std::any_cast<P>(&parameters_);
    }
    template<typename P>
    [[nodiscard]] const P* get_if() const noexcept {
        return std::any_cast<P>(&parameters_);
    }
    /// Throws std::bad_any_cast when the parameters are not a P.
    template<typename P>
    [[nodiscard]] P& get() {
        return std::any_cast<P&>(parameters_);
    }
    template<typename P>
    [[nodiscard]] const P& get() const {
        return std::any_cast<const P&>(parameters_);
    }

private:
    std::string_view kind_{};
    std::any parameters_{};
};

} // namespace obscura::scene
