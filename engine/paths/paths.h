// The tool paths of one layer (SHAPING, FINISH; METHOD.md sections 5 and 11), with the tools that were chosen
// for it.
#pragma once

#include <memory>
#include <vector>

#include "engine/layer_job.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct LayerResult {
    std::vector<Operation> operations;  ///< in the order of execution
    std::vector<Diagnostic> diagnostics;
    double left_mm2 = 0;  ///< plan view of what is left over the cusp's limit; 0 where it is not followed
                          ///< (Cutting::uniform_steps)
    LayerPace pace{};     ///< where it is asked for; as far as its stages were planned
    bool given_up =
        false;  ///< the operations are the first ones only (LayerJob::ahead); left_mm2 is not known
};

/// Face, rough, floors, walls, levels and raster of one layer, and what these leave. Operations that would
/// remove nothing are left out.
[[nodiscard]] LayerResult plan_layer_paths(Context& context, const LayerJob& layer);

/// Minutes per mm³ of waste over a millimetre thick, to whatever clears it or meets it later: fitted to 102
/// layers of castings, each with one ball and several roughing cutters, so that what these took to clear and
/// what they left tells which of them is done first.
inline constexpr double kWasteMinutes = 1.2e-4;

/// The same in two parts: sets of tools that only differ in what clears the waste are compared after the
/// first, and one of them goes on.
class LayerPaths {
public:
    /// @param layer what it points to outlives this
    LayerPaths(Context& context, LayerJob layer);
    LayerPaths(LayerPaths&&) noexcept;
    LayerPaths& operator=(LayerPaths&&) noexcept;
    ~LayerPaths();

    /// Up to where the waste is cleared.
    /// @param ahead as LayerJob::ahead, looked at after each cutter. @returns false where it was given up
    bool clear(ProgressPart* progress, const std::optional<PaceAhead>& ahead);
    /// What is planned so far, its pace where that is asked for.
    [[nodiscard]] const LayerResult& so_far() const;
    /// mm³ of what still stands more than a millimetre thick; 0 where it is not followed
    /// (Cutting::uniform_steps).
    [[nodiscard]] double waste_mm3() const;
    /// The rest, to be called once, after clear() returned true.
    [[nodiscard]] LayerResult finish(ProgressPart* progress, const std::optional<PaceAhead>& ahead);

private:
    class Steps;
    std::unique_ptr<Steps> steps_;
};

}  // namespace slabwright
