/* Drives the lane change: the controller FMU steers the plant FMU, wired by equal names.
 *
 *   closed_loop UNPACKED_PLANT UNPACKED_CONTROLLER
 *
 * Declares the few types and functions of FMI 2.0 that it uses, so that no header is needed. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <limits.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *component;
typedef struct {
  void (*logger)(void *, const char *, int, const char *, const char *, ...);
  void *(*allocate)(size_t, size_t);
  void (*release)(void *);
  void (*step_finished)(void *, int);
  void *environment;
} callbacks;

typedef struct {
  char *xml;
  component instance;
  int (*setup)(component, int, double, double, int, double);
  int (*enter)(component), (*leave)(component), (*terminate)(component);
  int (*get_real)(component, const unsigned *, size_t, double *);
  int (*set_real)(component, const unsigned *, size_t, const double *);
  int (*get_boolean)(component, const unsigned *, size_t, int *);
  int (*set_string)(component, const unsigned *, size_t, const char *const *);
  int (*step)(component, double, double, int);
  void (*release)(component);
} fmu;

static void die(const char *what, const char *which) {
  fprintf(stderr, "%s: %s\n", what, which);
  exit(1);
}

static void logger(void *environment, const char *name, int status, const char *category, const char *message, ...) {
  (void)environment, (void)status;
  fprintf(stderr, "%s, %s: %s\n", name, category, message);
}

/* 0 is fine, 1 a warning; everything else ends the program. */
static void check(int status, const char *call) {
  if (status > 1) die("failed", call);
}

static char *read_text(const char *path) {
  FILE *file = fopen(path, "rb");
  if (!file) die("cannot be read", path);
  fseek(file, 0, SEEK_END);
  size_t size = (size_t)ftell(file);
  rewind(file);
  char *text = calloc(size + 1, 1);
  if (!text || fread(text, 1, size, file) != size) die("cannot be read", path);
  fclose(file);
  return text;
}

/* Value of the first attribute of this name at or behind a place. */
static void attribute(const char *from, const char *name, char *value, size_t size) {
  char key[128];
  snprintf(key, sizeof key, " %s=\"", name);
  const char *begin = strstr(from, key);
  if (!begin) die("no such attribute", name);
  begin += strlen(key);
  size_t length = strcspn(begin, "\"");
  if (length >= size) die("too long", name);
  memcpy(value, begin, length);
  value[length] = 0;
}

/* Where a variable stands in the model description, or NULL. */
static const char *variable(const fmu *f, const char *name) {
  char key[128];
  snprintf(key, sizeof key, "<ScalarVariable name=\"%s\"", name);
  return strstr(f->xml, key);
}

static unsigned reference(const fmu *f, const char *name) {
  char value[32];
  const char *place = variable(f, name);
  if (!place) die("no such variable", name);
  attribute(place, "valueReference", value, sizeof value);
  return (unsigned)strtoul(value, NULL, 10);
}

static fmu load(const char *folder, const char *identifier) {
  static const callbacks services = {logger, calloc, free, NULL, NULL};
  char absolute[PATH_MAX], path[PATH_MAX + 64], guid[128];
  fmu f = {0};
  if (!realpath(folder, absolute)) die("no such folder", folder);
  snprintf(path, sizeof path, "%s/modelDescription.xml", absolute);
  f.xml = read_text(path);
  attribute(f.xml, "guid", guid, sizeof guid);

  snprintf(path, sizeof path, "%s/binaries/linux64/%s.so", absolute, identifier);
  void *library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
  if (!library) die("cannot be loaded", dlerror());
  component (*instantiate)(const char *, int, const char *, const char *, const callbacks *, int, int);
  /* The way of POSIX from an object pointer to a function pointer. */
#define FIND(target, name) if (!(*(void **)&(target) = dlsym(library, name))) die("not exported", name)
  FIND(instantiate, "fmi2Instantiate");
  FIND(f.setup, "fmi2SetupExperiment");
  FIND(f.enter, "fmi2EnterInitializationMode");
  FIND(f.leave, "fmi2ExitInitializationMode");
  FIND(f.terminate, "fmi2Terminate");
  FIND(f.get_real, "fmi2GetReal");
  FIND(f.set_real, "fmi2SetReal");
  FIND(f.get_boolean, "fmi2GetBoolean");
  FIND(f.set_string, "fmi2SetString");
  FIND(f.step, "fmi2DoStep");
  FIND(f.release, "fmi2FreeInstance");

  /* Paths with blanks or other special characters need %20 and the like here. */
  snprintf(path, sizeof path, "file://%s/resources", absolute);
  f.instance = instantiate(identifier, 1, guid, path, &services, 0, 0);
  if (!f.instance) die("cannot be instantiated", identifier);
  check(f.setup(f.instance, 0, 0.0, 0.0, 0, 0.0), "fmi2SetupExperiment");
  return f;
}

