/* An importer for Linux and for Windows: sets inputs, steps, and notes the outputs, so that the two builds of an FMU can be compared.
 * steps LIBRARY GUID RESOURCES PLAN RESULT
 * PLAN: numbers of inputs, outputs and steps, then the value references of inputs and of outputs (32 bits each), then for every step
 * its time, its length and the inputs (64 bits each). RESULT: the outputs after every step. Both little-endian. */
#include <stdio.h>
#include <stdlib.h>
#ifdef _WIN32
#include <windows.h>
static void *open_library(const char *path) { return LoadLibraryA(path); }
static void *find(void *library, const char *name) { return (void *)(size_t)GetProcAddress(library, name); }
static void close_library(void *library) { FreeLibrary(library); }
#else
#include <dlfcn.h>
static void *open_library(const char *path) { return dlopen(path, RTLD_NOW | RTLD_LOCAL); }
static void *find(void *library, const char *name) { return dlsym(library, name); }
static void close_library(void *library) { dlclose(library); }
#endif

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static void logger(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    (void)environment, (void)name;
    fprintf(stderr, "%d %s: %s\n", status, category, format);
}

#define FAIL(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(2))
#define CHECK(call) do { int status_ = (call); if (status_ > 1) FAIL("%s gave %d", #call, status_); } while (0)
#define LOAD(type, name, ...) type (*name)(__VA_ARGS__) = (type (*)(__VA_ARGS__))(size_t)find(library, "fmi2" #name); \
    if (!name) FAIL("no fmi2" #name)

static void take(void *place, size_t size, size_t count, FILE *file) {
    if (fread(place, size, count, file) != count) FAIL("the plan ends early");
}

int main(int argc, char **argv) {
    if (argc != 6) FAIL("steps LIBRARY GUID RESOURCES PLAN RESULT");
    FILE *plan = fopen(argv[4], "rb"), *result = fopen(argv[5], "wb");
    if (!plan || !result) FAIL("%s or %s cannot be opened", argv[4], argv[5]);
    unsigned sizes[3];
    take(sizes, sizeof *sizes, 3, plan);
    unsigned inputs = sizes[0], outputs = sizes[1], steps = sizes[2];
    unsigned *references = malloc((inputs + outputs) * sizeof *references);
    double *values = malloc((2 + inputs + outputs) * sizeof *values);
    take(references, sizeof *references, inputs + outputs, plan);

    void *library = open_library(argv[1]);
    if (!library) FAIL("%s cannot be loaded", argv[1]);
    LOAD(void *, Instantiate, const char *, int, const char *, const char *, const Callbacks *, int, int);
    LOAD(void, FreeInstance, void *);
    LOAD(int, SetupExperiment, void *, int, double, double, int, double);
    LOAD(int, EnterInitializationMode, void *);
    LOAD(int, ExitInitializationMode, void *);
    LOAD(int, DoStep, void *, double, double, int);
    LOAD(int, SetReal, void *, const unsigned *, size_t, const double *);
    LOAD(int, GetReal, void *, const unsigned *, size_t, double *);
    LOAD(int, Terminate, void *);
    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    void *c = Instantiate("steps", 1, argv[2], argv[3], &callbacks, 0, 0);
    if (!c) FAIL("not instantiated");
    CHECK(SetupExperiment(c, 0, 0, 0, 0, 0));
    CHECK(EnterInitializationMode(c));
    CHECK(ExitInitializationMode(c));
    for (unsigned k = 0; k < steps; k++) {
        take(values, sizeof *values, 2 + inputs, plan);
        CHECK(SetReal(c, references, inputs, values + 2));
        CHECK(DoStep(c, values[0], values[1], 1));
        CHECK(GetReal(c, references + inputs, outputs, values));
        if (fwrite(values, sizeof *values, outputs, result) != outputs) FAIL("the result cannot be written");
    }
    CHECK(Terminate(c));
    FreeInstance(c);
    close_library(library);
    return fclose(result);
}
