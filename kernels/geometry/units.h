// Lengths and places in integers of 0.1 µm, as paths and loops have them. Names that end in `units` are in
// 0.1 µm, those without a unit in millimetres.
#pragma once

#include <cmath>
#include <cstdint>

namespace slabwright {

/// Coordinates and paths are integers in units of 0.1 µm: int32 reaches ±214 m, products go to int64.
inline constexpr double kUnitsPerMm = 10000.0;

/// Nearest unit of a length in millimetres (halves away from zero, on every machine).
[[nodiscard]] inline std::int32_t to_units(double mm) {
    return static_cast<std::int32_t>(std::llround(mm * kUnitsPerMm));
}
[[nodiscard]] inline double to_mm(std::int64_t units) { return static_cast<double>(units) / kUnitsPerMm; }

/// A place in the plane, 0.1 µm.
struct Point2 {
    std::int32_t x = 0, y = 0;
    friend bool operator==(const Point2&, const Point2&) = default;
    friend auto operator<=>(const Point2&, const Point2&) = default;
};

}  // namespace slabwright
