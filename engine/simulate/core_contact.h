// What the core of a cutter, within which it has no edge, comes down on. The stock alone does not tell: a
// simulated cutter takes all that its disc covers, a real one only what its edges reach.
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "engine/job.h"
#include "engine/simulate/program.h"
#include "kernels/stock/stock.h"

namespace slabwright {

/// Watches one tool over one piece of stock. The edges are a ring from the core to the rim. What stands under
/// the core of a tool that goes down, and was not cut by the ring before, is still there when the simulated
/// stock has lost it; it is remembered until the ring has passed over it.
///
/// Along one straight motion a point is under the ring, under the core and under the ring again, each for one
/// stretch of the way, so what stands there at its end and the most that it stood over the tip follow in
/// closed form.
///
/// On a way no steeper than ramp_limit_deg() stock may stand as high under the core as core_recess(), for
/// that is what the steepest straight ramp leaves. On a steeper way it may not, but for kScrape and for what
/// has stood as high under the core before: a tool may come down again where it was on its ramp.
class CoreContact {
public:
    /// What was met, over all motions so far.
    struct Findings {
        double deepest = 0;             ///< mm that stock stood over the core's lower face
        std::array<double, 2> where{};  ///< of the deepest
        double z = 0;                   ///< of the tip there
        std::uint32_t line = 0;         ///< of the deepest
        std::uint64_t cells = 0;        ///< over which more stood than may, at least once
        /// The lines over which more stood than may, in their order, each with the most, mm.
        std::vector<std::pair<std::uint32_t, double>> lines{};
    };

    /// @param grid of the stock that motions are followed over
    CoreContact(const Tool& tool, const CellGrid& grid);

    /// Whether the tool has a core at all; where not, no motion needs to be followed.
    [[nodiscard]] bool watches() const { return radius_ > 0; }
    /// Whether a motion has to be followed: it comes down on something, or may clear what is remembered.
    [[nodiscard]] bool concerns(Stock& stock, const ProgramStep& from, const ProgramStep& to) const;
    /// Follows a motion, which the stock has not met yet; all before it, it has.
    void follow(const Stock& stock, const ProgramStep& from, const ProgramStep& to);
    [[nodiscard]] const Findings& findings() const { return findings_; }

    static constexpr double kScrape = 0.25;  ///< mm that may stand under a core that goes straight down

private:
    struct Way;
    void follow_cell(const Way& way, std::size_t cell, double stands, double simulated);
    CellGrid grid_;
    double radius_ = 0, rim_ = 0;  // mm, of the core and of the tool
    double slope_ = 0;             // of the steepest ramp
    double allowed_on_ramp_ = 0;   // mm
    std::vector<float> stands_;    // by cell: z of what is remembered, or kNothing; empty until needed
    std::vector<float> borne_;     // the same cells: mm that it stood over the tip, where it might
    std::vector<std::size_t> remembered_;
    std::vector<char> told_;  // by cell: whether it is one of the findings'; empty until needed
    Findings findings_;
};

}  // namespace slabwright
