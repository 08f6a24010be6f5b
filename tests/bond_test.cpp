// Studies of joints: sums of squares against brute force, the table's text, and the command.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <nlohmann/json.hpp>
#include <random>

#include "engine/bonding/bond_study.h"
#include "io/read/bond_csv.h"
#include "io/write/bond_plots.h"
#include "io/write/bond_report.h"
#include "kernels/errors.h"
#include "kernels/statistics/distributions.h"
#include "tests/support/command.h"
#include "tests/support/files.h"
#include "tests/support/places.h"
#include "tests/support/seed.h"
#include "tests/support/temporary_folder.h"

namespace slabwright {
namespace {

using support::run_command;
using support::TemporaryFolder;

const std::string command = support::built_command();
const std::string brazing = support::checkout("tests/data/fdff-brazing.csv");

BondTests random_tests(std::mt19937& random, bool balanced) {
    BondTests tests;
    const int factors = 1 + static_cast<int>(random() % 3);
    int cells = 1;
    for (int f = 0; f < factors; ++f) {
        BondFactor factor;
        factor.name = "f" + std::to_string(f);
        const int levels = 2 + static_cast<int>(random() % 2);
        for (int l = 0; l < levels; ++l) {
            factor.levels.push_back(std::to_string(l));
            factor.coded.push_back(2.0 * l / (levels - 1) - 1);
        }
        factor.is_number = true;
        cells *= levels;
        tests.factors.push_back(factor);
    }
    std::normal_distribution<double> noise(0, 1);
    for (int cell = 0; cell < cells; ++cell) {
        const int runs = balanced ? 2 : 1 + (cell == 0) + static_cast<int>(random() % 3);
        const double effect = 5 * noise(random);
        for (int run = 0; run < runs; ++run) {
            std::vector<int> levels;
            int rest = cell;
            for (const BondFactor& factor : tests.factors) {
                const int n = static_cast<int>(factor.levels.size());
                levels.push_back(rest % n);
                rest /= n;
            }
            tests.levels.push_back(levels);
            tests.strength.push_back(effect + noise(random));
        }
    }
    return tests;
}

// Of balanced tests every sum of squares is that of means: the effect of a set of factors is the mean over
// the cells of its levels less the effects of its subsets.
TEST(BondStudy, BalancedSumsAreThoseOfMeans) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 50; ++round) {
        const BondTests tests = random_tests(random, true);
        const BondStudy study = study_bonds(tests);
        const std::size_t n = tests.strength.size();
        std::vector<std::vector<double>> effect(1u << tests.factors.size(), std::vector<double>(n));
        for (BondTerm term = 0; term < effect.size(); ++term) {
            for (std::size_t i = 0; i < n; ++i) {
                double sum = 0;
                int count = 0;
                for (std::size_t j = 0; j < n; ++j) {
                    bool alike = true;
                    for (std::size_t f = 0; f < tests.factors.size(); ++f)
                        if (term >> f & 1) alike = alike && tests.levels[i][f] == tests.levels[j][f];
                    if (alike) sum += tests.strength[j], ++count;
                }
                effect[term][i] = sum / count;
                for (BondTerm part = 0; part < term; ++part)
                    if ((part & term) == part) effect[term][i] -= effect[part][i];
            }
        }
        for (const AnovaRow& row : study.anova.rows) {
            double ss = 0;
            for (const double e : effect[row.term]) ss += e * e;
            EXPECT_NEAR(row.sequential_ss, ss, 1e-8 * study.anova.total_ss) << term_name(row.term);
            EXPECT_NEAR(row.adjusted_ss, ss, 1e-8 * study.anova.total_ss) << term_name(row.term);
        }
    }
}

