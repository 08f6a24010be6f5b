#include "tools/bond_command.h"

#include <algorithm>
#include <string_view>

#include "io/read/bond_csv.h"
#include "io/write/bond_plots.h"
#include "io/write/bond_report.h"
#include "io/write/output_file.h"
#include "kernels/errors.h"

namespace slabwright {

namespace {

/// "A,B,AB" as terms.
std::vector<BondTerm> terms_of(std::string_view text) {
    const auto refuse = [&](const std::string& message) {
        throw Error(ErrorKind::usage, "bond.terms", message, "--terms",
                    "write letters of factors, such as A,B,C,AB: A is the first column");
    };
    std::vector<BondTerm> terms;
    BondTerm term = 0;
    for (std::size_t i = 0; i <= text.size(); ++i) {
        const char c = i < text.size() ? text[i] : ',';
        if (c == ' ' || c == '*') continue;
        if (c == ',') {
            if (term == 0) refuse("a term without a factor");
            if (std::find(terms.begin(), terms.end(), term) != terms.end())
                refuse(term_name(term) + " stands there twice");
            terms.push_back(term);
            term = 0;
        } else if (c >= 'A' && c < static_cast<char>('A' + kMostBondFactors)) {
            const BondTerm factor = 1u << (c - 'A');
            if (term & factor) refuse("a factor stands twice in one term");
            term |= factor;
        } else {
            refuse(std::string("no factor is called ") + c);
        }
    }
    return terms;
}

}  // namespace

CLI::App* add_bond_command(CLI::App& app, BondOptions& options) {
    CLI::App* command = app.add_subcommand(
        "bond", "study tests of joints: analysis of variance, regression, the strongest joint");
    command->add_option("CSV", options.csv, "a line for each test: its factors, then its strength")
        ->required();
    command->add_option("--response", options.response,
                        "the column that was measured; the last if not given");
    command->add_option("--ignore", options.ignored, "a column that is no factor; may be given again")
        ->expected(1)
        ->take_all();
    command->add_option("--terms", options.terms,
                        "of the regression, such as A,B,AB (A is the first factor); all if not given");
    command->add_option("--order", options.order, "most factors in an interaction; all together if not given")
        ->check(CLI::Range(1, 6));
    command->add_option("--confidence", options.confidence, "of the intervals; 0.95 if not given")
        ->check(CLI::Range(0.5, 0.9999));
    command->add_option("--runs", options.future_runs, "joints whose mean is foretold; 3 if not given")
        ->check(CLI::Range(1, 1000));
    command->add_option("--plots", options.plots,
                        "an SVG file: main effects, interactions, what the regression leaves");
    command->add_flag("--json", options.json, "the result as JSON, errors as JSON on stderr");
    return command;
}

std::string run_bond(const BondOptions& options) {
    BondStudyOptions asked;
    if (!options.terms.empty()) asked.terms = terms_of(options.terms);
    asked.order = options.order;
    asked.confidence = options.confidence;
    asked.future_runs = options.future_runs;
    const BondTests tests = read_bond_csv(options.csv, {options.response, options.ignored});
    try {
        const BondStudy study = study_bonds(tests, asked);
        if (!options.plots.empty()) write_file_whole(options.plots, bond_plots_svg(tests, study));
        return options.json ? bond_json(tests, study, asked) : bond_text(tests, study, asked);
    } catch (const Error& error) {
        if (!error.place().empty()) throw;
        throw Error(error.kind(), error.code(), error.message(), options.csv, error.remedy());
    }
}

}  // namespace slabwright
