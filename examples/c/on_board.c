/* The interface in C from end to end: memory, parameters, commands, samples and fixes, housekeeping, snapshots, a brown-out. Ends with 0 if the
 * calibration was adopted and the attitude is right. */

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "body.h"
#include "trihedron.h"

/* The union gives the bytes an alignment of at least 16; what is missing to TRIHEDRON_ALIGNMENT is room to move up. */
typedef union {
  long double alignment;
  unsigned char bytes[TRIHEDRON_SIZE_OF_2_GYROS + TRIHEDRON_ALIGNMENT];
} memory;

static memory first_memory;
static memory second_memory;
static unsigned char snapshots[TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS]; /* of a device that keeps it without power */

static const char* const kModes[] = {"standby",    "waiting for a fix", "aligning", "calibrating",
                                     "navigating", "degraded",          "failed"};

static trihedron_application* create(memory* its) {
  const uintptr_t address = (uintptr_t)its->bytes;
  const uintptr_t aligned = (address + TRIHEDRON_ALIGNMENT - 1) / TRIHEDRON_ALIGNMENT * TRIHEDRON_ALIGNMENT;
  return trihedron_create(its->bytes + (aligned - address), TRIHEDRON_SIZE_OF_2_GYROS, 2);
}

/** Flies from one second to another, prints each change of mode, and saves a snapshot each minute. */
static void fly(trihedron_application* its, int from_s, int to_s) {
  trihedron_housekeeping record;
  unsigned mode = 255;
  for (int i = 8 * from_s; i < 8 * to_s; ++i) {
    const double t_s = i / 8.0;
    const int64_t time_ns = (int64_t)i * 125000000;
    trihedron_gyro_sample sample;
    body_gyros(t_s, time_ns, &sample);
    trihedron_on_gyro(its, &sample);
    if (i % 24 == 0) {
      trihedron_star_fix fix;
      body_star_tracker(t_s, time_ns, &fix);
      trihedron_on_fix(its, &fix);
    }
    if (i % 480 == 0) {
      trihedron_save(its, snapshots, sizeof snapshots);
    }
    trihedron_get_housekeeping(its, &record);
    if (record.mode != mode) {
      mode = record.mode;
      printf("%6.1f s  %-18s faults %2u", t_s, kModes[mode], (unsigned)record.faults);
      if (record.predicted) {
        printf("  ready for %.0f min", record.ready_s / 60);
      }
      printf("\n");
    }
  }
}

int main(void) {
  if (trihedron_interface_version() != TRIHEDRON_INTERFACE_VERSION || trihedron_tables_version() != TRIHEDRON_TABLES_VERSION) {
    fprintf(stderr, "the library is of another version than its header\n");
    return 1;
  }
  trihedron_application* its = create(&first_memory);
  trihedron_parameters parameters;
  trihedron_default_parameters(2, &parameters);
  parameters.required_interval_ns = parameters.window_ns = (int64_t)20 * 60 * 1000000000; /* an example is short */
  uint32_t answer = trihedron_load_parameters(its, &parameters);
  if (answer != TRIHEDRON_ANSWER_ACCEPTED || trihedron_command(its, TRIHEDRON_COMMAND_START, 0) != TRIHEDRON_ANSWER_ACCEPTED) {
    fprintf(stderr, "refused: answer %u\n", (unsigned)answer);
    return 1;
  }
  fly(its, 0, 1500);

  printf("the power fails for 45 s\n");
  its = create(&second_memory);
  const uint64_t sequence = trihedron_restore(its, snapshots, sizeof snapshots, NULL);
  printf("snapshot %u restored\n", (unsigned)sequence);
  fly(its, 1545, 1800);

  trihedron_housekeeping record;
  trihedron_get_housekeeping(its, &record);
  double truth[4];
  body_attitude(1800 - 0.125, truth);
  const double error_rad = angle_between(truth, record.q_in_c);
  printf("attitude within %.1f arcsec of the truth\n", error_rad * 206264.8);
  const double sigma_rad = sqrt(record.sigma_rad[0] * record.sigma_rad[0] + record.sigma_rad[1] * record.sigma_rad[1] +
                                record.sigma_rad[2] * record.sigma_rad[2]);
  const int good = sequence != 0 && record.attitude_valid && record.mode == TRIHEDRON_MODE_NAVIGATING && record.gaps == 1 &&
                   error_rad < 5 * sigma_rad;
  printf("%s\n", good ? "good" : "not good");
  return good ? 0 : 1;
}
