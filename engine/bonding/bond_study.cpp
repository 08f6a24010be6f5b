#include "engine/bonding/bond_study.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "kernels/errors.h"
#include "kernels/statistics/distributions.h"
#include "kernels/statistics/least_squares.h"

namespace slabwright {

namespace {

/// All sets of up to `order` of n factors: those of one first, each size in alphabetical order.
std::vector<BondTerm> all_terms(std::size_t n, int order) {
    std::vector<BondTerm> terms;
    for (BondTerm term = 1; term < (1u << n); ++term)
        if (order <= 0 || std::popcount(term) <= order) terms.push_back(term);
    std::stable_sort(terms.begin(), terms.end(), [](BondTerm a, BondTerm b) {
        if (std::popcount(a) != std::popcount(b)) return std::popcount(a) < std::popcount(b);
        return term_name(a) < term_name(b);
    });
    return terms;
}

/// Appends the columns of one term: the products of the columns of its factors.
/// @param columns of factor f in row r: columns(f, r)
template <class Columns>
void append_term(Eigen::MatrixXd& x, BondTerm term, const Columns& columns) {
    const Eigen::Index rows = x.rows();
    std::vector<Eigen::VectorXd> products{Eigen::VectorXd::Ones(rows)};
    for (std::size_t f = 0; f < kMostBondFactors; ++f) {
        if (!(term >> f & 1)) continue;
        std::vector<Eigen::VectorXd> longer;
        for (const Eigen::VectorXd& product : products)
            for (const Eigen::VectorXd& column : columns[f]) longer.push_back(product.cwiseProduct(column));
        products = std::move(longer);
    }
    const Eigen::Index first = x.cols();
    x.conservativeResize(Eigen::NoChange, first + static_cast<Eigen::Index>(products.size()));
    for (std::size_t i = 0; i < products.size(); ++i)
        x.col(first + static_cast<Eigen::Index>(i)) = products[i];
}

using Columns = std::vector<std::vector<Eigen::VectorXd>>;

/// Of every factor, its levels as columns that add up to 0 over the levels, so that adjusted sums of squares
/// are those of the factor's own effect.
Columns effect_columns(const BondTests& tests) {
    const Eigen::Index rows = static_cast<Eigen::Index>(tests.strength.size());
    Columns columns(tests.factors.size());
    for (std::size_t f = 0; f < tests.factors.size(); ++f) {
        const int last = static_cast<int>(tests.factors[f].levels.size()) - 1;
        for (int level = 0; level < last; ++level) {
            Eigen::VectorXd column(rows);
            for (Eigen::Index r = 0; r < rows; ++r) {
                const int is = tests.levels[static_cast<std::size_t>(r)][f];
                column[r] = is == level ? 1 : is == last ? -1 : 0;
            }
            columns[f].push_back(std::move(column));
        }
    }
    return columns;
}

/// Of every factor one column, its coded levels.
Columns coded_columns(const BondTests& tests) {
    const Eigen::Index rows = static_cast<Eigen::Index>(tests.strength.size());
    Columns columns(tests.factors.size());
    for (std::size_t f = 0; f < tests.factors.size(); ++f) {
        Eigen::VectorXd column(rows);
        for (Eigen::Index r = 0; r < rows; ++r)
            column[r] = tests.factors[f]
                            .coded[static_cast<std::size_t>(tests.levels[static_cast<std::size_t>(r)][f])];
        columns[f].push_back(std::move(column));
    }
    return columns;
}

Eigen::MatrixXd matrix_of(Eigen::Index rows, const std::vector<BondTerm>& terms, const Columns& columns) {
    Eigen::MatrixXd x = Eigen::MatrixXd::Ones(rows, 1);
    for (const BondTerm term : terms) append_term(x, term, columns);
    return x;
}

Eigen::VectorXd strengths(const BondTests& tests) {
    return Eigen::Map<const Eigen::VectorXd>(tests.strength.data(),
                                             static_cast<Eigen::Index>(tests.strength.size()));
}

/// 0 instead of what is left of it by rounding.
double at_least_0(double ss, double total) { return ss < 1e-12 * total ? 0 : ss; }

Anova analyse(const BondTests& tests, const BondStudyOptions& options) {
    const Eigen::VectorXd y = strengths(tests);
    const std::vector<BondTerm> terms = all_terms(tests.factors.size(), options.order);
    const Columns columns = effect_columns(tests);
    std::size_t width = 1;
    for (const BondTerm term : terms) {
        std::size_t product = 1;
        for (std::size_t f = 0; f < columns.size(); ++f)
            if (term >> f & 1) product *= columns[f].size();
        width += product;
    }
    if (width > kMostBondColumns)
        throw Error(ErrorKind::input, "bond.columns", "the factors have too many levels", "",
                    "group levels, or leave interactions out with --order 2");
    Anova anova;
    anova.total_df = static_cast<int>(y.size()) - 1;
    anova.total_ss = (y.array() - y.mean()).square().sum();
    try {
        const LeastSquares all = least_squares(matrix_of(y.size(), terms, columns), y);
        anova.error_ss = at_least_0(all.residual_ss, anova.total_ss);
        anova.error_df = static_cast<int>(y.size() - all.coefficients.size());
        std::vector<BondTerm> before;
        double left = anova.total_ss;
        Eigen::Index known = 1;
        for (const BondTerm term : terms) {
            AnovaRow row;
            row.term = term;
            before.push_back(term);
            const LeastSquares with = least_squares(matrix_of(y.size(), before, columns), y);
            row.df = static_cast<int>(with.coefficients.size() - known);
            known = with.coefficients.size();
            row.sequential_ss = at_least_0(left - with.residual_ss, anova.total_ss);
            left = with.residual_ss;
            std::vector<BondTerm> others = terms;
            others.erase(std::find(others.begin(), others.end(), term));
            const LeastSquares without = least_squares(matrix_of(y.size(), others, columns), y);
            row.adjusted_ss = at_least_0(without.residual_ss - all.residual_ss, anova.total_ss);
            row.mean_square = row.adjusted_ss / row.df;
            anova.rows.push_back(row);
        }
    } catch (const Error& error) {
        if (error.code() != "statistics.rank") throw;
        throw Error(ErrorKind::input, "bond.cells",
                    "some combinations of levels were not tested, so interactions cannot be told apart", "",
                    "test them, or leave interactions out with --order 1 or 2");
    }
    if (anova.error_df > 0) {
        const double error = anova.error_ss / anova.error_df;
        anova.s = std::sqrt(error);
        for (AnovaRow& row : anova.rows) {
            if (error <= 0) continue;
            row.f = row.mean_square / error;
            row.p = f_upper_tail(row.f, row.df, anova.error_df);
        }
        anova.r2_adjusted = 1 - error / (anova.total_ss / anova.total_df);
    }
    anova.r2 = 1 - anova.error_ss / anova.total_ss;
    return anova;
}

std::vector<BondCell> cells_of(const BondTests& tests, BondStudy& study, double confidence) {
    std::map<std::vector<int>, std::vector<double>> runs;
    for (std::size_t r = 0; r < tests.strength.size(); ++r)
        runs[tests.levels[r]].push_back(tests.strength[r]);
    std::vector<BondCell> cells;
    double ss = 0;
    for (const auto& [levels, values] : runs) {
        BondCell cell;
        cell.levels = levels;
        cell.runs = static_cast<int>(values.size());
        for (const double value : values) cell.mean += value / cell.runs;
        for (const double value : values) ss += (value - cell.mean) * (value - cell.mean);
        cells.push_back(std::move(cell));
    }
    study.within_df = static_cast<int>(tests.strength.size() - cells.size());
    study.within_variance = study.within_df > 0 ? ss / study.within_df : 0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        BondCell& cell = cells[i];
        if (cell.mean > cells[study.best_cell].mean) study.best_cell = i;
        const double half = study.within_df > 0 ? t_half_width(confidence, study.within_df) *
                                                      std::sqrt(study.within_variance / cell.runs)
                                                : 0;
        cell.interval = {cell.mean - half, cell.mean + half};
    }
    return cells;
}

/// The factors' coded levels multiplied along each term, the constant first.
Eigen::VectorXd row_of(const std::vector<BondCoefficient>& coefficients, const std::vector<double>& coded) {
    Eigen::VectorXd row(static_cast<Eigen::Index>(coefficients.size()));
    for (std::size_t i = 0; i < coefficients.size(); ++i) {
        double product = 1;
        for (std::size_t f = 0; f < coded.size(); ++f)
            if (coefficients[i].term >> f & 1) product *= coded[f];
        row[static_cast<Eigen::Index>(i)] = product;
    }
    return row;
}

/// Each factor enters a term once at most, so along any one factor the strength is linear: it is greatest
/// where every factor is at one of its ends.
BondOptimum optimum_of(const BondTests& tests, const BondRegression& regression, const LeastSquares& fit,
                       const BondStudyOptions& options) {
    const std::size_t n = tests.factors.size();
    BondOptimum best;
    bool found = false;
    for (unsigned corner = 0; corner < (1u << n); ++corner) {
        std::vector<double> coded(n);
        std::vector<int> levels(n);
        for (std::size_t f = 0; f < n; ++f) {
            const bool high = corner >> f & 1;
            levels[f] = high ? static_cast<int>(tests.factors[f].levels.size()) - 1 : 0;
            coded[f] = high ? 1 : -1;
        }
        const Eigen::VectorXd row = row_of(regression.coefficients, coded);
        const double value = row.dot(fit.coefficients);
        if (found && value <= best.predicted) continue;
        found = true;
        best.levels = levels;
        best.predicted = value;
        best.mean = best.future = {value, value};
        if (regression.residual_df == 0) continue;
        const double t = t_half_width(options.confidence, regression.residual_df) * regression.s;
        const double of_mean = row.dot(fit.unscaled_covariance * row);
        const double mean = t * std::sqrt(of_mean),
                     future = t * std::sqrt(of_mean + 1.0 / options.future_runs);
        best.mean = {value - mean, value + mean};
        best.future = {value - future, value + future};
    }
    return best;
}

BondRegression regress(const BondTests& tests, const BondStudy& study, const BondStudyOptions& options) {
    BondRegression regression;
    for (const BondFactor& factor : tests.factors)
        if (factor.coded.empty()) {
            regression.why_not = factor.name + " has more than two levels that are no numbers";
            return regression;
        }
    const Eigen::VectorXd y = strengths(tests);
    std::vector<BondTerm> terms = options.terms;
    if (terms.empty()) terms = all_terms(tests.factors.size(), options.order);
    const Columns columns = coded_columns(tests);
    LeastSquares fit;
    std::vector<double> left;  // of the sum of squares, after each term
    try {
        fit = least_squares(matrix_of(y.size(), terms, columns), y);
        for (std::size_t i = 0; i < terms.size(); ++i)
            left.push_back(
                least_squares(
                    matrix_of(y.size(), {terms.begin(), terms.begin() + static_cast<long>(i) + 1}, columns),
                    y)
                    .residual_ss);
    } catch (const Error& error) {
        if (error.code() != "statistics.rank") throw;
        regression.why_not = "the runs do not tell its terms apart";
        return regression;
    }
    regression.made = true;
    regression.df = static_cast<int>(terms.size());
    regression.residual_df = static_cast<int>(y.size()) - 1 - regression.df;
    const double total = study.anova.total_ss;
    regression.residual_ss = at_least_0(fit.residual_ss, total);
    regression.ss = total - regression.residual_ss;
    regression.r2 = regression.ss / total;
    double foretold = 0;
    for (Eigen::Index r = 0; r < y.size(); ++r) {
        const double rest = 1 - fit.leverages[r];
        foretold += rest > 1e-9 ? fit.residuals[r] * fit.residuals[r] / (rest * rest) : total;
    }
    regression.r2_predicted = 1 - foretold / total;
    double variance = 0, half = 0;
    if (regression.residual_df > 0) {
        variance = regression.residual_ss / regression.residual_df;
        regression.s = std::sqrt(variance);
        regression.r2_adjusted = 1 - variance / (total / study.anova.total_df);
        half = t_half_width(options.confidence, regression.residual_df);
        if (variance > 0) {
            regression.f = regression.ss / regression.df / variance;
            regression.p = f_upper_tail(regression.f, regression.df, regression.residual_df);
        }
    }
    for (std::size_t i = 0; i <= terms.size(); ++i) {
        const auto at = static_cast<Eigen::Index>(i);
        BondCoefficient c;
        c.term = i == 0 ? 0 : terms[i - 1];
        c.value = fit.coefficients[at];
        c.standard_error = std::sqrt(variance * fit.unscaled_covariance(at, at));
        if (c.standard_error > 0) {
            c.t = c.value / c.standard_error;
            c.p = t_two_sided(c.t, regression.residual_df);
        }
        c.low = c.value - half * c.standard_error;
        c.high = c.value + half * c.standard_error;
        if (i > 0) c.sequential_ss = at_least_0((i == 1 ? total : left[i - 2]) - left[i - 1], total);
        regression.coefficients.push_back(c);
    }
    regression.pure_df = study.within_df;
    regression.pure_ss = study.within_variance * study.within_df;
    regression.lack_df = regression.residual_df - regression.pure_df;
    regression.lack_ss = at_least_0(regression.residual_ss - regression.pure_ss, total);
    regression.lack_tested = regression.pure_df > 0 && regression.lack_df > 0 && regression.pure_ss > 0;
    if (regression.lack_tested) {
        regression.lack_f =
            regression.lack_ss / regression.lack_df / (regression.pure_ss / regression.pure_df);
        regression.lack_p = f_upper_tail(regression.lack_f, regression.lack_df, regression.pure_df);
    }
    regression.optimum = optimum_of(tests, regression, fit, options);
    return regression;
}

void require_studied(const BondTests& tests, const BondStudyOptions& options) {
    const auto refuse = [](const char* code, const std::string& message, const char* remedy) {
        throw Error(ErrorKind::input, code, message, "", remedy);
    };
    if (tests.factors.empty() || tests.factors.size() > kMostBondFactors)
        refuse("bond.factors", "a study has 1 to 6 factors, this one " + std::to_string(tests.factors.size()),
               "leave columns out with --ignore");
    for (const BondFactor& factor : tests.factors)
        if (factor.levels.size() < 2)
            refuse("bond.levels", factor.name + " has the same level in all rows",
                   "leave it out with --ignore");
    if (tests.strength.size() < 3) refuse("bond.rows", "fewer than three tests", "test more joints");
    const auto [low, high] = std::minmax_element(tests.strength.begin(), tests.strength.end());
    if (*low == *high)
        refuse("bond.constant", "all strengths are equal, so there is nothing to explain",
               "see whether --response names the measured column");
    for (const BondTerm term : options.terms)
        if (term == 0 || term >= (1u << tests.factors.size()))
            throw Error(ErrorKind::usage, "bond.terms", "a term names a factor that is not there", "",
                        "factors are A, B, C … in the order of the columns");
    if (options.confidence <= 0 || options.confidence >= 1 || options.future_runs < 1 || options.order < 0)
        throw Error(ErrorKind::usage, "bond.options",
                    "confidence must lie between 0 and 1, runs be 1 or more");
}

}  // namespace

std::string term_name(BondTerm term) {
    if (term == 0) return "constant";
    std::string name;
    for (std::size_t f = 0; f < kMostBondFactors; ++f)
        if (term >> f & 1) name += static_cast<char>('A' + f);
    return name;
}

double predicted(const BondRegression& regression, const std::vector<double>& coded) {
    const Eigen::VectorXd row = row_of(regression.coefficients, coded);
    double sum = 0;
    for (std::size_t i = 0; i < regression.coefficients.size(); ++i)
        sum += row[static_cast<Eigen::Index>(i)] * regression.coefficients[i].value;
    return sum;
}

BondStudy study_bonds(const BondTests& tests, const BondStudyOptions& options) {
    require_studied(tests, options);
    BondStudy study;
    study.anova = analyse(tests, options);
    study.cells = cells_of(tests, study, options.confidence);
    study.regression = regress(tests, study, options);
    return study;
}

}  // namespace slabwright
