#include "trihedron/core/square_root_information.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <iterator>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/lanes.hpp"

// Long rows are worked on four numbers at a time where the processor can: the same operations in the same order for
// each number, so that the bits are the same. Rows of 26 states are too short to gain.

namespace trihedron {
namespace {

// What has the template parameter L is always inlined, also into the functions *_wide, which are compiled for AVX2.
// What is not inlined there is compiled for any processor.

using Lanes4 = double __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void get(const double* at, Lanes& lanes) { lanes = load2(at); }
[[gnu::always_inline]] inline void put(const Lanes& lanes, double* at) { store2(lanes, at); }
[[gnu::always_inline]] inline void get(const double* at, Lanes4& lanes) { std::memcpy(&lanes, at, sizeof lanes); }
[[gnu::always_inline]] inline void put(const Lanes4& lanes, double* at) { std::memcpy(at, &lanes, sizeof lanes); }

template <class L>
constexpr int width() {
  return static_cast<int>(sizeof(L) / sizeof(double));
}

/// Calls work() for the columns that are left behind the last lanes, fewer than these have.
template <class L, class Work>
[[gnu::always_inline]] inline void for_the_rest(int first, int columns, const Work& work) {
  constexpr int kMost = width<L>() - 1;
  for (int i = 0; i < kMost; ++i) {
    if (first + i < columns) {
      work(first + i);
    }
  }
}

/// One Householder reflection of row `r` and M rows below each other, all columns from 1 on; v: the M entries of the
/// first column.
template <class L, std::size_t M>
[[gnu::always_inline]] inline void reflect(double* __restrict r, double* const (&rows)[M], const double (&v)[M],
                                           double v0, double beta, int columns) {
  const int whole = 1 + (columns - 1) / width<L>() * width<L>();
  for (int k = 1; k < whole; k += width<L>()) {
    L its;
    get(r + k, its);
    L below[M];
    L s = v0 * its;
    for (std::size_t i = 0; i < M; ++i) {
      get(rows[i] + k, below[i]);
      s += v[i] * below[i];
    }
    s *= beta;
    put(its - v0 * s, r + k);
    for (std::size_t i = 0; i < M; ++i) {
      put(below[i] - v[i] * s, rows[i] + k);
    }
  }
  for_the_rest<L>(whole, columns, [&](int last) {
    double s = v0 * r[last];
    for (std::size_t i = 0; i < M; ++i) {
      s += v[i] * rows[i][last];
    }
    s *= beta;
    r[last] -= v0 * s;
    for (std::size_t i = 0; i < M; ++i) {
      rows[i][last] -= v[i] * s;
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
    const RowsView some{extra.row(first), std::min(extra.rows - first, kAtOnce), extra.columns, extra.stride};
    switch (some.rows) {
      case 1:
        rotate_rows_into<L, 1>(root, some, eliminated);
        break;
      case 2:
        rotate_rows_into<L, 2>(root, some, eliminated);
        break;
      case 3:
        rotate_rows_into<L, 3>(root, some, eliminated);
        break;
      case 4:
        rotate_rows_into<L, 4>(root, some, eliminated);
        break;
      case 5:
        rotate_rows_into<L, 5>(root, some, eliminated);
        break;
      case 6:
        rotate_rows_into<L, 6>(root, some, eliminated);
        break;
      case 7:
        rotate_rows_into<L, 7>(root, some, eliminated);
        break;
      default:
        rotate_rows_into<L, 8>(root, some, eliminated);
        break;
    }
  }
}

/// Of solve_rows(): P columns from j on, of M rows side by side, and what they take off all further columns.
template <class L, std::size_t P, std::size_t M>
[[gnu::always_inline]] inline void solve_columns(ConstRowsView root, int j, double* const (&rows)[M]) {
  const double* R[P];
  for (std::size_t p = 0; p < P; ++p) {
    R[p] = root.row(j + static_cast<int>(p)) + j;
  }
  double* x[M];
  double value[M][P];
  for (std::size_t i = 0; i < M; ++i) {
    x[i] = rows[i] + j;
    for (std::size_t p = 0; p < P; ++p) {
      double rest = x[i][p];
      for (std::size_t q = 0; q < p; ++q) {
        rest -= value[i][q] * R[q][p];
      }
      value[i][p] = x[i][p] = rest / R[p][p];
    }
  }
  const int columns = root.rows - j;
  constexpr int kFirst = P;
  const int whole = kFirst + (columns - kFirst) / width<L>() * width<L>();
  for (int k = kFirst; k < whole; k += width<L>()) {
    L its[P];
    for (std::size_t p = 0; p < P; ++p) {
      get(R[p] + k, its[p]);
    }
    for (std::size_t i = 0; i < M; ++i) {
      L rest;
      get(x[i] + k, rest);
      for (std::size_t p = 0; p < P; ++p) {
        rest -= value[i][p] * its[p];
      }
      put(rest, x[i] + k);
    }
  }
  for_the_rest<L>(whole, columns, [&](int last) {
    for (std::size_t i = 0; i < M; ++i) {
      for (std::size_t p = 0; p < P; ++p) {
        x[i][last] -= value[i][p] * R[p][last];
      }
    }
  });
}

/// solve_rows() of M rows, side by side, four columns at a time.
template <class L, std::size_t M>
[[gnu::always_inline]] inline void solve_rows_together(ConstRowsView root, RowsView rows) {
  double* x[M];
  for (std::size_t i = 0; i < M; ++i) {
    x[i] = rows.row(static_cast<int>(i));
  }
  const int n = root.rows;
  int j = 0;
  while (j < n && std::all_of(std::begin(x), std::end(x), [&](const double* row) { return row[j] == 0; })) {
    ++j;
  }
  const int rest = (n - j) % 4;
  for (; j + 3 < n; j += 4) {
    solve_columns<L, 4>(root, j, x);
  }
  if (rest >= 2) {
    solve_columns<L, 2>(root, j, x);
  }
  if (rest % 2 != 0) {
    solve_columns<L, 1>(root, n - 1, x);
  }
}

template <class L>
[[gnu::always_inline]] inline void solve_all_rows(ConstRowsView root, RowsView rows) {
  constexpr int kAtOnce = 4;
  for (int first = 0; first < rows.rows; first += kAtOnce) {
    const RowsView some{rows.row(first), std::min(rows.rows - first, kAtOnce), rows.columns, rows.stride};
    switch (some.rows) {
      case 1:
        solve_rows_together<L, 1>(root, some);
        break;
      case 2:
        solve_rows_together<L, 2>(root, some);
        break;
      case 3:
        solve_rows_together<L, 3>(root, some);
        break;
      default:
        solve_rows_together<L, 4>(root, some);
        break;
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
  const int whole = b.columns / width<L>() * width<L>();
  for (int j = 0; j < whole; j += width<L>()) {
    L left;
    get(rest + j, left);
    for (std::size_t i = 0; i < Rows; ++i) {
      L its;
      get(row[i] + j, its);
      left -= by[i] * its;
    }
    put(left, rest + j);
  }
  for_the_rest<L>(whole, b.columns, [&](int last) {
    for (std::size_t i = 0; i < Rows; ++i) {
      rest[last] -= by[i] * row[i][last];
    }
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

/// Of solve_column(): the rows `last`, last − 1, …, so many; what comes below is known. Side by side, since each sum is
/// a chain of operations that wait for one another.
template <std::size_t Rows>
void solve_column_up(ConstRowsView root, int last, double* x) {
  const int n = root.rows;
  const double* row[Rows];
  double rest[Rows];
  for (std::size_t i = 0; i < Rows; ++i) {
    row[i] = root.row(last - static_cast<int>(i));
    rest[i] = row[i][n];
  }
  for (int j = last + 1; j < n; ++j) {
    for (std::size_t i = 0; i < Rows; ++i) {
      rest[i] -= row[i][j] * x[j];
    }
  }
  for (std::size_t i = 0; i < Rows; ++i) {
    const int its = last - static_cast<int>(i);
    for (int j = last; j > its; --j) {
      rest[i] -= row[i][j] * x[j];
    }
    x[its] = rest[i] / row[i][its];
  }
}

#ifdef __x86_64__
constexpr int kLongRow = 48;

[[nodiscard]] bool is_wide(int columns) {
  return columns >= kLongRow && static_cast<int>(__builtin_cpu_supports("avx2")) != 0;
}

[[gnu::target("avx2")]] void rotate_wide_into(RowsView root, RowsView extra, int eliminated) {
  rotate_all_into<Lanes4>(root, extra, eliminated);
}
[[gnu::target("avx2")]] void solve_wide_rows(ConstRowsView root, RowsView rows) { solve_all_rows<Lanes4>(root, rows); }
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

void solve_rows(ConstRowsView root, RowsView rows) {
#ifdef __x86_64__
  if (is_wide(root.rows)) {
    solve_wide_rows(root, rows);
    return;
  }
#endif
  solve_all_rows<Lanes>(root, rows);
}

void solve_column(ConstRowsView root, double* x) {
  for (int last = root.rows - 1; last >= 3; last -= 4) {
    solve_column_up<4>(root, last, x);
  }
  for (int last = root.rows % 4 - 1; last >= 0; --last) {
    solve_column_up<1>(root, last, x);
  }
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

void invert_triangle(ConstRowsView root, RowsView inverse) {
  for (int i = 0; i < inverse.rows; ++i) {
    double* row = inverse.row(i);
    std::fill(row, row + root.rows, 0.0);
    row[i] = 1;
  }
  solve_rows(root, inverse);
}

}  // namespace trihedron
