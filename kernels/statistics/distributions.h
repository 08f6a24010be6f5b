// The F, t and normal distributions, as far as tests of hypotheses need them.
#pragma once

namespace slabwright {

/// P(F > f) of an F distribution: the p-value of a ratio of mean squares.
/// @param f 0 or more. @param df_above, df_below degrees of freedom, 1 or more
/// @throws Error(usage, "statistics.argument") outside that
[[nodiscard]] double f_upper_tail(double f, double df_above, double df_below);

/// The ratio that F passes with probability `upper`, in (0, 1). @throws as f_upper_tail
[[nodiscard]] double f_critical(double upper, double df_above, double df_below);

/// P(|t| > |value|) of Student's distribution. @throws as f_upper_tail
[[nodiscard]] double t_two_sided(double value, double df);

/// The half width, in standard errors, of the two-sided interval that holds with `confidence`, in (0, 1).
/// @throws as f_upper_tail
[[nodiscard]] double t_half_width(double confidence, double df);

/// The value that a normal distribution of mean 0 and deviation 1 stays under with probability `lower`, in
/// (0, 1). @throws as f_upper_tail
[[nodiscard]] double normal_quantile(double lower);

}  // namespace slabwright
