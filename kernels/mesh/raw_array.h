// Large scratch arrays whose elements are all written before they are read.
#pragma once

#include <cstddef>
#include <span>
#include <type_traits>

#include "kernels/mesh/bulk_memory.h"

namespace slabwright {

/// `size` elements of indeterminate value. T is a plain aggregate.
template <class T>
class RawArray {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    RawArray() = default;
    explicit RawArray(std::size_t size)
        : data_(size == 0 ? nullptr : static_cast<T*>(take_bulk(size * sizeof(T)))), size_(size) {}
    RawArray(RawArray&& other) noexcept : data_(other.data_), size_(other.size_) {
        other.data_ = nullptr;
        other.size_ = 0;
    }
    RawArray& operator=(RawArray&& other) noexcept {
        if (this != &other) {
            release();
            data_ = other.data_;
            size_ = other.size_;
            other.data_ = nullptr;
            other.size_ = 0;
        }
        return *this;
    }
    RawArray(const RawArray&) = delete;
    RawArray& operator=(const RawArray&) = delete;
    ~RawArray() { release(); }

    [[nodiscard]] T* data() noexcept { return data_; }
    [[nodiscard]] const T* data() const noexcept { return data_; }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] T& operator[](std::size_t i) noexcept { return data_[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return data_[i]; }
    [[nodiscard]] std::span<T> span() noexcept { return {data_, size_}; }
    [[nodiscard]] std::span<const T> span() const noexcept { return {data_, size_}; }

private:
    void release() noexcept {
        if (data_ != nullptr) release_bulk(data_, size_ * sizeof(T));
    }
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace slabwright
