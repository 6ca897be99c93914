#include "trihedron/core/square_root_information.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>

#include "trihedron/core/assert.hpp"
#include "trihedron/core/lanes.hpp"

namespace trihedron {
namespace {

/// One Householder reflection of row `r` and M rows below each other, all columns from 1 on; v: the M entries of the
/// first column.
template <std::size_t M>
void reflect(double* __restrict r, double* const (&rows)[M], const double (&v)[M], double v0, double beta,
             int columns) {
  for (int k = 1; k + 1 < columns; k += 2) {
    const Lanes its = load2(r + k);
    Lanes below[M];
    Lanes s = v0 * its;
    for (std::size_t i = 0; i < M; ++i) {
      below[i] = load2(rows[i] + k);
      s += v[i] * below[i];
    }
    s *= beta;
    store2(its - v0 * s, r + k);
    for (std::size_t i = 0; i < M; ++i) {
      store2(below[i] - v[i] * s, rows[i] + k);
    }
  }
  if (columns % 2 == 0) {
    const int last = columns - 1;
    double s = v0 * r[last];
    for (std::size_t i = 0; i < M; ++i) {
      s += v[i] * rows[i][last];
    }
    s *= beta;
    r[last] -= v0 * s;
    for (std::size_t i = 0; i < M; ++i) {
      rows[i][last] -= v[i] * s;
    }
  }
}

template <std::size_t M>
void rotate_rows_into(RowsView root, RowsView extra, int eliminated) {
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
    reflect<M>(r, rows, v, v0, -1 / (alpha * v0), root.columns - j);
    *r = alpha;
    for (double* row : rows) {
      *row = 0;
    }
  }
}

}  // namespace

void rotate_into(RowsView root, RowsView extra, int eliminated) {
  TRIHEDRON_ASSERT(root.columns == extra.columns && eliminated <= root.rows && eliminated <= root.columns);
  constexpr int kAtOnce = 8;
  for (int first = 0; first < extra.rows; first += kAtOnce) {
    const RowsView some{extra.row(first), std::min(extra.rows - first, kAtOnce), extra.columns, extra.stride};
    switch (some.rows) {
      case 1:
        rotate_rows_into<1>(root, some, eliminated);
        break;
      case 2:
        rotate_rows_into<2>(root, some, eliminated);
        break;
      case 3:
        rotate_rows_into<3>(root, some, eliminated);
        break;
      case 4:
        rotate_rows_into<4>(root, some, eliminated);
        break;
      case 5:
        rotate_rows_into<5>(root, some, eliminated);
        break;
      case 6:
        rotate_rows_into<6>(root, some, eliminated);
        break;
      case 7:
        rotate_rows_into<7>(root, some, eliminated);
        break;
      default:
        rotate_rows_into<8>(root, some, eliminated);
        break;
    }
  }
}

void triangularise(RowsView rows, int columns) {
  for (int j = 0; j < columns && j + 1 < rows.rows; ++j) {
    const int rest = rows.columns - j;
    rotate_into({rows.row(j) + j, 1, rest, rows.stride}, {rows.row(j + 1) + j, rows.rows - j - 1, rest, rows.stride},
                1);
  }
}

namespace {

/// Of solve_rows(): P columns from j on, of M rows side by side, and what they take off all further columns.
template <std::size_t P, std::size_t M>
void solve_columns(ConstRowsView root, int j, double* const (&rows)[M]) {
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
  for (int k = P; k + 1 < columns; k += 2) {
    Lanes its[P];
    for (std::size_t p = 0; p < P; ++p) {
      its[p] = load2(R[p] + k);
    }
    for (std::size_t i = 0; i < M; ++i) {
      Lanes rest = load2(x[i] + k);
      for (std::size_t p = 0; p < P; ++p) {
        rest -= value[i][p] * its[p];
      }
      store2(rest, x[i] + k);
    }
  }
  const int last = columns - 1;
  for (std::size_t i = 0; (columns - static_cast<int>(P)) % 2 != 0 && i < M; ++i) {
    for (std::size_t p = 0; p < P; ++p) {
      x[i][last] -= value[i][p] * R[p][last];
    }
  }
}

/// solve_rows() of M rows, side by side, four columns at a time.
template <std::size_t M>
void solve_rows_together(ConstRowsView root, RowsView rows) {
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
    solve_columns<4>(root, j, x);
  }
  if (rest >= 2) {
    solve_columns<2>(root, j, x);
  }
  if (rest % 2 != 0) {
    solve_columns<1>(root, n - 1, x);
  }
}

/// take_off() of so many rows.
template <std::size_t Rows>
void take_off_rows(const double* factors, std::ptrdiff_t stride, ConstRowsView b, double* rest) {
  double by[Rows];
  const double* row[Rows];
  for (std::size_t i = 0; i < Rows; ++i) {
    const int its = static_cast<int>(i);
    by[i] = factors[its * stride];
    row[i] = b.row(its);
  }
  for (int j = 0; j + 1 < b.columns; j += 2) {
    Lanes left = load2(rest + j);
    for (std::size_t i = 0; i < Rows; ++i) {
      left -= by[i] * load2(row[i] + j);
    }
    store2(left, rest + j);
  }
  const int last = b.columns - 1;
  for (std::size_t i = 0; b.columns % 2 != 0 && i < Rows; ++i) {
    rest[last] -= by[i] * row[i][last];
  }
}

}  // namespace

void solve_rows(ConstRowsView root, RowsView rows) {
  constexpr int kAtOnce = 4;
  for (int first = 0; first < rows.rows; first += kAtOnce) {
    const RowsView some{rows.row(first), std::min(rows.rows - first, kAtOnce), rows.columns, rows.stride};
    switch (some.rows) {
      case 1:
        solve_rows_together<1>(root, some);
        break;
      case 2:
        solve_rows_together<2>(root, some);
        break;
      case 3:
        solve_rows_together<3>(root, some);
        break;
      default:
        solve_rows_together<4>(root, some);
        break;
    }
  }
}

void multiply(ConstRowsView a, ConstRowsView b, RowsView product) {
  for (int i = 0; i < product.rows; ++i) {
    double* __restrict row = product.row(i);
    std::fill(row, row + product.columns, 0.0);
    for (int k = 0; k < b.rows; ++k) {
      const double by = a(i, k);
      const double* __restrict its = b.row(k);
      for (int j = 0; j < product.columns; ++j) {
        row[j] += by * its[j];
      }
    }
  }
}

void take_off(const double* factors, std::ptrdiff_t stride, ConstRowsView b, double* rest) {
  const int together = b.rows - b.rows % 3;
  for (int k = 0; k < together; k += 3) {
    take_off_rows<3>(factors + k * stride, stride, {b.row(k), 3, b.columns, b.stride}, rest);
  }
  for (int k = together; k < b.rows; ++k) {
    take_off_rows<1>(factors + k * stride, stride, {b.row(k), 1, b.columns, b.stride}, rest);
  }
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
