// The words that a job file has for enumerators.
#pragma once

#include "engine/job.h"

namespace slabwright {

/// A word of a job file that stands for an enumerator.
template <class Enum>
struct Word {
    const char* text;
    Enum value;
};

inline constexpr Word<LengthUnit> kUnitWords[] = {{"mm", LengthUnit::mm}, {"in", LengthUnit::inch}};
inline constexpr Word<Repair> kRepairWords[] = {
    {"none", Repair::none}, {"mend", Repair::mend}, {"rebuild", Repair::rebuild}};
inline constexpr Word<LayerStrategy> kStrategyWords[] = {{"printed", LayerStrategy::printed},
                                                         {"optimal", LayerStrategy::optimal},
                                                         {"combined", LayerStrategy::combined},
                                                         {"uniform", LayerStrategy::uniform}};
inline constexpr Word<SupportRule> kSupportWords[] = {{"none", SupportRule::none},
                                                      {"auto", SupportRule::automatic}};
inline constexpr Word<SlabSides> kSidesWords[] = {
    {"one", SlabSides::one}, {"two", SlabSides::two}, {"auto", SlabSides::automatic}};
inline constexpr Word<Finder> kFinderWords[] = {
    {"halving", Finder::halving}, {"exact", Finder::exact}, {"both", Finder::both}};
inline constexpr Word<FinishStrategy> kFinishWords[] = {{"split", FinishStrategy::split},
                                                        {"levels", FinishStrategy::levels},
                                                        {"projection", FinishStrategy::projection},
                                                        {"both", FinishStrategy::both}};
inline constexpr Word<Projection> kProjectionWords[] = {{"raster", Projection::raster},
                                                        {"offset", Projection::offset}};
inline constexpr Word<CoefficientTransform> kTransformWords[] = {{"printed", CoefficientTransform::printed},
                                                                 {"oblique", CoefficientTransform::oblique}};
inline constexpr Word<RoughPattern> kRoughWords[] = {{"contour", RoughPattern::contour},
                                                     {"zigzag", RoughPattern::zigzag}};
inline constexpr Word<RestPattern> kRestWords[] = {{"by_library", RestPattern::by_library},
                                                   {"raster", RestPattern::raster},
                                                   {"contour", RestPattern::contour}};
inline constexpr Word<Frame> kFrameWords[] = {{"pattern-base", Frame::pattern_base},
                                              {"layer-top", Frame::layer_top},
                                              {"table-top", Frame::table_top},
                                              {"auto", Frame::automatic}};
inline constexpr Word<BuildTable> kTableWords[] = {{"moving", BuildTable::moving},
                                                   {"fixed", BuildTable::fixed}};
inline constexpr Word<GlueHead> kGlueHeadWords[] = {{"auto", GlueHead::automatic},
                                                    {"none", GlueHead::none},
                                                    {"slab", GlueHead::slab},
                                                    {"stack", GlueHead::stack}};
inline constexpr Word<ProgramSpan> kProgramWords[] = {
    {"operation", ProgramSpan::operation}, {"tool", ProgramSpan::tool}, {"layer", ProgramSpan::layer}};
inline constexpr Word<WorkZero> kZeroWords[] = {{"model", WorkZero::model},
                                                {"corner", WorkZero::corner},
                                                {"centre", WorkZero::centre},
                                                {"pin", WorkZero::pin}};
inline constexpr Word<ProbeMode> kProbeWords[] = {{"none", ProbeMode::none}, {"cycle", ProbeMode::cycle}};

/// Whether a visitor is shown keys that a job does not use: all are but one that says it writes used ones
/// only (kUsedKeysOnly), so that plans without them stay as they are.
template <class Visit>
constexpr bool shows(const Visit&, bool used) {
    if constexpr (requires { Visit::kUsedKeysOnly; }) return used;
    else return true;
}
inline constexpr Word<Blanks> kBlankWords[] = {{"pattern", Blanks::pattern}, {"layer", Blanks::layer}};
inline constexpr Word<BoardLayout> kBoardLayoutWords[] = {{"guillotine", BoardLayout::guillotine},
                                                          {"nested", BoardLayout::nested}};
template <std::size_t... i>
consteval auto words_of_controls(std::index_sequence<i...> /*each*/) {
    struct Table {
        Word<Post> all[sizeof...(i)];
    };
    return Table{{{kControls[i].word, kControls[i].post}...}};
}
inline constexpr auto kControlWords = words_of_controls(std::make_index_sequence<std::size(kControls)>());
inline constexpr const Word<Post> (&kPostWords)[std::size(kControls)] = kControlWords.all;
inline constexpr Word<Engagement> kEngagementWords[] = {{"simulated", Engagement::simulated},
                                                        {"nominal", Engagement::nominal}};
inline constexpr Word<SelectionMode> kSelectionWords[] = {{"select", SelectionMode::select},
                                                          {"fixed", SelectionMode::fixed}};
inline constexpr Word<AccessRule> kAccessWords[] = {
    {"sections", AccessRule::sections}, {"exact", AccessRule::exact}, {"printed", AccessRule::printed}};
inline constexpr Word<RoughLimit> kRoughLimitWords[] = {{"smaller", RoughLimit::smaller},
                                                        {"finish_radius", RoughLimit::finish_radius},
                                                        {"cusp", RoughLimit::cusp}};

inline constexpr Word<CuttingChart> kChartWords[] = {{"none", CuttingChart::none},
                                                     {"mdf", CuttingChart::mdf},
                                                     {"pine", CuttingChart::pine},
                                                     {"plywood", CuttingChart::plywood},
                                                     {"foam", CuttingChart::foam}};

inline constexpr Word<KeepOutBase> kKeepOutWords[] = {{"board", KeepOutBase::board},
                                                      {"slab", KeepOutBase::slab}};
inline constexpr Word<MirrorAxis> kMirrorWords[] = {
    {"none", MirrorAxis::none}, {"x", MirrorAxis::x}, {"y", MirrorAxis::y}, {"z", MirrorAxis::z}};

}  // namespace slabwright
