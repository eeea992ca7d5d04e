// SPDX-License-Identifier: Apache-2.0
#include "serve/compatible/notes.hpp"

#include "service/compatible/codec.hpp"
#include "service/failure.hpp"

#include <fmt/format.h>

namespace obscura::serve::compatible {

using service::compatible::Fields;
using service::compatible::Value;

void Notes::set(const std::string& name, const Value& value) {
    constexpr std::size_t max_bytes = std::size_t{16} << 20;
    const auto before = notes_.find(name);
    const std::size_t bytes = service::compatible::encode({{name, value}}).size();
    const std::size_t left = bytes_ - (before != notes_.end() ? before->second.bytes : 0);
    if (left + bytes > max_bytes)
        throw service::Failure(service::FailureCode::too_large,
                               fmt::format("values of more than {} bytes in all", max_bytes));
    bytes_ = left + bytes;
    notes_[name] = {value, bytes};
}

const Value* Notes::find(const std::string& name) const {
    const auto found = notes_.find(name);
    return found != notes_.end() ? &found->second.value : nullptr;
}

Fields Notes::all() const {
    Fields fields;
    for (const auto& [name, note] : notes_)
        fields.push_back({name, note.value});
    return fields;
}

void Notes::clear() {
    notes_.clear();
    bytes_ = 0;
}

} // namespace obscura::serve::compatible
