// SPDX-License-Identifier: Apache-2.0
// Members of members, for tables whose rows name a member.
#pragma once

namespace obscura::member_chain {

template<typename Owner, typename Member>
Owner owner_of(Member Owner::*);

/// The member that a chain of member pointers leads to: at<&Pose::position_m, &Vec3::x>(pose).
template<auto member, auto... rest>
constexpr auto& at(auto& owner) {
    if constexpr (sizeof...(rest) == 0) {
        return owner.*member;
    } else {
        return at<rest...>(owner.*member);
    }
}

} // namespace obscura::member_chain
