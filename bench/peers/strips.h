// Published instances of irregular strip packing, by the EURO group on cutting and packing (ESICUP).
#pragma once

#include <array>
#include <string>
#include <vector>

namespace slabwright::bench {

/// Pieces of one shape.
struct StripKind {
    int count = 0;
    std::vector<std::array<double, 2>> points;  ///< units of the instance, either way round
};

/// Pieces that are packed on a strip which is as long as it must be; they may be turned by half a turn.
struct PublishedStrip {
    std::string name;
    double width = 0;  ///< units
    double scale = 0;  ///< mm a unit, that makes the strip 790 or 800 mm wide
    std::vector<StripKind> kinds;
};

/// shirts: 99 pieces of 8 kinds. J. Oliveira, A. Gomes, J. Ferreira, TOPOS, OR Spektrum 22 (2000).
[[nodiscard]] PublishedStrip shirts();
/// trousers: 64 pieces of 17 kinds; Oliveira and others, too. Points as in github.com/JeroenGar/jagua-rs,
/// assets/trousers.json.
[[nodiscard]] PublishedStrip trousers();
/// swim: 48 pieces of 10 kinds; Oliveira and others, too. Points as in github.com/JeroenGar/jagua-rs,
/// assets/swim.json, rounded to hundredths.
[[nodiscard]] PublishedStrip swim();

}  // namespace slabwright::bench
