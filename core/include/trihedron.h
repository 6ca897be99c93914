#ifndef TRIHEDRON_H
#define TRIHEDRON_H
/**
 * The on-board application in C99. It allocates nothing, has no global state, and calls nothing of the system: the caller
 * owns the memory, feeds samples and fixes in time order, and asks. One object is used by one thread at a time. No pointer
 * may be null unless it says so.
 * docs/flight-interface.md describes records and numbers.
 */

#include <stddef.h>
#include <stdint.h>

#include "trihedron_tables.h"

#ifdef __cplusplus
extern "C" {
#endif

/* C has no `using`, and constants are to be known to the preprocessor. NOLINTBEGIN(modernize-*) */

/** Of the functions; of the records there is TRIHEDRON_TABLES_VERSION. */
#define TRIHEDRON_INTERFACE_VERSION 2u
/** As compiled into the library; to be compared with TRIHEDRON_INTERFACE_VERSION and TRIHEDRON_TABLES_VERSION. */
uint32_t trihedron_interface_version(void);
/** The same of the tables. */
uint32_t trihedron_tables_version(void);

/** Memory that is enough for an object of two gyros, bytes. */
#define TRIHEDRON_SIZE_OF_2_GYROS 32768u
/** Of three gyros. */
#define TRIHEDRON_SIZE_OF_3_GYROS 61440u
/** Memory that is enough for the snapshots of two gyros, bytes. */
#define TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS 65664u
/** Of three gyros. */
#define TRIHEDRON_SNAPSHOTS_SIZE_OF_3_GYROS 122944u
/** Alignment that is enough for an object, bytes. */
#define TRIHEDRON_ALIGNMENT 32u

/** What an object needs exactly, bytes; 0 for a number of gyros that there is nothing for. */
size_t trihedron_size(uint32_t gyros);
/** The alignment that it needs, bytes. */
size_t trihedron_alignment(void);
/** What its snapshots need, bytes, at any alignment; 0 as above. */
size_t trihedron_snapshots_size(uint32_t gyros);

/** The object, in the caller's memory. It has no pointers and may be moved as bytes between two calls. */
typedef struct trihedron_application trihedron_application;

/**
 * Makes an object with room for `gyros` gyros in standby, without parameters. Null where the memory is null, too small or
 * not aligned, or `gyros` is neither 2 nor 3. Nothing is to be done to end its life.
 */
trihedron_application* trihedron_create(void* memory, size_t size, uint32_t gyros);

/** Parameters of so many gyros with the usual noise and priors, to be changed as needed. */
void trihedron_default_parameters(uint32_t gyros, trihedron_parameters* parameters);

/** Command load_parameters: of `trihedron_answer`. Nothing is changed where it is refused. */
uint32_t trihedron_load_parameters(trihedron_application* its, const trihedron_parameters* parameters);

/** Any other command, of `trihedron_command`; `argument` as the command says. Returns of `trihedron_answer`. */
uint32_t trihedron_command(trihedron_application* its, uint32_t command, uint32_t argument);

/** One gyro sample: of `trihedron_sample`. To be called at each of them; a part of the work of a fix is done in it. */
uint32_t trihedron_on_gyro(trihedron_application* its, const trihedron_gyro_sample* sample);

/**
 * One fix. It waits for the gyro samples before and after its time; what was done with it then stands in `last_fix` of the
 * housekeeping record. Returns a value of `trihedron_fix`: usually that it waits; where fixes come faster than they are
 * dealt with, what was done with an earlier one. A fix whose time is more than 1.4 s before that of the latest sample comes too
 * late, since the samples of its time are gone: rejected_out_of_order.
 */
uint32_t trihedron_on_fix(trihedron_application* its, const trihedron_star_fix* fix);

/** The attitude at the latest sample. 1, or 0 where there is none, and nothing is written. */
uint32_t trihedron_get_attitude(const trihedron_application* its, trihedron_attitude* attitude);

/**
 * What the filter has found. 1; or 0 before the first fix, and between the two calls in which a fix is taken in, and nothing is written: to be asked
 * again after the next sample. Some ten thousand operations, and 6 KB of stack for two gyros, 13 KB for three.
 */
uint32_t trihedron_get_calibration(const trihedron_application* its, trihedron_calibration* calibration);

/** What the application tells of itself, in any mode. */
void trihedron_get_housekeeping(const trihedron_application* its, trihedron_housekeeping* housekeeping);

/** Writes a snapshot into one of two slots in `memory`; its sequence number, or 0 where the memory is too small. */
uint64_t trihedron_save(const trihedron_application* its, void* memory, size_t size);

/**
 * Restores the newest whole snapshot into an object that has been created. Its sequence number, or 0 where there is none
 * and nothing is changed. `slots`, where it is not null: two of `trihedron_snapshot`, what each slot held.
 */
uint64_t trihedron_restore(trihedron_application* its, const void* memory, size_t size, uint32_t slots[2]);

/* NOLINTEND(modernize-*) */

#ifdef __cplusplus
}
#endif

#endif
