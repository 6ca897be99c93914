/* A host in C: a cyclic executive at 8 Hz, or faster by a factor, that flies the application of trihedron.h.
 *
 *   executive [--duration SECONDS] [--speed FACTOR] [--telemetry PORT] [--command PORT] [--snapshots FILE]
 *
 * A POSIX timer starts each cycle; cycles that begin late are counted. Memory is locked and the priority raised where the system allows it.
 * Once a second (of the flight) a housekeeping record goes by UDP to 127.0.0.1:TELEMETRY as it is in memory. A datagram to 127.0.0.1:COMMAND
 * holds two uint32_t, command and argument, and is answered to its sender with the uint32_t answer; the answer to UINT32_MAX is the number of
 * cycles, and the executive ends. With a file of snapshots it goes on from the newest whole one, and saves one each second. */

#define _POSIX_C_SOURCE 200809L

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "body.h"
#include "trihedron.h"

enum { kCyclesPerSecond = 8, kCyclesPerFix = 24 };
static const int64_t kCycle_ns = 1000000000 / kCyclesPerSecond;

struct options {
  double duration_s;
  double speed;
  int telemetry_port;
  int command_port;
  const char* snapshots;
};

/** A number within limits, or the program ends with status 2. */
static double number(const char* text, double least, double most) {
  char* end = NULL;
  const double value = strtod(text, &end);
  if (end == text || *end != '\0' || !(value >= least && value <= most)) {
    fprintf(stderr, "executive: %s is not a number from %g to %g\n", text, least, most);
    exit(2);
  }
  return value;
}

static struct options parsed(int count, char** arguments) {
  struct options options = {1e9, 1, 0, 0, NULL};
  for (int i = 1; i < count; i += 2) {
    const char* name = arguments[i];
    const char* value = i + 1 < count ? arguments[i + 1] : "";
    if (strcmp(name, "--duration") == 0) {
      options.duration_s = number(value, 0, 1e9);
    } else if (strcmp(name, "--speed") == 0) {
      options.speed = number(value, 0.1, 1000);
    } else if (strcmp(name, "--telemetry") == 0) {
      options.telemetry_port = (int)number(value, 1, 65535);
    } else if (strcmp(name, "--command") == 0) {
      options.command_port = (int)number(value, 1, 65535);
    } else if (strcmp(name, "--snapshots") == 0) {
      options.snapshots = value;
    } else {
      fprintf(stderr, "executive: no option %s\n", name);
      exit(2);
    }
  }
  return options;
}

static void fail(const char* what) {
  fprintf(stderr, "executive: %s: %s\n", what, strerror(errno));
  exit(4);
}

