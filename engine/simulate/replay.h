// The programs run once more over a coarse stock, for a picture of the build: what each cuts as it goes, and
// what is left.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "engine/simulate/simulate.h"

namespace slabwright {

struct ReplayOptions {
    double cell = 1;           ///< mm between the points of the stock
    double cusp = 0.04;        ///< mm that may be left without asking how far along the normal
    std::size_t pieces = 160;  ///< of equal time that a program is cut into, at most
    Material material;         ///< whose force coefficients are used
};

/// One piece of a program. Depth is the most that any point of the stock lost in one motion, width the volume
/// taken over the way cut times that depth, both as the points of the stock show them; forces are the model's
/// for that cut at the piece's fastest feed in the plane (METHOD.md sections 8 and 9). All 0 where the piece
/// cuts nothing.
struct ReplayPiece {
    double depth_mm = 0, width_mm = 0;
    double force_n = 0;        ///< peak resultant
    double deflection_mm = 0;  ///< of the tip
};

struct ReplayedProgram {
    double seconds = 0;  ///< way over feed; what the machine's acceleration adds is not in it
    double removed_mm3 = 0;
    std::vector<ReplayPiece> pieces;
};

/// One layer when everything has been cut, row after row from the least y, mm.
struct ReplayedLayer {
    /// What stands over the finished surface, along the normal (negative: cut into the part); NaN where the
    /// flask stays.
    std::vector<float> left;
    std::vector<float> surface;  ///< z of the wood's upper end; the layer's bottom where none is left
};

/// Programs are given in the order of execution, layers ascending; memory grows with the stock, not with the
/// programs.
class Replay {
public:
    /// @param input its programs are not used; the mesh must outlive this. @throws Error(usage) on options
    /// out of range
    Replay(Context& context, const SimulationInput& input, const ReplayOptions& options);
    ~Replay();
    Replay(const Replay&) = delete;
    Replay& operator=(const Replay&) = delete;

    /// Cuts. A program whose tool the input does not hold cuts nothing.
    ReplayedProgram run(const Program& program);

    /// Calls fn(layer, what is there) for every layer, from the lowest. @param part of the input's mesh
    void finished(const StandingPart& part,
                  const std::function<void(std::size_t, const ReplayedLayer&)>& fn) const;

    [[nodiscard]] int nx() const;
    [[nodiscard]] int ny() const;
    /// The stock's first point, mm.
    [[nodiscard]] std::array<double, 2> first() const;

private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace slabwright
