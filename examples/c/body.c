#include "body.h"

#include <math.h>
#include <string.h>

static const double kGyroNoise_rad = 9.7e-6;
static const double kStarTrackerNoise_rad[3] = {1.45e-5, 1.45e-5, 9.7e-5};
static const double kMomentum[2][3] = {{0.5085, 0.5882, 0.6281}, {-0.7207, 0.4905, 0.4905}};
static const double kMisalignment_rad[2][3] = {{2.4e-3, -4.2e-3, -7.3e-3}, {4.0e-3, -2.0e-3, -7.5e-3}};

/* Normal numbers with a fixed seed: two uniform ones of a linear congruential generator (Knuth's MMIX), by Box and Muller. */
static double uniform(void) {
  static uint64_t state = 1;
  state = state * 6364136223846793005u + 1442695040888963407u;
  return ((double)(state >> 11) + 0.5) / 9007199254740992.0;
}
static double normal(void) { return sqrt(-2 * log(uniform())) * cos(6.283185307179586 * uniform()); }

/** exp of a rotation vector. */
static void turn(const double v[3], double q[4]) {
  const double angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  const double factor = angle > 0 ? sin(angle / 2) / angle : 0.5;
  for (int i = 0; i < 3; ++i) {
    q[i] = factor * v[i];
  }
  q[3] = cos(angle / 2);
}

static void multiply(const double a[4], const double b[4], double product[4]) {
  const double p[4] = {a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1], a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
                       a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3], a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
  memcpy(product, p, sizeof p);
}

/** q* v q: components of a vector before the rotation. */
static void back(const double q[4], const double v[3], double rotated[3]) {
  const double inverse[4] = {-q[0], -q[1], -q[2], q[3]};
  const double vector[4] = {v[0], v[1], v[2], 0};
  double product[4];
  multiply(inverse, vector, product);
  multiply(product, q, product);
  memcpy(rotated, product, 3 * sizeof(double));
}

void body_attitude(double t_s, double q_in_c[4]) {
  const double orbit[3] = {0, 1.1e-3 * t_s, 0};
  const double roll[3] = {0.5 * sin(t_s / 97), 0, 0};
  double by_roll[4];
  turn(orbit, q_in_c);
  turn(roll, by_roll);
  multiply(q_in_c, by_roll, q_in_c);
}

void body_gyros(double t_s, int64_t time_ns, trihedron_gyro_sample* sample) {
  double q_in_c[4];
  body_attitude(t_s, q_in_c);
  memset(sample, 0, sizeof *sample);
  sample->time_ns = time_ns;
  for (int k = 0; k < 2; ++k) {
    double q_c_b[4];
    double h_c[3];
    turn(kMisalignment_rad[k], q_c_b);
    back(q_in_c, kMomentum[k], h_c);
    back(q_c_b, h_c, sample->h_b[k]);
    for (int i = 0; i < 3; ++i) {
      sample->h_b[k][i] += kGyroNoise_rad * normal();
    }
  }
}

void body_star_tracker(double t_s, int64_t time_ns, trihedron_star_fix* fix) {
  double error[3];
  double by_error[4];
  for (int i = 0; i < 3; ++i) {
    error[i] = kStarTrackerNoise_rad[i] * normal();
  }
  turn(error, by_error);
  fix->time_ns = time_ns;
  body_attitude(t_s, fix->q_in_c);
  multiply(fix->q_in_c, by_error, fix->q_in_c);
}

double angle_between(const double a[4], const double b[4]) {
  const double inverse[4] = {-a[0], -a[1], -a[2], a[3]};
  double difference[4];
  multiply(inverse, b, difference);
  const double sine = sqrt(difference[0] * difference[0] + difference[1] * difference[1] + difference[2] * difference[2]);
  return 2 * atan2(sine, fabs(difference[3]));
}
