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
class Spares {
public:
    /// @param make() a new one, as std::unique_ptr<T>
    template <class Make>
    [[nodiscard]] std::unique_ptr<T> take(const Make& make) {
        {
            const std::lock_guard lock(mutex_);
            if (!spare_.empty()) {
                std::unique_ptr<T> one = std::move(spare_.back());
                spare_.pop_back();
                return one;
            }
        }
        return make();
    }
    void give(std::unique_ptr<T> one) {
        const std::lock_guard lock(mutex_);
        spare_.push_back(std::move(one));
    }

private:
    std::mutex mutex_;
    std::vector<std::unique_ptr<T>> spare_;
};

/// One that is lent while this lives; without spares, one of its own.
template <class T>
class Lent {
public:
    explicit Lent(Spares<T>* spares)
        : spares_(spares),
          one_(spares != nullptr ? spares->take([] { return std::make_unique<T>(); })
                                 : std::make_unique<T>()) {}
    ~Lent() {
        if (spares_ != nullptr) spares_->give(std::move(one_));
    }
    Lent(const Lent&) = delete;
    Lent& operator=(const Lent&) = delete;
    [[nodiscard]] T& operator*() const { return *one_; }

private:
    Spares<T>* spares_;
    std::unique_ptr<T> one_;
};

}  // namespace slabwright
