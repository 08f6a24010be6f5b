// FDFF chapter VI and appendix A: what print computed from its tests of joints, and what it says beside them.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "engine/bonding/bond_study.h"
#include "io/read/bond_csv.h"
#include "kernels/statistics/distributions.h"
#include "tests/support/places.h"

namespace slabwright {
namespace {

constexpr BondTerm A = 1, B = 2, C = 4;

BondTests brazing() {
    return read_bond_csv(support::checkout("tests/data/fdff-brazing.csv"), {.ignored = {"run"}});
}

/// Print's model leaves BC out, which its analysis of variance rejects.
BondStudyOptions print_model() { return {.terms = {A, B, C, A | B, A | C, A | B | C}}; }

/// A value as print rounds it.
void expect_printed(double printed, double value, int decimals, const char* what) {
    EXPECT_NEAR(value, printed, 0.5 * std::pow(10, -decimals) * (1 + 1e-9)) << what;
}

TEST(FdffBrazing, AnalysisOfVarianceIsTable64) {
    const BondStudy study = study_bonds(brazing());
    struct Printed {
        BondTerm term;
        int df;
        double ss, ms, f, p;
    };
    const Printed table[] = {
        {A, 2, 7914974, 3957487, 26.08, 0.000},        {B, 1, 2208873, 2208873, 14.56, 0.002},
        {C, 1, 3002630, 3002630, 19.79, 0.001},        {A | B, 2, 23811337, 11905668, 78.47, 0.000},
        {A | C, 2, 12484105, 6242053, 41.14, 0.000},   {B | C, 1, 466767, 466767, 3.08, 0.105},
        {A | B | C, 2, 2038969, 1019485, 6.72, 0.011},
    };
    ASSERT_EQ(study.anova.rows.size(), std::size(table));
    for (std::size_t i = 0; i < std::size(table); ++i) {
        const AnovaRow& row = study.anova.rows[i];
        EXPECT_EQ(row.term, table[i].term);
        EXPECT_EQ(row.df, table[i].df);
        const std::string name = term_name(row.term);
        expect_printed(table[i].ss, row.sequential_ss, 0, name.c_str());
        expect_printed(table[i].ss, row.adjusted_ss, 0, name.c_str());
        expect_printed(table[i].ms, row.mean_square, 0, name.c_str());
        expect_printed(table[i].f, row.f, 2, name.c_str());
        expect_printed(table[i].p, row.p, 3, name.c_str());
    }
    EXPECT_EQ(study.anova.error_df, 12);
    EXPECT_EQ(study.anova.total_df, 23);
    expect_printed(1820703, study.anova.error_ss, 0, "error");
    expect_printed(53748358, study.anova.total_ss, 0, "total");
    expect_printed(389.519, study.anova.s, 3, "S");
    expect_printed(96.61, 100 * study.anova.r2, 2, "R2");
    expect_printed(93.51, 100 * study.anova.r2_adjusted, 2, "R2 adjusted");
}

TEST(FdffBrazing, RegressionIsTableA4) {
    const BondRegression r = study_bonds(brazing(), print_model()).regression;
    struct Printed {
        double value, error, t, p, ss;
    };
    const Printed table[] = {
        {4646.8, 206.3, 22.52, 0.000, 0},       {481.7, 252.7, 1.91, 0.074, 3712366},
        {-303.4, 206.3, -1.47, 0.160, 2208873}, {353.7, 206.3, 1.71, 0.105, 3002630},
        {944.4, 252.7, 3.74, 0.002, 14271395},  {872.6, 252.7, 3.45, 0.003, 12181845},
        {249.8, 252.7, 0.99, 0.337, 998501},
    };
    ASSERT_EQ(r.coefficients.size(), std::size(table));
    for (std::size_t i = 0; i < std::size(table); ++i) {
        const BondCoefficient& c = r.coefficients[i];
        const std::string name = term_name(c.term);
        expect_printed(table[i].value, c.value, 1, name.c_str());
        expect_printed(table[i].error, c.standard_error, 1, name.c_str());
        expect_printed(table[i].t, c.t, 2, name.c_str());
        expect_printed(table[i].p, c.p, 3, name.c_str());
        expect_printed(table[i].ss, c.sequential_ss, 0, name.c_str());
    }
    expect_printed(1010.90, r.s, 2, "S");
    expect_printed(67.7, 100 * r.r2, 1, "R2");
    expect_printed(56.3, 100 * r.r2_adjusted, 1, "R2 adjusted");
    EXPECT_EQ(r.df, 6);
    EXPECT_EQ(r.residual_df, 17);
    expect_printed(36375610, r.ss, 0, "regression");
    expect_printed(17372748, r.residual_ss, 0, "residual");
    expect_printed(1021926, r.residual_ss / r.residual_df, 0, "mean square");
    expect_printed(5.93, r.f, 2, "F");
    expect_printed(0.002, r.p, 3, "p");
}

// Print calls its models valid. Joints made alike differ far less than joints differ from the regression.
TEST(FdffBrazing, RegressionDoesNotFit) {
    const BondStudy study = study_bonds(brazing(), print_model());
    const BondRegression& r = study.regression;
    EXPECT_EQ(r.lack_df, 5);
    EXPECT_EQ(r.pure_df, 12);
    expect_printed(20.5, r.lack_f, 1, "lack of fit");
    expect_printed(2e-5, r.lack_p, 5, "its p");
    EXPECT_FALSE(study.regression_fits());
    expect_printed(151725, study.within_variance, 0, "variance of joints made alike");
    EXPECT_EQ(study.within_df, 12);
    const BondCell& best = study.cells[study.best_cell];
    EXPECT_EQ(best.levels, (std::vector<int>{2, 1, 1})) << "40 s, high, thick";
    EXPECT_EQ(best.mean, 7780);
    EXPECT_NEAR(best.interval.high - best.mean, 2.17881 * std::sqrt(151725.25 / 2), 0.1);
}

// FDFF table 6.3 (its 72 rows are not all printed): the figures of the table agree with each other.
TEST(FdffSoldering, Table63AgreesWithItself) {
    struct Printed {
        int df;
        double ss, ms, f, p;
    };
    double explained = 0;
    for (const Printed& row :
         {Printed{5, 3604610, 720922, 11.08, 0.000}, Printed{2, 266696, 133348, 2.05, 0.143},
          Printed{1, 18191758, 18191758, 279.67, 0.000}, Printed{10, 1115202, 111520, 1.71, 0.115},
          Printed{5, 2342676, 468535, 7.20, 0.000}, Printed{2, 20556, 10278, 0.16, 0.854},
          Printed{10, 1020887, 102089, 1.57, 0.156}}) {
        expect_printed(row.ms, row.ss / row.df, 0, "mean square");
        expect_printed(row.f, row.ss / row.df / 65048, 2, "F");
        expect_printed(row.p, f_upper_tail(row.ss / row.df / 65048, row.df, 36), 3, "p");
        explained += row.ss;
    }
    EXPECT_NEAR(explained + 2341721, 28904106, 1);
    expect_printed(91.90, 100 * explained / 28904106, 2, "R2");
    expect_printed(84.02, 100 * (1 - 2341721.0 / 36 / (28904106.0 / 71)), 2, "R2 adjusted");
    expect_printed(255.045, std::sqrt(2341721.0 / 36), 3, "S");
    // The critical ratios that print compares with.
    expect_printed(2.477, f_critical(0.05, 5, 36), 3, "F 5, 36");
    expect_printed(2.106, f_critical(0.05, 10, 36), 3, "F 10, 36");
    expect_printed(4.11, f_critical(0.05, 1, 36), 2, "F 1, 36");
    expect_printed(3.885, f_critical(0.05, 2, 12), 3, "F 2, 12");
}

// What print says and its own tables contradict. Each line: what it says, and what follows from the rows.
TEST(FdffBonding, WhatIsWrongInPrint) {
    const BondTests tests = brazing();
    const BondStudy study = study_bonds(tests, print_model());
    const BondRegression& r = study.regression;
    const auto says = [](const char* what, double print, double follows, double apart) {
        std::printf("  %-66s print %9.2f, follows %9.2f\n", what, print, follows);
        EXPECT_GT(std::abs(print - follows), apart) << what;
    };
    // Its equation 6.2 at 35 s and thin sheets is 5304 only with little filler in thick ones: the text swaps
    // B and C.
    EXPECT_NEAR(predicted(r, {0, -1, 1}), 5304, 0.5);
    says("5304 psi at 35 s, thin sheets, much filler (L1068)", 5304, predicted(r, {0, 1, -1}), 1000);
    // Soldering at 100 % tin, .1 g, stainless, by table A.2.
    const double soldered = -225.5 + 9.212 * 100 - 726.8 * 0.1 + 1005.31;
    EXPECT_NEAR(soldered, 1628.3, 0.05);
    says("the best soldered joint (L1016)", 1957.54, soldered, 300);
    // 5000.50 is no prediction: it is the mean of the twelve joints of thick sheets.
    double thick = 0;
    for (std::size_t i = 0; i < tests.strength.size(); ++i)
        if (tests.levels[i][2] == 1) thick += tests.strength[i] / 12;
    EXPECT_NEAR(thick, 5000.50, 0.005);
    says("the optimum at 30 s, thin, much filler (L1070)", 5000.50, predicted(r, {-1, 1, -1}), 400);
    says("the same at 35 s (table 6.5)", 5000.50, predicted(r, {0, 1, -1}), 1000);
    says("the optimum at 40 s, thick, much filler (table 6.5)", 6500, predicted(r, {1, 1, 1}), 700);
    says("the same by the joints tested", 6500, study.cells[study.best_cell].mean, 1200);
    // An interval of a prediction lies evenly about it.
    says("middle of the interval about 5000.50 (table 6.6)", 5000.50, (4850.33 + 5349.66) / 2, 50);
    says("its half width, from S and 17 degrees of freedom, at least", (5349.66 - 4850.33) / 2,
         t_half_width(0.95, 17) * r.s / std::sqrt(3.0), 900);
    EXPECT_EQ(r.optimum.levels, (std::vector<int>{2, 1, 1}));
    says("half width of the interval about 6500 (table 6.6)", (7169.98 - 5828.82) / 2,
         (r.optimum.future.high - r.optimum.future.low) / 2, 500);
    says("F of tin in the text (L987)", 11.8, 720922.0 / 65048, 0.5);
    says("F 1, 12 at 5 % (L1053)", 4.743, f_critical(0.05, 1, 12), 0.003);
}

}  // namespace
}  // namespace slabwright
