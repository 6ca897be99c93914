/* Flies the application of trihedron.h through records of a file, as `trihedron replay PASS --records RECORDS` writes them, and writes its
 * attitude at each sample used: a table of parameters, and then samples and fixes in the order in which a spacecraft has them.
 *
 *   replayed RECORDS ATTITUDES
 *
 * Each record follows a uint64_t with its kind. ATTITUDES are records trihedron_attitude. A bench of a flight computer does the same. */

#include <stdio.h>
#include <stdlib.h>

#include "trihedron.h"

enum kind { kParameters = 0, kSample = 1, kFix = 2 };

static union {
  long double alignment;
  unsigned char bytes[TRIHEDRON_SIZE_OF_3_GYROS + TRIHEDRON_ALIGNMENT];
} memory;

static void fail(const char* what, const char* name, int status) {
  fprintf(stderr, "replayed: %s: %s\n", name, what);
  exit(status);
}

static FILE* opened(const char* name, const char* mode, int status) {
  FILE* file = fopen(name, mode);
  if (file == NULL) {
    fail("cannot be opened", name, status);
  }
  return file;
}

static void take(FILE* file, void* record, size_t size, const char* name) {
  if (fread(record, size, 1, file) != 1) {
    fail("breaks off", name, 3);
  }
}

static trihedron_application* started(const trihedron_parameters* parameters, const char* name) {
  const uintptr_t address = (uintptr_t)memory.bytes;
  const uintptr_t aligned = (address + TRIHEDRON_ALIGNMENT - 1) / TRIHEDRON_ALIGNMENT * TRIHEDRON_ALIGNMENT;
  trihedron_application* its = trihedron_create(memory.bytes + (aligned - address), TRIHEDRON_SIZE_OF_3_GYROS, parameters->gyros);
  if (its == NULL || trihedron_load_parameters(its, parameters) != TRIHEDRON_ANSWER_ACCEPTED ||
      trihedron_command(its, TRIHEDRON_COMMAND_START, 0) != TRIHEDRON_ANSWER_ACCEPTED) {
    fail("its parameters are refused", name, 3);
  }
  return its;
}

int main(int count, char** arguments) {
  if (count != 3) {
    fprintf(stderr, "usage: replayed RECORDS ATTITUDES\n");
    return 2;
  }
  const char* name = arguments[1];
  FILE* records = opened(name, "rb", 3);
  FILE* attitudes = opened(arguments[2], "wb", 4);
  trihedron_application* its = NULL;
  uint64_t kind = 0;
  while (fread(&kind, sizeof kind, 1, records) == 1) {
    if ((its == NULL) != (kind == kParameters) || kind > kFix) {
      fail("is no file of records", name, 3);
    }
    if (kind == kParameters) {
      static trihedron_parameters parameters;
      take(records, &parameters, sizeof parameters, name);
      its = started(&parameters, name);
    } else if (kind == kFix) {
      trihedron_star_fix fix;
      take(records, &fix, sizeof fix, name);
      trihedron_on_fix(its, &fix);
    } else {
      trihedron_gyro_sample sample;
      struct trihedron_attitude attitude;
      take(records, &sample, sizeof sample, name);
      if (trihedron_on_gyro(its, &sample) == TRIHEDRON_SAMPLE_USED && trihedron_get_attitude(its, &attitude) == 1 &&
          fwrite(&attitude, sizeof attitude, 1, attitudes) != 1) {
        fail("cannot be written", arguments[2], 4);
      }
    }
  }
  fclose(records);
  if (its == NULL) {
    fail("is no file of records", name, 3);
  }
  if (fclose(attitudes) != 0) {
    fail("cannot be written", arguments[2], 4);
  }
  return 0;
}
