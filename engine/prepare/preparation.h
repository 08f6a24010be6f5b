// From what a job asks of a model to what is done to it (METHOD.md section 15).
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/job.h"
#include "kernels/geometry/affine.h"
#include "kernels/skin/skin.h"

namespace slabwright {

/// A model is placed by the map, then gets its skin. Turn, scale, contraction and mirror come before the
/// skin, the shift after it: a skin has the same thickness wherever it lies, so one map holds them all.
struct Preparation {
    AffineMap map;  ///< mm to mm
    Skin skin;
    friend bool operator==(const Preparation&, const Preparation&) = default;
    [[nodiscard]] bool changes_nothing() const { return map.is_identity() && skin.mm == 0; }
};

/// By how much a metal contracts from pouring to room temperature, as pattern makers allow for it.
struct Contraction {
    std::string_view metal;
    double percent;
    std::string_view source;
};
[[nodiscard]] std::span<const Contraction> contractions();

/// What "1.3 %", "1.3" or "aluminium" says, as a share: 0.013.
/// @throws Error(usage, "job.shrink") that names the metals; outside of 0 to 20 %
[[nodiscard]] double contraction_of(const std::string& shrink);

/// R = Rz·Ry·Rx about fixed axes, in degrees; exact in multiples of 90.
[[nodiscard]] AffineMap turned(const std::array<double, 3>& degrees);

/// @throws Error(usage, "job.shrink")
[[nodiscard]] Preparation preparation_of(const PrepareJob& job);

/// One line on what is done: "turned by 90 0 0 degrees, scaled by 1.013 (aluminium, 1.3 %)"; "" for nothing.
[[nodiscard]] std::string told(const PrepareJob& job);

}  // namespace slabwright
