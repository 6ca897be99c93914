#pragma once
/// Householder triangles by the vector instructions of the processor that runs. Wherever core's headers are included
/// Eigen's own use of them is switched off (ADR 13), and it makes the large triangles of a batch twice as fast.

namespace trihedron::ground {

/// Rotates rows so that in the first `columns` columns only an upper triangle remains, in place. What is below it there
/// is left without meaning. a: column-major, `rows` × `all_columns`, without gaps; columns ≤ all_columns.
void rotate_up(double* a, long rows, long all_columns, long columns);

/// The same for rows that are few and long, stored row by row; what is below the triangle becomes zero.
void rotate_rows_up(double* a, long rows, long all_columns, long columns);

}  // namespace trihedron::ground
