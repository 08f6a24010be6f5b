// How fast an abrasive jet cuts (METHOD.md section 13; FDFF equation 3, after Limbachiya and Patel 2011).
#pragma once

namespace slabwright {

/// A jet and what it cuts.
struct AbrasiveJet {
    double pressure_mpa = 350;
    double orifice_mm = 0.35;             ///< d0
    double insert_mm = 1.02;              ///< di, of the focusing tube: the width of the cut
    double abrasive_ratio = 0.12;         ///< R, mass of abrasive to mass of water
    double specific_energy_j_mm3 = 13.6;  ///< u: of what is cut; fitted_energy() finds it from a test cut
    double water_kg_m3 = 1000;
};

/// v = (π/4) d0² R/(1 + R)² p^1.5 √(2/ρ) / (u di h): the power of the abrasive over what a millimetre of cut
/// takes.
/// @param depth_mm h along the jet: the sheet's thickness over the cosine of the head's tilt
/// @returns mm/min. @throws Error(usage, "sheets.jet") where a value is not over 0
[[nodiscard]] double jet_feed(const AbrasiveJet& jet, double depth_mm);

/// The specific energy with which jet_feed() gives the feed at which a test cut of that depth just held.
/// @returns J/mm³. @throws as jet_feed()
[[nodiscard]] double fitted_energy(const AbrasiveJet& jet, double depth_mm, double feed_mm_min);

}  // namespace slabwright
