#include "engine/paths/runs/tolerances.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace slabwright {

double safe_chord_mm(double radius, double gouge) { return std::sqrt(8 * radius * 0.65 * gouge); }
std::int32_t safe_pitch(double radius, double gouge) {
    return std::max(1, static_cast<std::int32_t>(
                           std::floor(safe_chord_mm(radius, gouge) / std::numbers::sqrt2 * kUnitsPerMm)));
}
std::int32_t safe_step(double radius, double gouge) {
    return std::max(1, static_cast<std::int32_t>(0.75 * safe_chord_mm(radius, gouge) * kUnitsPerMm));
}
double simplify_tolerance_units(double gouge) { return 0.12 * gouge * kUnitsPerMm; }

double arc_tolerance_units(const Job& job, OperationKind kind) {
    const double finest = 0.18 * job.tolerances.gouge * kUnitsPerMm;
    return kind == OperationKind::rough ? std::max(finest, rough_fit(job.cutting) * kUnitsPerMm) : finest;
}

}  // namespace slabwright
