#include "io/report_template.h"

namespace slabwright {

#ifdef SLABWRIGHT_REPORT
namespace {
// One literal in pieces, written by io/report/build.mjs.
constexpr char kPage[] =
#include "report_page.inc"
    ;
constexpr char kAssembly[] =
#include "assembly_page.inc"
    ;
}  // namespace
std::string_view report_template() { return {kPage, sizeof kPage - 1}; }
std::string_view assembly_template() { return {kAssembly, sizeof kAssembly - 1}; }
#else
std::string_view report_template() { return {}; }
std::string_view assembly_template() { return {}; }
#endif

}  // namespace slabwright
