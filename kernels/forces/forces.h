// What a milling cut does to cutter and wood (LUO 6.2, 6.5.1; METHOD.md section 8): the edge-force model of
// Altintas for flat, bull-nose and ball end mills, for one cut in double precision and for any number of cuts
// on an OpenCL device.
//
// Angles are those of the tooth: 0 where up milling enters, π/2 in the direction of feed, π where down
// milling leaves. At the height z above the tip a tooth lags by z·tan(helix)/R. On the disc dz at the edge's
// slope κ (90° on a flat end mill and on a ball's shank; sin κ = r(z)/R on the ball, and likewise on a
// bull-nose's corner), db = dz/sin κ of edge cuts a chip h = c·sin φ·sin κ thick, with
//     dFt = (Ktc·h + Kte)·db,  dFr = (Krc·h + Kre)·db,  dFa = (Kac·h + Kae)·db,
//     dFx = −dFt·cos φ − (dFr·sin κ + dFa·cos κ)·sin φ,
//     dFy = +dFt·sin φ − (dFr·sin κ + dFa·cos κ)·cos φ,
//     dFz = dFa·sin κ − dFr·cos κ,
// which for κ = 90° are LUO's eq. 1 and 2: x is the direction of feed, y normal to it in the plane, and z is
// positive where the helix pulls the cutter down (and lifts the wood). Lengths mm, forces N, angles rad.
//
// The teeth are equal, so one pitch (2π/N of a turn) tells all. It is cut at every angle at which some tooth
// begins or ceases to enter or to leave; between two such angles the same teeth are engaged and the forces
// are smooth, so samples are taken there, both ends included. No sample ever has to guess on which side of an
// engagement limit it lies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "kernels/geometry/cutter_shape.h"
#include "kernels/parallel/context.h"

namespace slabwright {

/// What a material gives in orthogonal cutting: c, per area of chip, N/mm²; e, per length of edge, N/mm.
struct OrthogonalForces {
    double ktc = 0, kte = 0, kfc = 0, kfe = 0;
};

/// The same on a helical tooth: tangential, radial, axial.
struct ForceCoefficients {
    double ktc = 0, krc = 0, kac = 0;  ///< N/mm²
    double kte = 0, kre = 0, kae = 0;  ///< N/mm
};

/// How orthogonal data become those of an inclined edge.
enum class CoefficientTransform : std::uint8_t {
    printed,  ///< LUO's matrix, whose first two rows are one: Kt = Kr = Kf + Kt·cos β, Ka = Kt·sin β
    oblique,  ///< the orthogonal force resolved on the edge: Kt·cos β, Kr = Kf, Ka = Kt·sin β
};

[[nodiscard]] ForceCoefficients resolve_coefficients(const OrthogonalForces& orthogonal, double helix_rad,
                                                     CoefficientTransform transform);

/// The teeth that are in the wood: from `entry` to `exit`, 0 … π.
struct EngagementArc {
    double entry_rad = 0, exit_rad = 0;
};

enum class MillingSense : std::uint8_t { up, down };

/// The arc of a cut `radial_width` wide by a cutter of `radius`; 2·radius or more is a slot, 0 … π.
/// @throws Error(usage, "forces.segment") unless radius > 0 and radial_width ≥ 0
[[nodiscard]] EngagementArc engagement_arc(double radius_mm, double radial_width_mm, MillingSense sense);

/// A piece of a path with one engagement.
struct CutSegment {
    int flutes = 2;        ///< 1 … 32
    double radius_mm = 0;  ///< of the cutter
    double corner_mm = 0;  ///< between its floor and its side: 0 of a flat, of a ball its radius; of a
                           ///< tapered ball, that of its tip
    double taper_rad = 0;  ///< between the axis and the flank, up to the radius; 0: upright
    double helix_rad = 0;  ///< 0 … 60°
    double low_mm = 0,
           high_mm =
               0;  ///< the engaged heights above the tip; high − low is the axial depth, at most 64 radii
    EngagementArc arc;
    double chip_load_mm = 0;  ///< feed per tooth
    double spindle_rpm = 0;   ///< for power; 0: power is 0
    ForceCoefficients coefficients;