// Of any tests: sequential sums add up, and the regression is what the normal equations give.
TEST(BondStudy, RegressionSolvesTheNormalEquations) {
    std::mt19937 random(test::seed());
    for (int round = 0; round < 50; ++round) {
        const BondTests tests = random_tests(random, false);
        const BondStudy study = study_bonds(tests, {.terms = {}, .order = 1});
        double sum = study.anova.error_ss;
        for (const AnovaRow& row : study.anova.rows) sum += row.sequential_ss;
        EXPECT_NEAR(sum, study.anova.total_ss, 1e-8 * study.anova.total_ss);
        ASSERT_TRUE(study.regression.made) << study.regression.why_not;
        const auto rows = static_cast<Eigen::Index>(tests.strength.size());
        const auto factors = static_cast<Eigen::Index>(tests.factors.size());
        Eigen::MatrixXd x(rows, factors + 1);
        Eigen::VectorXd y(rows);
        for (Eigen::Index r = 0; r < rows; ++r) {
            const auto row = static_cast<std::size_t>(r);
            y[r] = tests.strength[row];
            x(r, 0) = 1;
            for (Eigen::Index f = 0; f < factors; ++f) {
                const auto factor = static_cast<std::size_t>(f);
                x(r, f + 1) =
                    tests.factors[factor].coded[static_cast<std::size_t>(tests.levels[row][factor])];
            }
        }
        const Eigen::MatrixXd inverse = (x.transpose() * x).inverse();
        const Eigen::VectorXd b = inverse * x.transpose() * y;
        const double variance = (y - x * b).squaredNorm() / static_cast<double>(rows - factors - 1);
        for (Eigen::Index i = 0; i <= factors; ++i) {
            const BondCoefficient& c = study.regression.coefficients[static_cast<std::size_t>(i)];
            EXPECT_NEAR(c.value, b[i], 1e-9 * (1 + std::abs(b[i])));
            EXPECT_NEAR(c.standard_error, std::sqrt(variance * inverse(i, i)), 1e-9);
        }
        // Nothing within the tested levels is foretold stronger than the optimum.
        for (int trial = 0; trial < 20; ++trial) {
            std::vector<double> coded;
            for (Eigen::Index f = 0; f < factors; ++f)
                coded.push_back(std::uniform_real_distribution<double>(-1, 1)(random));
            EXPECT_LE(predicted(study.regression, coded), study.regression.optimum.predicted + 1e-9);
        }
        // PRESS, by leaving rows out.
        double press = 0;
        bool spared = true;  // no row alone tells a term
        for (Eigen::Index left = 0; left < rows; ++left) {
            Eigen::MatrixXd others(rows - 1, factors + 1);
            Eigen::VectorXd values(rows - 1);
            for (Eigen::Index r = 0, to = 0; r < rows; ++r)
                if (r != left) others.row(to) = x.row(r), values[to++] = y[r];
            const Eigen::MatrixXd normal = others.transpose() * others;
            spared = spared && std::abs(normal.determinant()) > 1e-9;
            if (!spared) break;
            const double miss = y[left] - x.row(left) * (normal.inverse() * others.transpose() * values);
            press += miss * miss;
        }
        if (spared) {
            EXPECT_NEAR(study.regression.r2_predicted, 1 - press / study.anova.total_ss, 1e-7);
        }
    }
}

// An interval of 95 % holds the true mean in 95 of 100 studies.
TEST(BondStudy, IntervalsHoldAsOftenAsTheySay) {
    std::mt19937 random(test::seed());
    std::normal_distribution<double> noise(0, 3);
    int held = 0, future_held = 0;
    constexpr int rounds = 2000;
    for (int round = 0; round < rounds; ++round) {
        BondTests tests;
        tests.factors = {{"a", {"0", "1"}, {-1, 1}, true}};
        for (int i = 0; i < 8; ++i) {
            tests.levels.push_back({i % 2});
            tests.strength.push_back(10 + 4 * (i % 2 * 2 - 1) + noise(random));
        }
        const BondOptimum o = study_bonds(tests).regression.optimum;
        if (o.levels[0] != 1) continue;
        held += o.mean.low <= 14 && 14 <= o.mean.high;
        const double future = 14 + (noise(random) + noise(random) + noise(random)) / 3;
        future_held += o.future.low <= future && future <= o.future.high;
    }
    EXPECT_NEAR(held, 0.95 * rounds, 50);
    EXPECT_NEAR(future_held, 0.95 * rounds, 50);
}

