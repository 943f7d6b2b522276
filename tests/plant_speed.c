/* Drives the plant's library through the C interface as fast as it goes, on the general track at steps of 1 ms.
 *
 *   plant_speed LIBRARY GUID ROAD KAPPA SPEED DELTA A_X V_X E_Y E_PSI
 *
 * (the last eight are value references). Every step reads five values, steers by them and writes two commands. Prints the
 * best time that one simulated second took [s]. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

typedef void *component;
typedef struct {
  void (*logger)(void *, const char *, int, const char *, const char *, ...);
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void *step_finished, *environment;
} callbacks;

static void logger(void *environment, const char *name, int status, const char *category, const char *message, ...) {
  (void)environment, (void)name, (void)status;
  fprintf(stderr, "%s: %s\n", category, message);
}

static void *library;
#define LOAD(result, name, arguments) result(*name) arguments = (result(*) arguments)dlsym(library, #name)
#define CHECK(call) do { if ((call) > 1) { fprintf(stderr, "%s failed\n", #call); return 1; } } while (0)

int main(int count, char **words) {
  if (count != 11 || !(library = dlopen(words[1], RTLD_NOW))) return fprintf(stderr, "no library\n"), 1;
  LOAD(component, fmi2Instantiate, (const char *, int, const char *, const char *, const callbacks *, int, int));
  LOAD(int, fmi2SetupExperiment, (component, int, double, double, int, double));
  LOAD(int, fmi2EnterInitializationMode, (component));
  LOAD(int, fmi2ExitInitializationMode, (component));
  LOAD(int, fmi2DoStep, (component, double, double, int));
  LOAD(int, fmi2GetReal, (component, const unsigned *, size_t, double *));
  LOAD(int, fmi2SetReal, (component, const unsigned *, size_t, const double *));
  LOAD(int, fmi2SetString, (component, const unsigned *, size_t, const char *const *));
  LOAD(void, fmi2FreeInstance, (component));

  unsigned reference[8];
  for (int i = 0; i < 8; i++) reference[i] = (unsigned)atoi(words[3 + i]);
  const unsigned *road = reference, *ahead = reference + 1, *commands = reference + 3, *measured = reference + 5;
  callbacks services = {logger, calloc, free, NULL, NULL};
  component plant = fmi2Instantiate("speed", 1, words[2], NULL, &services, 0, 0);
  if (!plant) return 1;
  const char *name = "general";
  CHECK(fmi2SetString(plant, road, 1, &name));
  CHECK(fmi2SetupExperiment(plant, 0, 0.0, 0.0, 0, 0.0));
  CHECK(fmi2EnterInitializationMode(plant));
  CHECK(fmi2ExitInitializationMode(plant));

  double best = 1e9, time = 0.0, wanted[2], seen[3];
  for (int second = 0; second < 120; second++) {
    struct timespec from, to;
    clock_gettime(CLOCK_MONOTONIC, &from);
    for (int step = 0; step < 1000; step++) {
      /* The preview is computed when it is asked for: at every sample time of 33 ms, as a controller does. */
      if (step % 33 == 0) CHECK(fmi2GetReal(plant, ahead, 2, wanted));
      CHECK(fmi2GetReal(plant, measured, 3, seen));
      double command[2] = {2.8 * wanted[0] - 0.1 * seen[1] - 0.6 * seen[2], 2.0 * (wanted[1] - seen[0])};
      CHECK(fmi2SetReal(plant, commands, 2, command));
      CHECK(fmi2DoStep(plant, time, 1e-3, 1));
      time += 1e-3;
    }
    clock_gettime(CLOCK_MONOTONIC, &to);
    double taken = (double)(to.tv_sec - from.tv_sec) + 1e-9 * (double)(to.tv_nsec - from.tv_nsec);
    if (taken < best) best = taken;
  }
  fmi2FreeInstance(plant);
  printf("%.9f %.6f\n", best, seen[1]);
  return 0;
}