    [[nodiscard]] bool tapers() const { return taper_rad > 0; }
    [[nodiscard]] bool flat() const { return corner_mm <= 0 && !tapers(); }
    [[nodiscard]] bool ball() const { return corner_mm > 0 && corner_mm >= radius_mm && !tapers(); }
};

/// What a cutter takes before anything is asked of it: its measures alone.
[[nodiscard]] CutSegment segment_of(const CutterShape& cutter);

/// The cutter's radius at a height above its tip, mm: what it cuts across there.
[[nodiscard]] double radius_at(const CutSegment& segment, double height_mm);

/// Over one turn. Peaks are of the magnitude, means are signed and exact; the resultant's mean is of its
/// magnitude, by the samples that the peaks are taken from.
struct SegmentForces {
    double peak_x_n = 0, peak_y_n = 0, peak_z_n = 0;
    double peak_in_plane_n = 0;   ///< √(Fx² + Fy²): bends the tool
    double peak_resultant_n = 0;  ///< √(Fx² + Fy² + Fz²)
    double peak_torque_nmm = 0;
    double mean_x_n = 0, mean_y_n = 0, mean_z_n = 0, mean_in_plane_n = 0, mean_torque_nmm = 0;
    double peak_power_w = 0, mean_power_w = 0;  ///< torque times speed
};

/// Peaks are found to about this share of themselves: the tooth turns by at most √(2·accuracy) between
/// samples, which a harmonic of twice the turn (the fastest in the model) cannot use to rise more than that
/// above them.
inline constexpr double kForceAccuracy = 1e-3;

/// One cut in double precision, by Gauss's rule along the engaged edge: any profile. The measure for
/// everything else.
/// @throws Error(usage, "forces.segment") for a segment outside the ranges above
[[nodiscard]] SegmentForces reference_forces(const CutSegment& segment, double accuracy = kForceAccuracy);

/// The same for a flat end mill, whose integral over z is elementary.
/// @throws Error(usage, "forces.segment") also for any other form
[[nodiscard]] SegmentForces closed_form_forces(const CutSegment& segment, double accuracy = kForceAccuracy);

/// What a plan states about a cut.
struct CutForce {
    double peak_resultant_n = 0;
    double peak_axial_n = 0;
    double torque_nmm = 0;  ///< peak
    double power_w = 0;     ///< mean
    double peak_in_plane_n = 0;
};

/// From the closed form (flat) or the reference (others): the same digits on every device.
/// @param accuracy share of themselves to which peaks are found; time grows as one over its root
[[nodiscard]] CutForce peak_force(const CutSegment& segment, double accuracy = 1e-5);

/// Forces of many cuts, on an OpenCL device where there is one that passes a self-test and the cutter is a
/// flat or a ball, else by reference and closed form on the context's threads. The device's single precision
/// differs from the reference by less than 1e-4 of a segment's peak resultant; what must not depend on the
/// machine is decided by peak_force.
class ForceSolver {
public:
    /// @param device "" or "auto": the fastest device that passes the self-test; "reference": none; else the
    /// first
    ///               device whose name holds this text
    /// @throws Error(usage, "forces.device") when a device is asked for by name and none fits or it fails the
    /// self-test
    explicit ForceSolver(Context& context, const std::string& device = {});
    ~ForceSolver();
    ForceSolver(const ForceSolver&) = delete;
    ForceSolver& operator=(const ForceSolver&) = delete;

    /// False: the double reference runs instead, and `note` says why.
    [[nodiscard]] bool on_device() const noexcept;
    [[nodiscard]] const std::string& device() const noexcept;  ///< its name, "reference" without one
    [[nodiscard]] const std::string& note() const noexcept;  ///< one line; "" when a device runs as it should

    /// forces[i] is what segments[i] does. Streams: memory does not grow with their number.
    /// @throws Error(usage, "forces.segment") naming the first bad segment; Error(usage, "forces.device") if
    /// the device
    ///         fails; Error(cancelled)
    void solve(Context& context, std::span<const CutSegment> segments, std::span<SegmentForces> forces,
               double accuracy = kForceAccuracy);

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace slabwright
