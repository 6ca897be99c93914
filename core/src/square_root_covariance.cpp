#include "trihedron/core/square_root_covariance.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/lanes.hpp"

// Where the processor can, four numbers are worked on at a time: the same operations in the same order for each number,
// so that the bits are the same.

namespace trihedron {
namespace {

// What has the template parameter L is always inlined, also into the functions *_wide, which are compiled for AVX2.
// What is not inlined there is compiled for any processor.

using Lanes4 = double __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void get(const double* at, double& number) { number = *at; }
[[gnu::always_inline]] inline void put(const double& number, double* at) { *at = number; }
[[gnu::always_inline]] inline void get(const double* at, Lanes& lanes) { lanes = load2(at); }
[[gnu::always_inline]] inline void put(const Lanes& lanes, double* at) { store2(lanes, at); }
[[gnu::always_inline]] inline void get(const double* at, Lanes4& lanes) { std::memcpy(&lanes, at, sizeof lanes); }
[[gnu::always_inline]] inline void put(const Lanes4& lanes, double* at) { std::memcpy(at, &lanes, sizeof lanes); }

/// Vectors that are worked on side by side: as many as the registers of the processor hold beside their sums.
#ifdef __x86_64__
constexpr int kSideBySide = 2;
#else
constexpr int kSideBySide = 1;
#endif

template <class L>
constexpr int width() {
  return static_cast<int>(sizeof(L) / sizeof(double));
}
template <>
constexpr int width<double>() {
  return 1;
}

/// Calls work(numbers, k) for all columns k from `first` on, as many at a time as L has numbers, the last ones fewer.
/// `numbers` is of the type that holds as many.
template <class L, class Work>
[[gnu::always_inline]] inline void for_columns(int first, int columns, const Work& work) {
  int rest = first + (columns - first) / width<L>() * width<L>();
  for (int k = first; k < rest; k += width<L>()) {
    work(L{}, k);
  }
  if (width<L>() > 2 && rest + 2 <= columns) {
    work(Lanes{}, rest);
    rest += 2;
  }
  if (rest < columns) {
    work(0.0, rest);
  }
}

/// Calls work() with the number, from 1 to Most, as a constant: what is larger is Most.
template <std::size_t Most, class Work>
[[gnu::always_inline]] inline void with_constant(int number, const Work& work) {
  if constexpr (Most > 1) {
    if (number < static_cast<int>(Most)) {
      with_constant<Most - 1>(number, work);
      return;
    }
  }
  work(std::integral_constant<std::size_t, Most>{});
}

/// One Householder reflection of row `r` and M rows below each other, all columns from 1 on; v: the M entries of the
/// first column.
template <class L, std::size_t M>
[[gnu::always_inline]] inline void reflect(double* __restrict r, double* const (&rows)[M], const double (&v)[M],
                                           double v0, double beta, int columns) {
  for_columns<L>(
      1, columns, [&](auto its, int k) __attribute__((always_inline)) {
        decltype(its) below[M];
        get(r + k, its);
        decltype(its) s = v0 * its;
        for (std::size_t i = 0; i < M; ++i) {
          get(rows[i] + k, below[i]);
          s += v[i] * below[i];
        }
        s *= beta;
        put(its - v0 * s, r + k);
        for (std::size_t i = 0; i < M; ++i) {
          put(below[i] - v[i] * s, rows[i] + k);
        }
      });
}

template <class L, std::size_t M>
[[gnu::always_inline]] inline void rotate_rows_into(RowsView root, RowsView extra, int eliminated) {
  for (int j = 0; j < eliminated; ++j) {
    double v[M];
    double* rows[M];
    double below = 0;
    for (std::size_t i = 0; i < M; ++i) {
      rows[i] = extra.row(static_cast<int>(i)) + j;
      v[i] = *rows[i];
      below += v[i] * v[i];
    }
    if (!(below > 0)) {
      continue;
    }
    double* r = root.row(j) + j;
    const double norm = std::sqrt(*r * *r + below);
    const double alpha = *r > 0 ? -norm : norm;
    const double v0 = *r - alpha;
    reflect<L, M>(r, rows, v, v0, -1 / (alpha * v0), root.columns - j);
    *r = alpha;
    for (double* row : rows) {
      *row = 0;
    }
  }
}

template <class L>
[[gnu::always_inline]] inline void rotate_all_into(RowsView root, RowsView extra, int eliminated) {
  constexpr int kAtOnce = 8;
  for (int first = 0; first < extra.rows; first += kAtOnce) {
    const RowsView some{extra.row(first), extra.rows - first, extra.columns, extra.stride};
    with_constant<kAtOnce>(
        some.rows, [&](auto rows) __attribute__((always_inline)) {
          constexpr std::size_t kRows = decltype(rows)::value;
          rotate_rows_into<L, kRows>(root, some, eliminated);
        });
  }
}

/// Columns in a row in which some row has a number other than zero.
struct Run {
  int begin = 0;
  int end = 0;
};
/// Those of M rows, in order; where there are more than kept, the last holds all that follow.
template <std::size_t M>
class Runs {
 public:
  Runs(double* const (&rows)[M], int columns) {
    bool is_in_run = false;
    for (int j = 0; j < columns; ++j) {
      std::uint64_t bits = 0;
      for (const double* row : rows) {
        std::uint64_t its = 0;
        std::memcpy(&its, row + j, sizeof its);
        bits |= its;
      }
      const bool is_there = bits != 0;
      if (is_there) {
        if (!is_in_run && count_ < kMost) {
          runs_[count_++].begin = j;
        }
        runs_[count_ - 1].end = j + 1;
      }
      is_in_run = is_there;
    }
  }
  [[nodiscard]] const Run* begin() const { return runs_; }
  [[nodiscard]] const Run* end() const { return runs_ + count_; }

