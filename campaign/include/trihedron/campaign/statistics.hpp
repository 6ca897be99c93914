#pragma once
/// Statistics of runs that assume nothing of the distribution, and the bounds of χ².

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace trihedron::campaign {

/// One-sided confidence of the bounds of a quantile.
inline constexpr double kConfidence = 0.9;

/// A quantile over runs, and bounds of the true one by order statistics (H. A. David, Order Statistics, section 7.1).
struct QuantileBounds {
  double p = 0;
  double estimate = 0;  ///< smallest value that a share p of the runs does not exceed
  std::optional<double>
      lower;  ///< the true quantile is not below it, with kConfidence; absent where the runs are too few
  std::optional<double>
      upper;  ///< the true quantile is not above it, with kConfidence; absent where the runs are too few
};

/// values: increasing, at least one; infinity is a value. 0 < p < 1.
[[nodiscard]] QuantileBounds quantile_bounds(std::span<const double> values, double p, double confidence = kConfidence);

/// Fewest runs whose largest value is an upper bound of the quantile p with this confidence: 767 for 0.997 at 0.9.
[[nodiscard]] std::size_t runs_needed(double p, double confidence = kConfidence);
/// Largest quantile that so many runs bound from above with this confidence.
[[nodiscard]] double quantile_supported(std::size_t runs, double confidence = kConfidence);

/// Whether `count` of `of` say with this confidence that more than `share` of all are so (C. J. Clopper, E. S. Pearson
/// 1934).
[[nodiscard]] bool is_share_above(std::size_t count, std::size_t of, double share, double confidence = kConfidence);

/// Of each value, how many others are surely below it less how many are surely above (E. A. Gehan 1965, by N. Mantel
/// 1967). Where all are known, the same order as the ranks, with mean ranks for equal values. A lower bound, which the
/// value itself exceeds, is surely above what is not above it, and surely below nothing. NaN for NaN, which does not
/// count; infinity is a value. is_lower_bound: as many.
[[nodiscard]] std::vector<double> order_scores(std::span<const double> values, std::span<const char> is_lower_bound);

/// Spearman's rank correlation, with mean ranks for equal values.
struct RankCorrelation {
  double rho = 0;
  double p_value = 1;  ///< of a larger |rho| by chance, by Student's t with n − 2 degrees of freedom
  std::size_t count = 0;
};
/// Pairs with NaN are left out; infinity is a value. Nothing for fewer than 10 pairs, or 40 where x has two values
/// alone, of which Student's t says too little of what chance does; nor where one does not change.
[[nodiscard]] std::optional<RankCorrelation> rank_correlation(std::span<const double> x, std::span<const double> y);

/// Bounds that hold a mean of χ² over its degrees of freedom with `share`, half of the rest on each side.
struct ChiSquareBounds {
  double low = 0;
  double high = 0;
};
/// freedom: of the sum, above zero. Of the sum over its degrees of freedom.
[[nodiscard]] ChiSquareBounds chi_square_bounds(double freedom, double share);
/// Share of χ² below a value.
[[nodiscard]] double chi_square_share(double value, double freedom);
/// Value that a share of χ² lies below.
[[nodiscard]] double chi_square_quantile(double share, double freedom);

}  // namespace trihedron::campaign
