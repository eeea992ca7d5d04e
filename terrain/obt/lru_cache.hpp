// SPDX-License-Identifier: Apache-2.0
// Cache of shared immutable values, bounded in number, that forgets those not used for the longest time.
#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <utility>

namespace obscura::terrain {

/// Thread-safe. Values that are in use live on when the cache forgets them.
template<typename Key, typename Value>
class LruCache {
public:
    explicit LruCache(std::size_t most) : most_(most) {}

    /// Null: not there.
    [[nodiscard]] std::shared_ptr<const Value> find(const Key& key) {
        const std::lock_guard lock(mutex_);
        const auto it = places_.find(key);
        if (it == places_.end()) return nullptr;
        entries_.splice(entries_.begin(), entries_, it->second);
        return it->second->second;
    }
    void insert(const Key& key, std::shared_ptr<const Value> value) {
        const std::lock_guard lock(mutex_);
        if (most_ == 0 || places_.contains(key)) return; // another thread was faster
        entries_.emplace_front(key, std::move(value));
        places_[key] = entries_.begin();
        if (entries_.size() <= most_) return;
        places_.erase(entries_.back().first);
        entries_.pop_back();
    }

private:
    using Entries = std::list<std::pair<Key, std::shared_ptr<const Value>>>;
    std::size_t most_;
    std::mutex mutex_;
    Entries entries_; ///< the latest used first
    std::map<Key, typename Entries::iterator> places_;
};

} // namespace obscura::terrain
