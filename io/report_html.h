// report.html: the build before the wood is cut, as one page without a network. Made from what lies in OUT
// alone (plan.json, the programs, sequence.json, verify.json where there is one) and the STL that plan.json
// names.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "io/verify.h"
#include "kernels/parallel/context.h"

namespace slabwright {

struct ReportOptions {
    PatternSource source;  ///< the pattern; none looks for the file that plan.json names: in OUT, beside OUT,
                           ///< in the working folder
    bool three_d = true;   ///< false: no model, no paths, no stock
    double size_limit_mb = 10;  ///< 1 MB is 10⁶ bytes; the model gets fewer facets and the paths fewer points
                                ///< until the page is no larger
};

/// Microseconds of processor time that a report takes on the machine of bench/RESULTS.md, foretold to divide
/// progress by.
struct ReportWork {
    double replay = 0;  ///< of the programs
    double page = 0;    ///< the model, what tools reach of it, and the paths
};
/// @param steps of all programs. @param facets of the pattern
[[nodiscard]] ReportWork report_work(std::uint64_t steps, std::uint64_t facets);

/// Whether this library can write reports.
[[nodiscard]] bool reports_are_built();

/// The page.
/// @param verified what verify_folder() read of the same OUT and pattern just now: it is not read again, and
/// let go as it has been used The same OUT and options give the same bytes on any number of threads.
/// @throws Error(usage, "report.not_built"), Error(usage, "report.size_limit") when nothing more can be left
/// out,
///         Error(input, "report.plan" | "report.program" | "report.sequence" | "report.verify") when OUT
///         cannot be understood, Error(input) when the STL is missing, unreadable, or not the one that was
///         planned (by its SHA-256)
[[nodiscard]] std::string report_html(Context& context, const std::string& directory,
                                      const ReportOptions& options = {},
                                      std::optional<Verification> verified = {});

/// Writes it to OUT/report.html, whole or not at all. @throws as report_html, and Error(input) when the place
/// cannot be written
void write_report(Context& context, const std::string& directory, const ReportOptions& options = {},
                  std::optional<Verification> verified = {});

}  // namespace slabwright
