#include "engine/sheets/jet_feed.h"

#include <cmath>
#include <numbers>

#include "kernels/errors.h"

namespace slabwright {

namespace {

/// W that the abrasive carries.
double abrasive_power(const AbrasiveJet& jet) {
    const double d0 = jet.orifice_mm / 1000, p = jet.pressure_mpa * 1e6, r = jet.abrasive_ratio;
    return std::numbers::pi / 4 * d0 * d0 * r / ((1 + r) * (1 + r)) * std::pow(p, 1.5) *
           std::sqrt(2 / jet.water_kg_m3);
}

void require_positive(const AbrasiveJet& jet, double depth_mm, double other) {
    for (const double value : {jet.pressure_mpa, jet.orifice_mm, jet.insert_mm, jet.abrasive_ratio,
                               jet.water_kg_m3, depth_mm, other})
        if (!(value > 0) || !std::isfinite(value))
            throw Error(ErrorKind::usage, "sheets.jet", "a value of the jet is not over 0", "",
                        "give pressure, orifice, insert, abrasive, energy and depth as they are measured");
}

}  // namespace

double jet_feed(const AbrasiveJet& jet, double depth_mm) {
    require_positive(jet, depth_mm, jet.specific_energy_j_mm3);
    const double per_metre = jet.specific_energy_j_mm3 * 1e9 * jet.insert_mm / 1000 * depth_mm / 1000;  // J
    return abrasive_power(jet) / per_metre * 1000 * 60;
}

double fitted_energy(const AbrasiveJet& jet, double depth_mm, double feed_mm_min) {
    require_positive(jet, depth_mm, feed_mm_min);
    const double metres_per_second = feed_mm_min / 1000 / 60;
    return abrasive_power(jet) / (metres_per_second * jet.insert_mm / 1000 * depth_mm / 1000) / 1e9;
}

}  // namespace slabwright
