// What a factorial test of joints says: analysis of variance, regression, whether it fits, and where in the
// design the joint is strongest (METHOD.md section 13; FDFF chapter VI and appendix A).
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace slabwright {

/// One factor of the test. In terms it is called by a letter: A for the first, B for the second.
struct BondFactor {
    std::string name;
    std::vector<std::string> levels;  ///< in the order of `coded`
    std::vector<double> coded;  ///< −1 for the lowest, 1 for the highest; empty where levels have no order
    bool is_number = false;     ///< whether values between its levels mean anything
};

/// The tests of joints, a row each.
struct BondTests {
    std::vector<BondFactor> factors;       ///< 1 to kMostBondFactors
    std::vector<std::vector<int>> levels;  ///< of every row and factor, an index of BondFactor::levels
    std::vector<double> strength;          ///< of every row, in whatever unit it was measured
    std::string strength_name;
};

inline constexpr std::size_t kMostBondFactors = 6;
inline constexpr std::size_t kMostBondColumns = 200;  ///< of a model's matrix

/// A term is a set of factors: bit 0 for A, bit 1 for B.
using BondTerm = unsigned;

struct BondStudyOptions {
    std::vector<BondTerm> terms;  ///< of the regression, beside the constant; none: every set of factors
    int order = 0;                ///< most factors in a term of the analysis of variance; 0: all
    double confidence = 0.95;
    int future_runs = 3;  ///< the prediction is of the mean of so many
};

/// One line of an analysis of variance.
struct AnovaRow {
    BondTerm term = 0;
    int df = 0;
    double sequential_ss = 0, adjusted_ss = 0, mean_square = 0;
    double f = 0, p = 1;  ///< meaningless where there is no error to test against
};

struct Anova {
    std::vector<AnovaRow> rows;  ///< A, B, C, AB, AC, BC, ABC
    int error_df = 0;
    double error_ss = 0;
    int total_df = 0;
    double total_ss = 0;
    double s = 0, r2 = 0, r2_adjusted = 0;  ///< s is 0 where error_df is
};

struct BondCoefficient {
    BondTerm term = 0;  ///< 0: the constant
    double value = 0, standard_error = 0, t = 0, p = 1, low = 0, high = 0;
    double sequential_ss = 0;  ///< 0 of the constant
};

struct Interval {
    double low = 0, high = 0;
};

/// The strongest joint that the regression names within the tested levels.
struct BondOptimum {
    std::vector<int> levels;  ///< of each factor: a product of linear factors is greatest at an end of each
    double predicted = 0;
    Interval mean;    ///< of the mean of all such joints
    Interval future;  ///< of the mean of BondStudyOptions::future_runs joints
};

/// strength = sum of coefficients times the product of their factors' coded levels.
struct BondRegression {
    bool made = false;  ///< not where a factor has more than two levels and no order, or runs are too few
    std::string why_not;
    std::vector<BondCoefficient> coefficients;
    int df = 0, residual_df = 0;
    double ss = 0, residual_ss = 0, s = 0, r2 = 0, r2_adjusted = 0, f = 0, p = 1;
    double r2_predicted = 0;   ///< each row foretold by a fit without it
    bool lack_tested = false;  ///< whether rows repeat and cells are more than terms
    int lack_df = 0, pure_df = 0;
    double lack_ss = 0, pure_ss = 0, lack_f = 0, lack_p = 1;
    BondOptimum optimum;
};

/// The runs of one combination of levels.
struct BondCell {
    std::vector<int> levels;
    int runs = 0;
    double mean = 0;
    Interval interval;  ///< of the mean, from the error within cells; equal to it where nothing repeats
};

struct BondStudy {
    Anova anova;
    BondRegression regression;
    std::vector<BondCell> cells;  ///< that were tested, by levels
    std::size_t best_cell = 0;    ///< of the greatest mean
    double within_variance = 0;   ///< of joints made alike
    int within_df = 0;            ///< 0 where nothing repeats
    /// Whether the regression may be used: it was made and its lack of fit is no greater than chance explains
    /// (p of 0.05 or more), or could not be tested.
    [[nodiscard]] bool regression_fits() const {
        return regression.made && (!regression.lack_tested || regression.lack_p >= 0.05);
    }
};

/// "A", "AB" and so on; "constant" for 0.
[[nodiscard]] std::string term_name(BondTerm term);

/// The strength that the regression foretells. @param coded a value for each factor, within [−1, 1]
[[nodiscard]] double predicted(const BondRegression& regression, const std::vector<double>& coded);

/// @throws Error(input, "bond.…") for no rows, factors with one level, too many factors or columns, and where
/// the runs do not tell the terms apart; Error(usage, "bond.terms") for terms of factors that are not there
[[nodiscard]] BondStudy study_bonds(const BondTests& tests, const BondStudyOptions& options = {});

}  // namespace slabwright