 private:
  static constexpr int kMost = 16;
  Run runs_[kMost];
  int count_ = 0;
};

/// see_through() of M rows in the columns from j on, `Vectors` times as many as L has numbers; those before them are
/// still as they were.
template <class L, int Vectors, std::size_t M>
[[gnu::always_inline]] inline void see_through_columns(ConstRowsView root, const Runs<M>& runs, int j,
                                                       double* const (&rows)[M]) {
  L sum[M][Vectors] = {};
  for (const Run& run : runs) {
    const double* its_row = root.row(run.begin) + j;
    const int end = std::min(run.end, j + Vectors * width<L>());
    for (int p = run.begin; p < end; ++p, its_row += root.stride) {
      L its[Vectors];
      for (int v = 0; v < Vectors; ++v) {
        get(its_row + v * width<L>(), its[v]);
      }
      for (std::size_t i = 0; i < M; ++i) {
        const double factor = rows[i][p];
        for (int v = 0; v < Vectors; ++v) {
          sum[i][v] += factor * its[v];
        }
      }
    }
  }
  for (std::size_t i = 0; i < M; ++i) {
    for (int v = 0; v < Vectors; ++v) {
      put(sum[i][v], rows[i] + j + v * width<L>());
    }
  }
}

/// see_through() of M rows, from the last columns to the first.
template <class L, std::size_t M>
[[gnu::always_inline]] inline void see_through_together(ConstRowsView root, RowsView rows) {
  double* x[M];
  for (std::size_t i = 0; i < M; ++i) {
    x[i] = rows.row(static_cast<int>(i));
  }
  const Runs<M> runs(x, root.rows);
  constexpr int kAtOnce = kSideBySide * width<L>();
  int done = root.columns;
  if (done % 2 != 0) {
    see_through_columns<double, 1>(root, runs, --done, x);
  }
  if (done % width<L>() != 0) {
    done -= 2;
    see_through_columns<Lanes, 1>(root, runs, done, x);
  }
  if (done % kAtOnce != 0) {
    done -= width<L>();
    see_through_columns<L, 1>(root, runs, done, x);
  }
  for (int j = done - kAtOnce; j >= 0; j -= kAtOnce) {
    see_through_columns<L, kSideBySide>(root, runs, j, x);
  }
}

template <class L>
[[gnu::always_inline]] inline void see_all_through(ConstRowsView root, RowsView rows) {
  constexpr int kAtOnce = 4;
  for (int first = 0; first < rows.rows; first += kAtOnce) {
    const RowsView some{rows.row(first), rows.rows - first, rows.columns, rows.stride};
    with_constant<kAtOnce>(
        some.rows, [&](auto count) __attribute__((always_inline)) {
          constexpr std::size_t kRows = decltype(count)::value;
          see_through_together<L, kRows>(root, some);
        });
  }
}

/// What M measurements make of a root S, one column after the other (docs/mathematics.md, section 9). For the number x
/// of a row of S in that column and the row's sums b, and for each measurement: x ← x − c b, b ← b + e x with the x
/// before it; in the end x ← p x.
template <std::size_t M>
struct ByMeasurements {
  static constexpr int kNumbers = 2 * static_cast<int>(M) + 1;

