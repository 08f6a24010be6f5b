#include "io/write/bond_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "io/text/json_text.h"

namespace slabwright {

namespace {

/// As many decimals as leave about six digits, 0 to 6.
int decimals_for(double size) {
    if (!(size > 0)) return 0;
    return std::clamp(5 - static_cast<int>(std::floor(std::log10(size))), 0, 6);
}

std::string shown(double value, int decimals) {
    std::string text;
    append_rounded(text, value, decimals);
    return text;
}

/// Right-aligned columns, two spaces apart.
std::string aligned(const std::vector<std::vector<std::string>>& rows) {
    std::vector<std::size_t> widths;
    for (const auto& row : rows)
        for (std::size_t c = 0; c < row.size(); ++c) {
            if (c == widths.size()) widths.push_back(0);
            widths[c] = std::max(widths[c], row[c].size());
        }
    std::string text;
    for (const auto& row : rows) {
        std::string line;
        for (std::size_t c = 0; c < row.size(); ++c)
            line += c == 0 ? fmt::format("{:<{}}", row[c], widths[c])
                           : fmt::format("  {:>{}}", row[c], widths[c]);
        line.erase(line.find_last_not_of(' ') + 1);
        text += line + '\n';
    }
    return text;
}

std::string levels_text(const BondTests& tests, const std::vector<int>& levels) {
    std::string text;
    for (std::size_t f = 0; f < tests.factors.size(); ++f)
        text += fmt::format("{}{} {}", f == 0 ? "" : ", ", tests.factors[f].name,
                            tests.factors[f].levels[static_cast<std::size_t>(levels[f])]);
    return text;
}

std::string factors_text(const BondTests& tests) {
    std::string text;
    for (std::size_t f = 0; f < tests.factors.size(); ++f) {
        const BondFactor& factor = tests.factors[f];
        text += fmt::format("{}  {}:", static_cast<char>('A' + f), factor.name);
        for (std::size_t l = 0; l < factor.levels.size(); ++l) {
            text += (l == 0 ? " " : ", ") + factor.levels[l];
            if (!factor.coded.empty()) text += fmt::format(" ({})", shown(factor.coded[l], 3));
        }
        text += '\n';
    }
    return text;
}

std::string anova_text(const Anova& anova) {
    std::vector<std::vector<std::string>> rows{{"source", "df", "seq SS", "adj SS", "adj MS", "F", "p"}};
    const int d = decimals_for(anova.total_ss);
    for (const AnovaRow& row : anova.rows) {
        rows.push_back({term_name(row.term), std::to_string(row.df), shown(row.sequential_ss, d),
                        shown(row.adjusted_ss, d), shown(row.mean_square, d)});
        if (anova.s > 0) {
            rows.back().push_back(fmt::format("{:.2f}", row.f));
            rows.back().push_back(fmt::format("{:.3f}", row.p));
        }
    }
    const std::string error = shown(anova.error_ss, d);
    rows.push_back({"error", std::to_string(anova.error_df), error, error});
    if (anova.error_df > 0) rows.back().push_back(shown(anova.error_ss / anova.error_df, d));
    rows.push_back({"total", std::to_string(anova.total_df), shown(anova.total_ss, d)});
    std::string text = "\nanalysis of variance\n" + aligned(rows);
    if (anova.s > 0)
        return text + fmt::format("S {}  R2 {:.2f} %  adjusted {:.2f} %\n", shown(anova.s, 3), 100 * anova.r2,
                                  100 * anova.r2_adjusted);
    return text + "nothing is left to test against: no test was repeated\n";
}

std::string regression_text(const BondTests& tests, const BondRegression& regression,
                            const BondStudyOptions& options) {
    if (!regression.made) return fmt::format("\nno regression: {}\n", regression.why_not);
    double size = 0;
    for (const BondCoefficient& c : regression.coefficients) size = std::max(size, std::abs(c.value));
    const int d = std::max(1, decimals_for(size));
    std::vector<std::vector<std::string>> rows{
        {"term", "coef", "SE", "t", "p", fmt::format("from ({:g} %)", 100 * options.confidence), "to"}};
    for (const BondCoefficient& c : regression.coefficients)
        rows.push_back({term_name(c.term), shown(c.value, d), shown(c.standard_error, d),
                        fmt::format("{:.2f}", c.t), fmt::format("{:.3f}", c.p), shown(c.low, d),
                        shown(c.high, d)});
    std::string text =
        fmt::format("\nregression of {} on coded levels\n", tests.strength_name) + aligned(rows) +
        fmt::format("S {}  R2 {:.1f} %  adjusted {:.1f} %  predicted {:.1f} %\n", shown(regression.s, 2),
                    100 * regression.r2, 100 * regression.r2_adjusted, 100 * regression.r2_predicted);
    if (regression.residual_df > 0)
        text += fmt::format("regression F({},{}) = {:.2f}, p = {:.3g}\n", regression.df,
                            regression.residual_df, regression.f, regression.p);
    if (regression.lack_tested)
        text += fmt::format("lack of fit F({},{}) = {:.1f}, p = {:.1g}\n", regression.lack_df,
                            regression.pure_df, regression.lack_f, regression.lack_p);
    return text;
}

}  // namespace

std::string bond_text(const BondTests& tests, const BondStudy& study, const BondStudyOptions& options) {
    std::string text = fmt::format("{}: {} tests of {} combinations\n", tests.strength_name,
                                   tests.strength.size(), study.cells.size()) +
                       factors_text(tests) + anova_text(study.anova) +
                       regression_text(tests, study.regression, options);
    double size = 0;
    for (const BondCell& cell : study.cells) size = std::max(size, std::abs(cell.mean));
    const int d = decimals_for(size) > 1 ? decimals_for(size) - 1 : decimals_for(size);
    std::vector<std::vector<std::string>> rows{
        {"combination", "tests", "mean", fmt::format("from ({:g} %)", 100 * options.confidence), "to"}};
    for (const BondCell& cell : study.cells) {
        rows.push_back({levels_text(tests, cell.levels), std::to_string(cell.runs), shown(cell.mean, d)});
        if (study.within_df == 0) continue;
        rows.back().push_back(shown(cell.interval.low, d));
        rows.back().push_back(shown(cell.interval.high, d));
    }
    text += "\ntested combinations\n" + aligned(rows);
    if (study.within_df > 0)
        text +=
            fmt::format("variance of joints made alike {} ({} degrees of freedom)\n",
                        shown(study.within_variance, decimals_for(study.within_variance)), study.within_df);
    text += '\n';
    const BondCell& best = study.cells[study.best_cell];
    text += fmt::format("strongest tested: {}: {}\n", levels_text(tests, best.levels), shown(best.mean, d));
    if (!study.regression.made) return text;
    if (!study.regression_fits())
        return text + "the regression does not fit: use the means of the tested combinations\n";
    const BondOptimum& o = study.regression.optimum;
    return text + fmt::format(
                      "strongest by the regression: {}: {}, mean within {} to {}, "
                      "{} joints together within {} to {}\n",
                      levels_text(tests, o.levels), shown(o.predicted, d), shown(o.mean.low, d),
                      shown(o.mean.high, d), options.future_runs, shown(o.future.low, d),
                      shown(o.future.high, d));
}

namespace {

void put_interval(JsonText& json, const char* name, const Interval& interval) {
    json.key(name).begin_array(JsonText::Shape::line).rounded(interval.low, 9).rounded(interval.high, 9);
    json.end();
}

void put_levels(JsonText& json, const BondTests& tests, const std::vector<int>& levels) {
    json.key("levels").begin_array(JsonText::Shape::line);
    for (std::size_t f = 0; f < levels.size(); ++f)
        json.string(tests.factors[f].levels[static_cast<std::size_t>(levels[f])]);
    json.end();
}

void put_regression(JsonText& json, const BondTests& tests, const BondStudy& study) {
    const BondRegression& r = study.regression;
    json.key("regression").begin_object();
    json.key("made").boolean(r.made);
    if (!r.made) {
        json.key("why_not").string(r.why_not).end();
        return;
    }
    json.key("fits").boolean(study.regression_fits());
    json.key("coefficients").begin_array();
    for (const BondCoefficient& c : r.coefficients) {
        json.begin_object(JsonText::Shape::line);
        json.key("term").string(term_name(c.term)).key("value").rounded(c.value, 9);
        json.key("standard_error").rounded(c.standard_error, 9).key("t").rounded(c.t, 9);
        json.key("p").rounded(c.p, 9);
        put_interval(json, "interval", {c.low, c.high});
        json.key("sequential_ss").rounded(c.sequential_ss, 6).end();
    }
    json.end();
    json.key("df").integer(r.df).key("residual_df").integer(r.residual_df);
    json.key("ss").rounded(r.ss, 6).key("residual_ss").rounded(r.residual_ss, 6);
    json.key("s").rounded(r.s, 9).key("r2").rounded(r.r2, 9).key("r2_adjusted").rounded(r.r2_adjusted, 9);
    json.key("r2_predicted").rounded(r.r2_predicted, 9).key("f").rounded(r.f, 9).key("p").rounded(r.p, 9);
    json.key("lack_of_fit");
    if (r.lack_tested) {
        json.begin_object(JsonText::Shape::line).key("df").integer(r.lack_df);
        json.key("pure_df").integer(r.pure_df).key("ss").rounded(r.lack_ss, 6);
        json.key("pure_ss").rounded(r.pure_ss, 6).key("f").rounded(r.lack_f, 9);
        json.key("p").rounded(r.lack_p, 9).end();
    } else {
        json.null();
    }
    json.key("optimum").begin_object();
    put_levels(json, tests, r.optimum.levels);
    json.key("predicted").rounded(r.optimum.predicted, 9);
    put_interval(json, "mean", r.optimum.mean);
    put_interval(json, "future", r.optimum.future);
    json.end().end();
}

}  // namespace

std::string bond_json(const BondTests& tests, const BondStudy& study, const BondStudyOptions& options) {
    JsonText out;
    out.begin_object().key("schema").string("slabwright.bond/1");
    out.key("response").string(tests.strength_name);
    out.key("tests").count(tests.strength.size()).key("confidence").exact(options.confidence);
    out.key("future_runs").integer(options.future_runs);
    out.key("factors").begin_array();
    for (std::size_t f = 0; f < tests.factors.size(); ++f) {
        const BondFactor& factor = tests.factors[f];
        out.begin_object(JsonText::Shape::line).key("letter").string(term_name(1u << f));
        out.key("name").string(factor.name).key("levels").begin_array(JsonText::Shape::line);
        for (const std::string& level : factor.levels) out.string(level);
        out.end().key("coded").begin_array(JsonText::Shape::line);
        for (const double coded : factor.coded) out.rounded(coded, 9);
        out.end().end();
    }
    out.end();
    const Anova& a = study.anova;
    out.key("anova").begin_object().key("rows").begin_array();
    for (const AnovaRow& row : a.rows) {
        out.begin_object(JsonText::Shape::line).key("term").string(term_name(row.term));
        out.key("df").integer(row.df).key("sequential_ss").rounded(row.sequential_ss, 6);
        out.key("adjusted_ss").rounded(row.adjusted_ss, 6).key("mean_square").rounded(row.mean_square, 6);
        if (a.s > 0) out.key("f").rounded(row.f, 9).key("p").rounded(row.p, 9);
        out.end();
    }
    out.end().key("error_df").integer(a.error_df).key("error_ss").rounded(a.error_ss, 6);
    out.key("total_df").integer(a.total_df).key("total_ss").rounded(a.total_ss, 6);
    out.key("s").rounded(a.s, 9).key("r2").rounded(a.r2, 9).key("r2_adjusted").rounded(a.r2_adjusted, 9);
    out.end();
    put_regression(out, tests, study);
    out.key("cells").begin_array();
    for (const BondCell& cell : study.cells) {
        out.begin_object(JsonText::Shape::line);
        put_levels(out, tests, cell.levels);
        out.key("tests").integer(cell.runs).key("mean").rounded(cell.mean, 9);
        if (study.within_df > 0) put_interval(out, "interval", cell.interval);
        out.end();
    }
    out.end().key("best_cell").count(study.best_cell);
    out.key("within_variance").rounded(study.within_variance, 9);
    out.key("within_df").integer(study.within_df).end();
    return out.take();
}

}  // namespace slabwright
