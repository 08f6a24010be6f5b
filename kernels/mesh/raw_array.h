// Large scratch arrays whose elements are all written before they are read: std::vector would first fill them with
// zeros on one thread, which costs as much as the parallel work that follows.
#pragma once

#include <cstddef>
#include <new>
#include <span>
#include <type_traits>

namespace slabwright {

/// `size` elements of indeterminate value. T is a plain aggregate.
template <class T>
class RawArray {
    static_assert(std::is_trivially_copyable_v<T> && std::is_trivially_destructible_v<T>);

public:
    RawArray() = default;
    explicit RawArray(std::size_t size) : data_(static_cast<T*>(::operator new(size * sizeof(T)))), size_(size) {}
    RawArray(RawArray&& other) noexcept : data_(other.data_), size_(other.size_) { other.data_ = nullptr, other.size_ = 0; }
    RawArray& operator=(RawArray&& other) noexcept {
        if (this != &other) {
            ::operator delete(data_);
            data_ = other.data_, size_ = other.size_;
            other.data_ = nullptr, other.size_ = 0;
        }
        return *this;
    }
    RawArray(const RawArray&) = delete;
    RawArray& operator=(const RawArray&) = delete;
    ~RawArray() { ::operator delete(data_); }

    [[nodiscard]] T* data() noexcept { return data_; }
    [[nodiscard]] const T* data() const noexcept { return data_; }
    [[nodiscard]] std::size_t size() const noexcept { return size_; }
    [[nodiscard]] T& operator[](std::size_t i) noexcept { return data_[i]; }
    [[nodiscard]] const T& operator[](std::size_t i) const noexcept { return data_[i]; }
    [[nodiscard]] std::span<T> span() noexcept { return {data_, size_}; }
    [[nodiscard]] std::span<const T> span() const noexcept { return {data_, size_}; }

private:
    T* data_ = nullptr;
    std::size_t size_ = 0;
};

}  // namespace slabwright
