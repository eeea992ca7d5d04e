// SPDX-License-Identifier: Apache-2.0
// Error answer of a call: code, message, field, allowed values and hint.
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

namespace obscura::service {

/// Why a request was not done; clients tell errors apart by its name.
enum class FailureCode : std::uint8_t {
    bad_message,  ///< framing or head: the connection ends
    unknown_call, ///< no call of that name
    bad_argument, ///< a field of the request
    bad_scene,    ///< keys of the scene, or files that they name
    no_hello,     ///< the first request is not hello, or not of this protocol
    forbidden,    ///< the connection lacks the permission
    too_large,    ///< beyond a limit of the server
    busy,         ///< no room for one more client or request
    controlled,   ///< another client has the camera
    not_now,      ///< the camera's state does not allow it
    cancelled,    ///< by a call of the client
    internal,     ///< a fault of the server
};
constexpr auto enum_names(FailureCode /*type*/) {
    using C = FailureCode;
    return std::array{EnumName{C::bad_message, "bad-message"},   EnumName{C::unknown_call, "unknown-call"},
                      EnumName{C::bad_argument, "bad-argument"}, EnumName{C::bad_scene, "bad-scene"},
                      EnumName{C::no_hello, "no-hello"},         EnumName{C::forbidden, "forbidden"},
                      EnumName{C::too_large, "too-large"},       EnumName{C::busy, "busy"},
                      EnumName{C::controlled, "controlled"},     EnumName{C::not_now, "not-now"},
                      EnumName{C::cancelled, "cancelled"},       EnumName{C::internal, "internal"}};
}

/// Thrown by calls; becomes the error message of the request. what() is one line.
class Failure : public std::runtime_error {
public:
    Failure(FailureCode the_code, const std::string& message) : std::runtime_error(message), code(the_code) {}

    FailureCode code;
    std::string field{};   ///< of the request or the scene, as a dotted path; empty: none
    std::string allowed{}; ///< values of the field; empty: not known
    std::string hint{};    ///< what to try; empty: none
};

/// A field of the request that cannot be what it is; `message` names it.
[[nodiscard]] inline Failure bad_argument(std::string_view field, const std::string& message,
                                          const std::string& allowed = {}) {
    Failure failure(FailureCode::bad_argument, message);
    failure.field = field;
    failure.allowed = allowed;
    return failure;
}

} // namespace obscura::service
