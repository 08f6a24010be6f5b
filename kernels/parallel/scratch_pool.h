// Memory to work in that one task leaves to the next.
#pragma once

#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace slabwright {

/// Lends each running task a T: one that was used before, or a new one. Which it gets depends on the threads,
/// so nothing may depend on what is left in it.
template <class T>
class ScratchPool {
public:
    /// @param make() a new one, as std::unique_ptr<T>
    template <class Make>
    [[nodiscard]] std::unique_ptr<T> take(const Make& make) {
        {
            const std::lock_guard lock(mutex_);
            if (!free_.empty()) {
                std::unique_ptr<T> one = std::move(free_.back());
                free_.pop_back();
                return one;
            }
        }
        return make();
    }
    void give(std::unique_ptr<T> one) {
        const std::lock_guard lock(mutex_);
        free_.push_back(std::move(one));
    }

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<T>> free_;
};

/// One that is lent while this lives; without a pool, one of its own.
template <class T>
class PooledScratch {
public:
    explicit PooledScratch(ScratchPool<T>* pool)
        : pool_(pool),
          scratch_(pool != nullptr ? pool->take([] { return std::make_unique<T>(); })
                                   : std::make_unique<T>()) {}
    ~PooledScratch() {
        if (pool_ != nullptr) pool_->give(std::move(scratch_));
    }
    PooledScratch(const PooledScratch&) = delete;
    PooledScratch& operator=(const PooledScratch&) = delete;
    [[nodiscard]] T& operator*() const { return *scratch_; }

private:
    ScratchPool<T>* pool_;
    std::unique_ptr<T> scratch_;
};

}  // namespace slabwright
