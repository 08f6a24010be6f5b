// What a cutter's lower end looks like as it turns: the one description from which each kernel takes what it
// can cut with.
#pragma once

#include <cstdint>

namespace slabwright {

/// The forms that radius, corner and taper make.
enum class CutterForm : std::uint8_t {
    flat,          ///< a cylinder with a level floor
    ball,          ///< half a ball under a cylinder
    bull_nose,     ///< a cylinder whose floor is rounded off at its rim
    tapered_ball,  ///< a ball under a cone that widens to the radius
    cone,          ///< a point, as of a drill
};

/// A surface of revolution about a vertical axis, below a shank of the same radius. A new form is a new
/// enumerator here; every switch over it then fails to compile until it says what it does with that form.
struct CutterShape {
    double radius = 0;  ///< mm, the largest
    double corner = 0;  ///< mm: of the rounding between floor and flank; as large as the radius, it is a ball
    double taper_rad = 0;  ///< between the axis and the flank; 0: upright

    [[nodiscard]] CutterForm form() const {
        if (taper_rad > 0) return corner > 0 ? CutterForm::tapered_ball : CutterForm::cone;
        if (corner <= 0) return CutterForm::flat;
        return corner < radius ? CutterForm::bull_nose : CutterForm::ball;
    }
    [[nodiscard]] bool is_flat() const { return corner <= 0 && taper_rad <= 0; }
    [[nodiscard]] bool is_ball() const { return corner > 0 && corner >= radius && taper_rad <= 0; }
    /// A flat or a ball: facets are met by these many at a time, by others one by one, which takes longer.
    [[nodiscard]] bool is_plain() const { return is_flat() || is_ball(); }
    friend bool operator==(const CutterShape&, const CutterShape&) = default;
};

/// A cylinder with a level floor; half a ball under a cylinder.
[[nodiscard]] constexpr CutterShape flat_cutter(double radius) { return {radius, 0, 0}; }
[[nodiscard]] constexpr CutterShape ball_cutter(double radius) { return {radius, radius, 0}; }

/// The words for a form, for messages.
[[nodiscard]] const char* name_of(CutterForm form);

/// Refuses a form that a kernel does not take.
/// @throws Error(usage, "tool.shape")
[[noreturn]] void refuse_form(CutterForm form, const char* question);

}  // namespace slabwright