TEST(Distributions, AgreeWithTables) {
    EXPECT_NEAR(f_upper_tail(f_critical(0.05, 3, 7), 3, 7), 0.05, 1e-12);
    EXPECT_NEAR(f_critical(0.05, 1, 12), 4.7472, 5e-5);
    EXPECT_NEAR(t_half_width(0.95, 12), 2.1788, 5e-5);
    EXPECT_NEAR(t_two_sided(t_half_width(0.9, 5), 5), 0.1, 1e-12);
    EXPECT_NEAR(t_two_sided(1, 1), 0.5, 1e-12) << "Cauchy's quartile";
    EXPECT_NEAR(normal_quantile(0.975), 1.959964, 1e-6);
    EXPECT_NEAR(normal_quantile(0.2), -normal_quantile(0.8), 1e-12);
    EXPECT_THROW((void)normal_quantile(0), Error);
    EXPECT_THROW((void)f_upper_tail(1, 0, 3), Error);
    EXPECT_THROW((void)t_half_width(1, 3), Error);
    EXPECT_THROW((void)t_two_sided(std::nan(""), 3), Error);
}

BondTests read_text(const std::string& text, const BondCsvOptions& options = {}) {
    const TemporaryFolder folder;
    support::spit(folder / "t.csv", text);
    return read_bond_csv(folder / "t.csv", options);
}

TEST(BondCsv, ReadsWhatTablesHold) {
    const BondTests tests = read_text(
        "\xEF\xBB\xBF# a comment\r\n\"glue, kind\",press time,grade,strength\r\n"
        "\"PU \"\"fast\"\"\", 30 ,high,1e1\r\n\r\nPVA,+10,Low,12\r\nPVA,20.0,medium,13");
    ASSERT_EQ(tests.factors.size(), 3u);
    EXPECT_EQ(tests.factors[0].name, "glue, kind");
    EXPECT_EQ(tests.factors[0].levels, (std::vector<std::string>{"PU \"fast\"", "PVA"}));
    EXPECT_EQ(tests.factors[0].coded, (std::vector<double>{-1, 1}));
    EXPECT_EQ(tests.factors[1].levels, (std::vector<std::string>{"+10", "20.0", "30"}));
    EXPECT_EQ(tests.factors[1].coded, (std::vector<double>{-1, 0, 1}));
    EXPECT_TRUE(tests.factors[1].is_number);
    EXPECT_EQ(tests.factors[2].levels, (std::vector<std::string>{"Low", "medium", "high"}));
    EXPECT_EQ(tests.levels[0], (std::vector<int>{0, 2, 2}));
    EXPECT_EQ(tests.strength, (std::vector<double>{10, 12, 13}));
    EXPECT_EQ(tests.strength_name, "strength");
}

