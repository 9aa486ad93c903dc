// Runs 32 calls of a kernel as the threads of a GPU's warp, for tests without a GPU.
//
// Each call has a stack of its own. A call runs until it exchanges a value with the others; then the next one runs. The
// values of an exchange are complete when the first call runs again. All threads must reach the same exchanges in the
// same order, as on a GPU: `run_warp` returns the number of exchanges, or -1 if the threads reach different ones.
#define _GNU_SOURCE
#include <stdlib.h>
#include <string.h>
#include <ucontext.h>
#define THREADS 32
#define STACK (4 << 20)

typedef void (*Kernel)(void*, void*);
static ucontext_t home, threads[THREADS];
static char* stacks[THREADS];
static double values[2][THREADS]; // of the present exchange and of the last one
static int places[2][THREADS];    // in the program
static long exchanges[THREADS];
static int ended[THREADS], present;
static int is_different;
static Kernel kernel;
static void **all_bounds, **all_arguments;

static void run_next(void) {
  const int before = present;
  for (int distance = 1; distance <= THREADS; distance++) {
    const int next = (before + distance) % THREADS;
    if (ended[next]) continue;
    present = next;
    if (next != before) swapcontext(&threads[before], &threads[next]);
    return;
  }
}

double* exchange(double value, int place) {
  const int own = present, side = exchanges[own] & 1;
  const long number = ++exchanges[own];
  values[side][own] = value;
  places[side][own] = place;
  run_next();
  for (int other = 0; other < THREADS; other++)
    if (exchanges[other] < number || (exchanges[other] == number && places[side][other] != place)) {
      is_different = 1;
      setcontext(&home);
    }
  return values[side];
}

int thread_of_warp(void) { return present; }

static void start(void) {
  const int own = present;
  kernel(all_bounds[own], all_arguments[own]);
  ended[own] = 1;
  for (int distance = 1; distance < THREADS; distance++) {
    const int next = (own + distance) % THREADS;
    if (ended[next]) continue;
    present = next;
    setcontext(&threads[next]);
  }
  setcontext(&home);
}

long run_warp(void* function, void** bounds, void** arguments) {
  kernel = (Kernel)function;
  all_bounds = bounds;
  all_arguments = arguments;
  is_different = 0;
  memset(exchanges, 0, sizeof exchanges);
  memset(ended, 0, sizeof ended);
  for (int thread = 0; thread < THREADS; thread++) {
    if (!stacks[thread]) stacks[thread] = malloc(STACK);
    getcontext(&threads[thread]);
    threads[thread].uc_stack.ss_sp = stacks[thread];
    threads[thread].uc_stack.ss_size = STACK;
    threads[thread].uc_link = &home;
    makecontext(&threads[thread], start, 0);
  }
  present = 0;
  swapcontext(&home, &threads[0]);
  return is_different ? -1 : exchanges[0];
}
