// How the tolerances of a job are shared out among chords, thinning and arcs.
#pragma once

#include <cstdint>

#include "engine/plan.h"

namespace slabwright {

/// Longest chord between exact cutter locations that stays within 0.65 of the gouge tolerance (see
/// level_contours), in 0.1 µm for a grid's pitch (chord/√2), and what simplifying may add (0.12 of it). The
/// arcs and longer chords that are fitted to a finished operation may add 0.18 more, so that all of them stay
/// within 0.95; to a roughing, a share of what it leaves.
[[nodiscard]] double safe_chord_mm(double radius, double gouge);
[[nodiscard]] std::int32_t safe_pitch(double radius, double gouge);
/// Between places of a line whose chords are looked at one by one, 0.1 µm: three quarters of that chord. Like
/// a pitch it is never 0, whatever the tolerance.
[[nodiscard]] std::int32_t safe_step(double radius, double gouge);
[[nodiscard]] double simplify_tolerance_units(double gouge);
[[nodiscard]] double arc_tolerance_units(const Job& job, OperationKind kind);

}  // namespace slabwright