TEST(BondCsv, RefusesInOneLineWithFileLineAndRemedy) {
    struct Case {
        const char* text;
        const char* code;
        const char* place;
    };
    for (const Case& c : std::initializer_list<Case>{
             {"", "bond.rows", "t.csv"},
             {"a,y\n", "bond.rows", "t.csv"},
             {"a,,y\n1,2,3\n", "bond.header", "line 1"},
             {"a,a,y\n1,2,3\n", "bond.header", "line 1"},
             {"a,y\n1,2\n1\n", "bond.cells", "line 3"},
             {"a,y\n\n1,2,5\n", "bond.cells", "line 3"},
             {"a,y\n,2\n", "bond.cells", "line 2"},
             {"a,y\n1,x\n", "bond.number", "line 2"},
             {"a,y\n1,nan\n", "bond.number", "line 2"},
             {"a,y\n1,inf\n", "bond.number", "line 2"},
             {"a,y\n1,1e16\n", "bond.number", "line 2"},
             {"a,y\n1,1e999\n", "bond.number", "line 2"},
             {"a,y\n1,0x10\n", "bond.number", "line 2"},
             {"a,y\n\"1,2\n", "bond.quotes", "line 2"},
             {"a,y\n\"1\"2,3\n", "bond.quotes", "line 2"},
         }) {
        try {
            (void)read_text(c.text);
            ADD_FAILURE() << c.text;
        } catch (const Error& error) {
            EXPECT_EQ(error.code(), c.code) << c.text;
            EXPECT_NE(error.place().find(c.place), std::string::npos) << c.text << error.what();
            EXPECT_FALSE(error.remedy().empty()) << c.text;
            EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
        }
    }
    EXPECT_THROW((void)read_text(std::string("a,y\n1,2\0\n", 9)), Error);
    EXPECT_THROW((void)read_text("a,y\n1,2\n", {.response = "z"}), Error);
    EXPECT_THROW((void)read_text("a,y\n1,2\n", {.ignored = {"y"}}), Error);
}

TEST(BondCommand, TellsWhetherTheRegressionFits) {
    const auto told =
        run_command({command, "bond", brazing, "--ignore", "run", "--terms", "A,B,C,AB,AC,ABC"});
    EXPECT_EQ(told.exit, 0) << told.err;
    for (const char* part :
         {"C  sheet thickness: 0.065 (-1), 0.25 (1)", "389.519", "96.61",
          "lack of fit F(5,12) = 20.5, p = 2e-05",
          "heating time 40, filler weight High, sheet thickness 0.25: 7780", "the regression does not fit"})
        EXPECT_NE(told.out.find(part), std::string::npos) << part << '\n' << told.out;
    const auto json = run_command({command, "bond", brazing, "--ignore", "run", "--json"});
    ASSERT_EQ(json.exit, 0) << json.err;
    const auto document = nlohmann::json::parse(json.out);
    EXPECT_EQ(document["schema"], "slabwright.bond/1");
    EXPECT_NEAR(document["anova"]["error_ss"].get<double>(), 1820703, 0.5);
    EXPECT_EQ(document["cells"].size(), 12u);
    EXPECT_EQ(document["cells"][document["best_cell"].get<std::size_t>()]["mean"], 7780);
}

int count_of(const std::string& text, const std::string& part) {
    int n = 0;
    for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++n;
    return n;
}

// 3 factors of 3, 2 and 2 levels, their 3 pairs, and 24 tests in 3 ways.
TEST(BondCommand, PlotsEffectsInteractionsAndWhatIsLeft) {
    const TemporaryFolder folder;
    const std::string file = folder / "plots.svg";
    const auto told = run_command({command, "bond", brazing, "--ignore", "run", "--plots", file});
    ASSERT_EQ(told.exit, 0) << told.err;
    const std::string svg = support::slurp(file);
    EXPECT_EQ(count_of(svg, "<g transform"), 9);
    EXPECT_EQ(count_of(svg, "<circle"), (3 + 2 + 2) + (6 + 6 + 4) + 3 * 24);
    EXPECT_EQ(count_of(svg, "<g"), count_of(svg, "</g>"));
    for (const char* part : {"strength by heating time", "heating time and sheet thickness",
                             ">filler weight High<", "left by the regression", "a normal distribution"})
        EXPECT_NE(svg.find(part), std::string::npos) << part;
    EXPECT_EQ(run_command({command, "bond", brazing, "--plots", folder / "none/plots.svg"}).exit, 3);
}

