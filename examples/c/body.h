#ifndef BODY_H
#define BODY_H
/* What the examples fly: a body in orbit that rolls, two gyros whose cases are misaligned by some arcminutes, and a star tracker. A program
 * for a satellite has its sensors here. */

#include "trihedron.h"

/** Attitude q_in_c, Hamilton, scalar last, `t_s` seconds after the start. */
void body_attitude(double t_s, double q_in_c[4]);

/** What sensors read then, with noise; `time_ns`: what their clock shows. */
void body_gyros(double t_s, int64_t time_ns, trihedron_gyro_sample* sample);
void body_star_tracker(double t_s, int64_t time_ns, trihedron_star_fix* fix);

/** Angle between two attitudes, rad. */
double angle_between(const double a[4], const double b[4]);

#endif