static void initialize(fmu *f) {
  check(f->enter(f->instance), "fmi2EnterInitializationMode");
  check(f->leave(f->instance), "fmi2ExitInitializationMode");
}

static void release(fmu *f) {
  check(f->terminate(f->instance), "fmi2Terminate");
  f->release(f->instance);
  free(f->xml);
}

enum { MEASUREMENTS = 5, PREVIEW = 41, SEEN = MEASUREMENTS + 2 * PREVIEW };

int main(int count, char **words) {
  if (count != 3) die("usage", "closed_loop UNPACKED_PLANT UNPACKED_CONTROLLER");
  fmu plant = load(words[1], "vehicle_plant"), controller = load(words[2], "lpv_mpc_controller");

  const char *road = "double_lane_change";
  const double speed = 14.0;
  unsigned parameter = reference(&plant, "road");
  check(plant.set_string(plant.instance, &parameter, 1, &road), "fmi2SetString");
  parameter = reference(&plant, "speed");
  check(plant.set_real(plant.instance, &parameter, 1, &speed), "fmi2SetReal");
  initialize(&plant);
  initialize(&controller);

  /* Equal names connect. */
  static const char *measured[MEASUREMENTS] = {"v_x", "v_y", "yaw_rate", "e_y", "e_psi"};
  unsigned from[SEEN], to[SEEN], commanded[2], commands[2];
  for (int i = 0; i < SEEN; i++) {
    char name[32];
    int ahead = i - MEASUREMENTS;
    if (i < MEASUREMENTS) snprintf(name, sizeof name, "%s", measured[i]);
    else snprintf(name, sizeof name, "%s[%d]", ahead < PREVIEW ? "kappa_ref" : "v_x_ref", ahead % PREVIEW + 1);
    from[i] = reference(&plant, name);
    to[i] = reference(&controller, name);
  }
  for (int i = 0; i < 2; i++) {
    const char *name = i ? "a_x" : "delta";
    commanded[i] = reference(&controller, name);
    commands[i] = reference(&plant, name);
  }
  unsigned e_y = reference(&plant, "e_y_true"), finished = reference(&plant, "finished");

  const double step = 0.033;
  double worst = 0.0;
  int arrived = 0;
  for (int k = 0; k < 1000 && !arrived; k++) {
    double seen[SEEN], wanted[2], error;
    /* Both outputs are read before either side steps: nobody sees the other's future. */
    check(plant.get_real(plant.instance, from, SEEN, seen), "fmi2GetReal");
    check(controller.get_real(controller.instance, commanded, 2, wanted), "fmi2GetReal");
    check(controller.set_real(controller.instance, to, SEEN, seen), "fmi2SetReal");
    check(plant.set_real(plant.instance, commands, 2, wanted), "fmi2SetReal");
    check(plant.step(plant.instance, k * step, step, 1), "fmi2DoStep");
    check(controller.step(controller.instance, k * step, step, 1), "fmi2DoStep");
    check(plant.get_real(plant.instance, &e_y, 1, &error), "fmi2GetReal");
    worst = fmax(worst, fabs(error));
    check(plant.get_boolean(plant.instance, &finished, 1, &arrived), "fmi2GetBoolean");
  }
  release(&controller);
  release(&plant);
  printf("largest lateral error %.2f cm%s\n", 100.0 * worst, arrived ? "" : ", and the end was not reached");
  return arrived && worst < 0.023 ? 0 : 1;
}
