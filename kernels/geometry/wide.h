// Functions whose loops gain from wide vectors are compiled for several instruction sets; the one that the
// machine has is taken when the program starts. All of them give the same bits: they do the same operations,
// each rounded as IEEE says, and none is fused.
//
// The vectors are named after what they hold and how many. Functions take them by reference, for how one is
// passed by value depends on the instruction set.
#pragma once

#include <cstdint>

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SLABWRIGHT_WIDE [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define SLABWRIGHT_WIDE
#endif

namespace slabwright {

using Floats4 [[gnu::vector_size(4 * sizeof(float))]] = float;
using Floats8 [[gnu::vector_size(8 * sizeof(float))]] = float;
using Doubles4 [[gnu::vector_size(4 * sizeof(double))]] = double;
using Doubles8 [[gnu::vector_size(8 * sizeof(double))]] = double;
using Ints8 [[gnu::vector_size(8 * sizeof(std::int32_t))]] = std::int32_t;
using Words8 [[gnu::vector_size(8 * sizeof(std::uint32_t))]] = std::uint32_t;
using Longs4 [[gnu::vector_size(4 * sizeof(std::int64_t))]] = std::int64_t;
using Longs8 [[gnu::vector_size(8 * sizeof(std::int64_t))]] = std::int64_t;
using Chars8 [[gnu::vector_size(8)]] = std::int8_t;
using Bytes8 [[gnu::vector_size(8)]] = std::uint8_t;

}  // namespace slabwright