  const double* by_columns;  ///< c, e, p of each
  double gain[M];            ///< with which b of each measurement goes into the correction

  [[nodiscard]] const double* c(int column) const {
    return by_columns + static_cast<std::ptrdiff_t>(column) * kNumbers;
  }
};

/// rows: the first M are the measurements as they are seen through S, unit noise, and right of them what they show.
template <std::size_t M>
ByMeasurements<M> by_measurements(RowsView rows, int columns, double* numbers) {
  ByMeasurements<M> by{numbers, {}};
  double variance[M];
  double inverse[M];
  std::fill_n(variance, M, 1.0);
  std::fill_n(inverse, M, 1.0);
  double sums[M][M] = {};  // b of each measurement itself, which is a row like those of S
  for (int j = 0; j < columns; ++j) {
    double* const c = numbers;
    double* const e = numbers + M;
    double square = 1;
    for (std::size_t m = 0; m < M; ++m) {
      double x = rows(static_cast<int>(m), j);
      for (std::size_t i = 0; i < m; ++i) {
        const double before = x;
        x -= c[i] * sums[m][i];
        sums[m][i] += e[i] * before;
      }
      c[m] = x * inverse[m];
      e[m] = square * x;
      const double before = variance[m];
      variance[m] += e[m] * x;
      inverse[m] = 1 / variance[m];
      square *= before * inverse[m];
    }
    numbers[2 * M] = std::sqrt(square);
    numbers += ByMeasurements<M>::kNumbers;
  }
  for (std::size_t m = 0; m < M; ++m) {
    double rest = rows(static_cast<int>(m), columns);
    for (std::size_t i = 0; i < m; ++i) {
      rest -= sums[m][i] * by.gain[i];
    }
    by.gain[m] = rest * inverse[m];
  }
  return by;
}

[[gnu::always_inline]] inline void gather(RowsView root, int row, int column, double& its) { its = root(row, column); }
[[gnu::always_inline]] inline void gather(RowsView root, int row, int column, Lanes& its) {
  its = Lanes{root(row, column), root(row + 1, column)};
}
[[gnu::always_inline]] inline void gather(RowsView root, int row, int column, Lanes4& its) {
  its = Lanes4{root(row, column), root(row + 1, column), root(row + 2, column), root(row + 3, column)};
}
[[gnu::always_inline]] inline void scatter(const double& its, RowsView root, int row, int column) {
  root(row, column) = its;
}
template <class L>
[[gnu::always_inline]] inline void scatter(const L& its, RowsView root, int row, int column) {
  for (int i = 0; i < width<L>(); ++i) {
    root(row + i, column) = its[i];
  }
}
[[gnu::always_inline]] inline void add_to(double* sum, const double& its) { *sum += its; }
template <class L>
[[gnu::always_inline]] inline void add_to(double* sums, const L& its) {
  for (int i = 0; i < width<L>(); ++i) {
    sums[i] += its[i];
  }
}

/// So many rows of the root side by side: `Vectors` times as many as L has numbers.
template <class L, std::size_t Vectors, std::size_t M>
[[gnu::always_inline]] inline void update_rows(RowsView root, int first, const ByMeasurements<M>& by,
                                               double* correction) {
  L b[M][Vectors] = {};
  for (int j = first; j < root.columns; ++j) {
    const double* c = by.c(j);
    const double* e = c + M;
    L x[Vectors];
    for (std::size_t v = 0; v < Vectors; ++v) {
      gather(root, first + static_cast<int>(v) * width<L>(), j, x[v]);
    }
    for (std::size_t m = 0; m < M; ++m) {
      for (std::size_t v = 0; v < Vectors; ++v) {
        const L before = x[v];
        x[v] -= c[m] * b[m][v];
        b[m][v] += e[m] * before;
      }
    }
    for (std::size_t v = 0; v < Vectors; ++v) {
      const L its = e[M] * x[v];
      scatter(its, root, first + static_cast<int>(v) * width<L>(), j);
    }
  }
  for (std::size_t v = 0; v < Vectors; ++v) {
    for (std::size_t m = 0; m < M; ++m) {
      const L its = by.gain[m] * b[m][v];
      add_to(correction + first + static_cast<int>(v) * width<L>(), its);
    }
  }
}

template <class L, std::size_t Vectors, std::size_t M>
[[gnu::always_inline]] inline void update_all_rows(RowsView root, const ByMeasurements<M>& by, double* correction) {
  constexpr int kAtOnce = static_cast<int>(Vectors) * width<L>();
  const int whole = root.rows / kAtOnce * kAtOnce;
  const int even = root.rows / 2 * 2;
  for (int first = 0; first < whole; first += kAtOnce) {
    update_rows<L, Vectors>(root, first, by, correction);
  }
  for (int first = whole; first < even; first += 2) {
    update_rows<Lanes, 1>(root, first, by, correction);
  }
  if (even < root.rows) {
    update_rows<double, 1>(root, even, by, correction);
  }
}

/// Adds the products of a row with so many others. Each is the sum of four sums, that of each fourth product: as many
/// side by side as L has numbers.
template <class L, std::size_t Rows>
[[gnu::always_inline]] inline void add_products(const double* row, ConstRowsView others, double* products) {
  constexpr int kSums = 4;
  constexpr auto kVectors = static_cast<std::size_t>(kSums / width<L>());
  L sums[Rows][kVectors] = {};
  const double* other[Rows];
  for (std::size_t i = 0; i < Rows; ++i) {
    other[i] = others.row(static_cast<int>(i));
  }
  const int whole = others.columns / kSums * kSums;
  for (int k = 0; k < whole; k += kSums) {
    for (std::size_t v = 0; v < kVectors; ++v) {
      const int at = k + static_cast<int>(v) * width<L>();
      L its;
      get(row + at, its);
      for (std::size_t i = 0; i < Rows; ++i) {
        L one;
        get(other[i] + at, one);
        sums[i][v] += its * one;
      }
    }
  }
  for (std::size_t i = 0; i < Rows; ++i) {
    double sum[kSums] = {};
    for (std::size_t v = 0; v < kVectors; ++v) {
      put(sums[i][v], sum + static_cast<int>(v) * width<L>());
    }
    for (int j = 0; whole + j < others.columns; ++j) {
      sum[j] += row[whole + j] * other[i][whole + j];
    }
    products[i] += (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
}

template <class L>
[[gnu::always_inline]] inline void add_all_squares(ConstRowsView rows, double* square, std::ptrdiff_t stride) {
  for (int i = 0; i < rows.rows; ++i) {
    for (int j = 0; j < i; j += 2) {
      add_products<L, 2>(rows.row(i), {rows.row(j), 2, rows.columns, rows.stride}, square + i * stride + j);
    }
    if (i % 2 == 0) {
      add_products<L, 1>(rows.row(i), {rows.row(i), 1, rows.columns, rows.stride}, square + i * stride + i);
    }
    for (int k = 0; k < i; ++k) {
      square[k * stride + i] = square[i * stride + k];
    }
  }
}

/// rest ← rest ± factors · b, for so many rows of b.
template <class L, bool kAdds, std::size_t Rows>
[[gnu::always_inline]] inline void combine_rows(const double* factors, std::ptrdiff_t stride, ConstRowsView b,
                                                double* rest) {
  double by[Rows];
  const double* row[Rows];
  for (std::size_t i = 0; i < Rows; ++i) {
    const int its = static_cast<int>(i);
    by[i] = kAdds ? -factors[its * stride] : factors[its * stride];  // x − (−f) y is x + f y to the bit
    row[i] = b.row(its);
  }
  for_columns<L>(
      0, b.columns, [&](auto left, int j) __attribute__((always_inline)) {
        get(rest + j, left);
        for (std::size_t i = 0; i < Rows; ++i) {
          decltype(left) its;
          get(row[i] + j, its);
          left -= by[i] * its;
        }
        put(left, rest + j);
      });
}

template <class L>
[[gnu::always_inline]] inline void take_off_all(const double* factors, std::ptrdiff_t stride, ConstRowsView b,
                                                double* rest) {
  const int together = b.rows - b.rows % 3;
  for (int k = 0; k < together; k += 3) {
    combine_rows<L, false, 3>(factors + k * stride, stride, {b.row(k), 3, b.columns, b.stride}, rest);
  }
  for (int k = together; k < b.rows; ++k) {
    combine_rows<L, false, 1>(factors + k * stride, stride, {b.row(k), 1, b.columns, b.stride}, rest);
  }
}

/// product ← product + a b, `b` with zeros below its diagonal where it is a `kTriangle`. Few rows of b at a time, for
/// all rows of a, so that those are read once.
template <class L, bool kTriangle>
[[gnu::always_inline]] inline void add_product(ConstRowsView a, ConstRowsView b, RowsView product) {
  const int together = b.rows - b.rows % 3;
  for (int k = 0; k < together; k += 3) {
    const int first = kTriangle ? k : 0;
    for (int i = 0; i < a.rows; ++i) {
      combine_rows<L, true, 3>(a.row(i) + k, 1, {b.row(k) + first, 3, b.columns - first, b.stride},
                               product.row(i) + first);
    }
  }
  for (int k = together; k < b.rows; ++k) {
    const int first = kTriangle ? k : 0;
    for (int i = 0; i < a.rows; ++i) {
      combine_rows<L, true, 1>(a.row(i) + k, 1, {b.row(k) + first, 1, b.columns - first, b.stride},
                               product.row(i) + first);
    }
  }
}

#ifdef __x86_64__
constexpr int kLongRow = 8;

[[nodiscard]] bool is_wide(int columns) {
  return columns >= kLongRow && static_cast<int>(__builtin_cpu_supports("avx2")) != 0;
}

[[gnu::target("avx2")]] void rotate_wide_into(RowsView root, RowsView extra, int eliminated) {
  rotate_all_into<Lanes4>(root, extra, eliminated);
}
[[gnu::target("avx2")]] void see_wide_through(ConstRowsView root, RowsView rows) {
  see_all_through<Lanes4>(root, rows);
}
[[gnu::target("avx2")]] void add_wide_square(ConstRowsView rows, double* square, std::ptrdiff_t stride) {
  add_all_squares<Lanes4>(rows, square, stride);
}
template <std::size_t M>
[[gnu::target("avx2")]] void update_wide(RowsView root, const ByMeasurements<M>& by, double* correction) {
  update_all_rows<Lanes4, 1>(root, by, correction);
}
[[gnu::target("avx2")]] void take_off_wide(const double* factors, std::ptrdiff_t stride, ConstRowsView b,
                                           double* rest) {
  take_off_all<Lanes4>(factors, stride, b, rest);
}
[[gnu::target("avx2")]] void add_wide_product(ConstRowsView a, ConstRowsView b, RowsView product) {
  add_product<Lanes4, false>(a, b, product);
}
[[gnu::target("avx2")]] void add_wide_product_of_triangle(ConstRowsView a, ConstRowsView b, RowsView product) {
  add_product<Lanes4, true>(a, b, product);
}
#endif

/// Takes the first M of the rows; the others become as they are seen through the root that is left, and what they show
/// what the correction leaves of it.
template <std::size_t M>
void take_together(RowsView root, RowsView rows, double* numbers, double* correction) {
  const ByMeasurements<M> by = by_measurements<M>(rows, root.columns, numbers);
  for (int i = static_cast<int>(M); i < rows.rows; ++i) {
    double shown = 0;
    update_rows<double, 1>({rows.row(i), 1, root.columns, rows.stride}, 0, by, &shown);
    rows(i, root.columns) -= shown;
  }
#ifdef __x86_64__
  if (is_wide(root.columns)) {
    update_wide<M>(root, by, correction);
    return;
  }
#endif
  update_all_rows<Lanes, kSideBySide>(root, by, correction);
}

}  // namespace

void rotate_into(RowsView root, RowsView extra, int eliminated) {
  TRIHEDRON_ASSERT(root.columns == extra.columns && eliminated <= root.rows && eliminated <= root.columns);
#ifdef __x86_64__
  if (is_wide(root.columns)) {
    rotate_wide_into(root, extra, eliminated);
    return;
  }
#endif
  rotate_all_into<Lanes>(root, extra, eliminated);
}

void triangularise(RowsView rows, int columns) {
  for (int j = 0; j < columns && j + 1 < rows.rows; ++j) {
    const int rest = rows.columns - j;
    int below = 0;
    for (int i = 1; i < rows.rows - j; ++i) {
      below = rows(j + i, j) != 0 ? i : below;
    }
    rotate_into({rows.row(j) + j, 1, rest, rows.stride}, {rows.row(j + 1) + j, below, rest, rows.stride}, 1);
  }
}

void see_through(ConstRowsView root, RowsView rows) {
#ifdef __x86_64__
  if (is_wide(root.rows)) {
    see_wide_through(root, rows);
    return;
  }
#endif
  see_all_through<Lanes>(root, rows);
}

void take_measurements(RowsView root, RowsView rows, double* numbers, double* correction) {
  std::fill_n(correction, root.rows, 0.0);
  for (int first = 0; first < rows.rows; first += kMeasurementsAtOnce) {
    const RowsView some{rows.row(first), rows.rows - first, rows.columns, rows.stride};
    with_constant<kMeasurementsAtOnce>(some.rows, [&](auto count) {
      constexpr std::size_t kRows = decltype(count)::value;
      take_together<kRows>(root, some, numbers, correction);
    });
  }
}

void add_square(ConstRowsView rows, double* square, std::ptrdiff_t stride) {
#ifdef __x86_64__
  if (is_wide(rows.columns)) {
    add_wide_square(rows, square, stride);
    return;
  }
#endif
  add_all_squares<Lanes>(rows, square, stride);
}

void multiply(ConstRowsView a, ConstRowsView b, RowsView product) {
  for (int i = 0; i < product.rows; ++i) {
    std::fill_n(product.row(i), product.columns, 0.0);
  }
#ifdef __x86_64__
  if (is_wide(b.columns)) {
    add_wide_product(a, b, product);
    return;
  }
#endif
  add_product<Lanes, false>(a, b, product);
}

void add_product_of_triangle(ConstRowsView a, ConstRowsView triangle, RowsView product) {
#ifdef __x86_64__
  if (is_wide(triangle.columns)) {
    add_wide_product_of_triangle(a, triangle, product);
    return;
  }
#endif
  add_product<Lanes, true>(a, triangle, product);
}

void take_off(const double* factors, std::ptrdiff_t stride, ConstRowsView b, double* rest) {
#ifdef __x86_64__
  if (is_wide(b.columns)) {
    take_off_wide(factors, stride, b, rest);
    return;
  }
#endif
  take_off_all<Lanes>(factors, stride, b, rest);
}

}  // namespace trihedron
