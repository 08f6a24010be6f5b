// The seed of a property test's random cases.
#pragma once

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

namespace slabwright::test {

/// The same in every run, so that what fails can be run again; SLABWRIGHT_SEED=<number> gives another,
/// SLABWRIGHT_SEED=random draws a new one each time, for soaks. Prints which it is.
inline std::uint32_t seed() {
    std::uint32_t seed = 20261121;
    if (const char* wanted = std::getenv("SLABWRIGHT_SEED"))
        seed = wanted == std::string("random")
                   ? std::random_device{}()
                   : static_cast<std::uint32_t>(std::strtoul(wanted, nullptr, 10));
    std::printf("seed %lu\n", static_cast<unsigned long>(seed));
    return seed;
}

}  // namespace slabwright::test
