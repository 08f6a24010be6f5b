#include "kernels/statistics/distributions.h"

#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>

#include "kernels/errors.h"

namespace slabwright {

namespace {

void require(bool holds) {
    if (!holds)
        throw Error(ErrorKind::usage, "statistics.argument",
                    "a distribution was asked for outside its degrees of freedom or its range");
}

}  // namespace

double f_upper_tail(double f, double df_above, double df_below) {
    require(f >= 0 && std::isfinite(f) && df_above >= 1 && df_below >= 1);
    return boost::math::cdf(complement(boost::math::fisher_f(df_above, df_below), f));
}

double f_critical(double upper, double df_above, double df_below) {
    require(upper > 0 && upper < 1 && df_above >= 1 && df_below >= 1);
    return boost::math::quantile(complement(boost::math::fisher_f(df_above, df_below), upper));
}

double t_two_sided(double value, double df) {
    require(std::isfinite(value) && df >= 1);
    return 2 * boost::math::cdf(complement(boost::math::students_t(df), std::abs(value)));
}

double t_half_width(double confidence, double df) {
    require(confidence > 0 && confidence < 1 && df >= 1);
    return boost::math::quantile(complement(boost::math::students_t(df), (1 - confidence) / 2));
}

double normal_quantile(double lower) {
    require(lower > 0 && lower < 1);
    return boost::math::quantile(boost::math::normal(), lower);
}

}  // namespace slabwright