// Names are text, not markup; two means of 1 and 3 at both ends of the axis, 2 between them.
TEST(BondPlots, WordsAreEscapedAndMeansLieWhereTheyShould) {
    const BondTests tests = read_text("a<b&c,y\nPU,0.5\nPU,1.5\nPVA,2.5\nPVA,3.5\n");
    const std::string svg = bond_plots_svg(tests, study_bonds(tests));
    EXPECT_NE(svg.find("y by a&lt;b&amp;c"), std::string::npos) << svg;
    EXPECT_EQ(svg.find("a<b"), std::string::npos);
    EXPECT_EQ(count_of(svg, "<circle"), 2 + 3 * 4);
    const std::string first = svg.substr(0, svg.find("</g>"));
    for (const char* part : {">0.84<", ">2<", ">3.16<", "M60.0 105.0H290.0"})
        EXPECT_NE(first.find(part), std::string::npos) << part << '\n' << first;
}

TEST(BondCommand, WhatItCannotStudyItRefuses) {
    const TemporaryFolder folder;
    const auto refuses = [&](const std::string& text, const std::vector<std::string>& more, int exit,
                             const char* part) {
        support::spit(folder / "t.csv", text);
        std::vector<std::string> arguments{command, "bond", folder / "t.csv"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const auto result = run_command(arguments);
        EXPECT_EQ(result.exit, exit) << text << result.err;
        EXPECT_NE(result.err.find(part), std::string::npos) << result.err;
        EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
        EXPECT_EQ(result.out, "");
    };
    refuses("y\n1\n2\n3\n", {}, 3, "1 to 6 factors");
    refuses("a,y\n1,1\n1,2\n1,3\n", {}, 3, "same level");
    refuses("a,y\n1,1\n2,2\n", {}, 3, "fewer than three");
    refuses("a,y\n1,5\n2,5\n2,5\n", {}, 3, "all strengths are equal");
    refuses("a,b,y\n1,1,5\n2,1,6\n1,2,7\n", {}, 3, "not tested");
    refuses("a,y\n1,1\n2,2\n2,3\n", {"--terms", "A,D"}, 2, "not there");
    refuses("a,y\n1,1\n2,2\n2,3\n", {"--terms", "A,A"}, 2, "twice");
    refuses("a,y\n1,1\n2,2\n2,3\n", {"--terms", "A,x"}, 2, "no factor");
    refuses("a,y\n1,1\n2,2\n2,3\n", {"--response", "z"}, 2, "its columns are a, y");
    const auto json = run_command({command, "bond", folder / "none.csv", "--json"});
    EXPECT_EQ(json.exit, 3);
    EXPECT_EQ(nlohmann::json::parse(json.err)["error"]["code"], "bond.missing");
}

// Words without an order are analysed, but no line is laid through them.
TEST(BondStudy, TheTableOfVarianceIsThatByHand) {
    // Means of 2 and 6 about 4: 16 between the glues, 4 within them at two degrees of freedom.
    const BondTests tests = read_text("glue,y\nPU,1\nPVA,5\nPU,3\nPVA,7\n");
    const std::string told = bond_text(tests, study_bonds(tests), {});
    const std::size_t from = told.find("source"), to = told.find("\n\n", from);
    EXPECT_EQ(told.substr(from, to - from + 1),
              "source  df  seq SS  adj SS  adj MS     F      p\n"
              "A        1      16      16      16  8.00  0.106\n"
              "error    2       4       4       2\n"
              "total    3      20\n"
              "S 1.414  R2 80.00 %  adjusted 70.00 %\n");
}

TEST(BondStudy, WordsWithoutOrderHaveNoRegression) {
    const BondTests tests = read_text("glue,y\nPU,1\nPVA,2\nCA,4\nPU,1.5\nPVA,2.2\nCA,4.4\n");
    const BondStudy study = study_bonds(tests);
    EXPECT_FALSE(study.regression.made);
    EXPECT_NE(study.regression.why_not.find("glue"), std::string::npos);
    EXPECT_EQ(study.anova.rows[0].df, 2);
    EXPECT_FALSE(study.regression_fits());
    EXPECT_NE(bond_text(tests, study, {}).find("strongest tested: glue CA"), std::string::npos);
}

}  // namespace
}  // namespace slabwright