static struct sockaddr_in loopback(int port) {
  struct sockaddr_in address;
  memset(&address, 0, sizeof address);
  address.sin_family = AF_INET;
  address.sin_port = htons((uint16_t)port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

/** A socket that does not wait, bound where there is a port. */
static int datagrams(int port) {
  const int its = socket(AF_INET, SOCK_DGRAM, 0);
  const struct sockaddr_in address = loopback(port);
  if (its < 0 || fcntl(its, F_SETFL, O_NONBLOCK) != 0 || bind(its, (const struct sockaddr*)&address, sizeof address) != 0) {
    fail("socket");
  }
  return its;
}

/** Snapshots in a file that outlives the program; in plain memory where there is none. */
static void* snapshot_memory(const char* path) {
  static unsigned char plain[TRIHEDRON_SNAPSHOTS_SIZE_OF_2_GYROS];
  if (path == NULL) {
    return plain;
  }
  const int file = open(path, O_RDWR | O_CREAT, 0600);
  if (file < 0 || ftruncate(file, (off_t)sizeof plain) != 0) {
    fail(path);
  }
  void* memory = mmap(NULL, sizeof plain, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (memory == MAP_FAILED) {
    fail("mmap");
  }
  return memory;
}

static void real_time(void) {
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    printf("memory is not locked: %s\n", strerror(errno));
  }
  struct sched_param priority;
  memset(&priority, 0, sizeof priority);
  priority.sched_priority = sched_get_priority_min(SCHED_FIFO);
  if (sched_setscheduler(0, SCHED_FIFO, &priority) != 0) {
    printf("priority is not raised: %s\n", strerror(errno));
  }
}

/** Signals of a timer, one for each cycle. */
static timer_t started_timer(double speed, sigset_t* tick) {
  sigemptyset(tick);
  sigaddset(tick, SIGRTMIN);
  sigprocmask(SIG_BLOCK, tick, NULL);
  struct sigevent event;
  memset(&event, 0, sizeof event);
  event.sigev_notify = SIGEV_SIGNAL;
  event.sigev_signo = SIGRTMIN;
  timer_t timer;
  if (timer_create(CLOCK_MONOTONIC, &event, &timer) != 0) {
    fail("timer");
  }
  struct itimerspec interval;
  memset(&interval, 0, sizeof interval);
  const int64_t period_ns = (int64_t)((double)kCycle_ns / speed);
  interval.it_interval.tv_sec = (time_t)(period_ns / 1000000000);
  interval.it_interval.tv_nsec = (long)(period_ns % 1000000000);
  interval.it_value = interval.it_interval;
  if (timer_settime(timer, 0, &interval, NULL) != 0) {
    fail("timer");
  }
  return timer;
}

/** Answers all commands that have come; 1: one of them was to end. */
static int obey(trihedron_application* its, int commands, uint32_t cycles) {
  uint32_t request[2];
  struct sockaddr_in sender;
  socklen_t size = sizeof sender;
  int end = 0;
  for (;;) {
    const ssize_t length = recvfrom(commands, request, sizeof request, 0, (struct sockaddr*)&sender, &size);
    if (length < 0) {
      return end;
    }
    if (length != sizeof request) {
      continue;
    }
    end = end || request[0] == UINT32_MAX;
    const uint32_t answer = end ? cycles : trihedron_command(its, request[0], request[1]);
    sendto(commands, &answer, sizeof answer, 0, (const struct sockaddr*)&sender, size);
  }
}

int main(int count, char** arguments) {
  const struct options options = parsed(count, arguments);
  const int telemetry = datagrams(0);
  const int commands = datagrams(options.command_port);
  const struct sockaddr_in ground = loopback(options.telemetry_port);
  void* snapshots = snapshot_memory(options.snapshots);

  static union {
    long double alignment;
    unsigned char bytes[TRIHEDRON_SIZE_OF_2_GYROS + TRIHEDRON_ALIGNMENT];
  } memory;
  const uintptr_t address = (uintptr_t)memory.bytes;
  trihedron_application* its =
      trihedron_create(memory.bytes + (TRIHEDRON_ALIGNMENT - address % TRIHEDRON_ALIGNMENT), TRIHEDRON_SIZE_OF_2_GYROS, 2);
  trihedron_housekeeping record;
  int64_t first = 0; /* cycle of the flight */
  const uint64_t sequence = trihedron_restore(its, snapshots, trihedron_snapshots_size(2), NULL);
  if (sequence != 0) {
    trihedron_get_housekeeping(its, &record);
    first = record.time_ns / kCycle_ns + 1;
    printf("goes on from snapshot %llu\n", (unsigned long long)sequence);
  } else {
    trihedron_parameters parameters;
    trihedron_default_parameters(2, &parameters);
    if (trihedron_load_parameters(its, &parameters) != TRIHEDRON_ANSWER_ACCEPTED) {
      return 1;
    }
  }

  real_time();
  sigset_t tick;
  const timer_t timer = started_timer(options.speed, &tick);
  const int64_t end = first + (int64_t)(options.duration_s * kCyclesPerSecond);
  uint32_t cycles = 0;
  uint32_t missed = 0;
  for (int64_t i = first; i < end; ++i) {
    int signal = 0;
    sigwait(&tick, &signal);
    missed += (uint32_t)timer_getoverrun(timer);
    const double t_s = (double)i / kCyclesPerSecond;
    trihedron_gyro_sample sample;
    body_gyros(t_s, i * kCycle_ns, &sample);
    trihedron_on_gyro(its, &sample);
    if (i % kCyclesPerFix == 0) {
      trihedron_star_fix fix;
      body_star_tracker(t_s, i * kCycle_ns, &fix);
      trihedron_on_fix(its, &fix);
    }
    ++cycles;
    if (i % kCyclesPerSecond == 0) {
      trihedron_get_housekeeping(its, &record);
      if (options.telemetry_port != 0) {
        sendto(telemetry, &record, sizeof record, 0, (const struct sockaddr*)&ground, sizeof ground);
      }
      trihedron_save(its, snapshots, trihedron_snapshots_size(2));
    }
    if (obey(its, commands, cycles)) {
      break;
    }
  }
  printf("%u cycles, %u deadlines missed\n", (unsigned)cycles, (unsigned)missed);
  return 0;
}
