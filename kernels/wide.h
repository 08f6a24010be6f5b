// Functions whose loops gain from wide vectors are compiled for several instruction sets; the one that the
// machine has is taken when the program starts. All of them give the same bits: they do the same operations,
// each rounded as IEEE says, and none is fused.
#pragma once

#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SLABWRIGHT_WIDE [[gnu::target_clones("avx512f", "avx2", "default")]]
#else
#define SLABWRIGHT_WIDE
#endif
