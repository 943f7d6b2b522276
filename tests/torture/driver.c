/* An importer outside of Python: runs an FMU on a thread with a stack of 512 KiB, rolls it back, and unloads it.
 * driver LIBRARY GUID RESOURCES OUTPUT...: value references of Real outputs; the result is printed if all went well. */
#include <dlfcn.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef void *Component;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;

static int messages;

static void logger(void *environment, const char *name, int status, const char *category, const char *format, ...) {
    char text[2000];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    messages++;
    (void)environment, (void)name, (void)status, (void)category;
}

#define FAIL(...) (fprintf(stderr, __VA_ARGS__), fputc('\n', stderr), exit(2))
#define CHECK(call) do { int status_ = (call); if (status_ > 1) FAIL("%s gave %d", #call, status_); } while (0)
#define LOAD(type, name, ...) type (*name)(__VA_ARGS__) = (type (*)(__VA_ARGS__))(uintptr_t)dlsym(library, "fmi2" #name); \
    if (!name) FAIL("no fmi2" #name)

static int argc_;
static char **argv_;

static void run(int again) {
    void *library = dlopen(argv_[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) FAIL("%s", dlerror());
    LOAD(Component, Instantiate, const char *, int, const char *, const char *, const Callbacks *, int, int);
    LOAD(void, FreeInstance, Component);
    LOAD(int, SetupExperiment, Component, int, double, double, int, double);
    LOAD(int, EnterInitializationMode, Component);
    LOAD(int, ExitInitializationMode, Component);
    LOAD(int, Terminate, Component);
    LOAD(int, Reset, Component);
    LOAD(int, DoStep, Component, double, double, int);
    LOAD(int, GetReal, Component, const unsigned *, size_t, double *);
    LOAD(int, GetString, Component, const unsigned *, size_t, const char **);
    LOAD(int, GetFMUstate, Component, void **);
    LOAD(int, SetFMUstate, Component, void *);
    LOAD(int, FreeFMUstate, Component, void **);
    LOAD(int, SerializedFMUstateSize, Component, void *, size_t *);
    LOAD(int, SerializeFMUstate, Component, void *, unsigned char *, size_t);
    LOAD(int, DeSerializeFMUstate, Component, const unsigned char *, size_t, void **);

    size_t n = (size_t)(argc_ - 4);
    unsigned *references = malloc(n * sizeof *references);
    double *values = calloc(n, sizeof *values), *repeated = calloc(n, sizeof *repeated);
    for (size_t k = 0; k < n; k++) references[k] = (unsigned)strtoul(argv_[4 + k], NULL, 10);

    Callbacks callbacks = {logger, calloc, free, NULL, NULL};
    if (Instantiate("one", 1, "{wrong}", argv_[3], &callbacks, 0, 1)) FAIL("a wrong GUID was accepted");
    Component c = Instantiate("one", 1, argv_[2], argv_[3], &callbacks, 0, 1);
    if (!c) FAIL("not instantiated");
    for (int round = 0; round < 2; round++) {
        CHECK(SetupExperiment(c, 0, 0, 0, 0, 0));
        CHECK(EnterInitializationMode(c));
        CHECK(GetReal(c, references, n, values));
        CHECK(ExitInitializationMode(c));
        for (int k = 0; k < 40; k++) CHECK(DoStep(c, k * 0.01, 0.01, 1));
        void *state = NULL, *copy = NULL;
        CHECK(GetFMUstate(c, &state));
        size_t size = 0;
        CHECK(SerializedFMUstateSize(c, state, &size));
        unsigned char *bytes = malloc(size);
        CHECK(SerializeFMUstate(c, state, bytes, size));
        CHECK(DeSerializeFMUstate(c, bytes, size, &copy));
        bytes[size / 2] ^= 1;
        void *damaged = NULL;
        if (DeSerializeFMUstate(c, bytes, size, &damaged) != 3 || damaged) FAIL("damaged bytes were accepted");
        free(bytes);
        for (int k = 40; k < 60; k++) CHECK(DoStep(c, k * 0.01, 0.01, 1));
        CHECK(GetReal(c, references, n, values));
        CHECK(SetFMUstate(c, copy));
        for (int k = 40; k < 60; k++) CHECK(DoStep(c, k * 0.01, 0.01, 1));
        CHECK(GetReal(c, references, n, repeated));
        if (memcmp(values, repeated, n * sizeof *values)) FAIL("the rollback gave other values");
        CHECK(FreeFMUstate(c, &state));
        CHECK(FreeFMUstate(c, &copy));
        if (DoStep(c, 0.6, -1.0, 1) != 3) FAIL("a negative step was accepted");
        if (GetReal(c, references, n, NULL) != 3) FAIL("a NULL array was accepted");
        CHECK(Terminate(c));
        CHECK(Reset(c));
    }
    FreeInstance(c);
    if (!messages) FAIL("the logger was never called");
    if (!again) for (size_t k = 0; k < n; k++) printf("%a\n", values[k]);
    free(references), free(values), free(repeated);
    if (dlclose(library)) FAIL("%s", dlerror());
}

static void assert_unloaded(void) {
    FILE *maps = fopen("/proc/self/maps", "r");
    if (!maps) FAIL("no /proc/self/maps");
    const char *name = strrchr(argv_[1], '/') + 1;
    char line[4096];
    while (fgets(line, sizeof line, maps)) if (strstr(line, name)) FAIL("still loaded after dlclose: %s", line);
    fclose(maps);
}

static void *work(void *unused) {
    for (int again = 0; again < 3; again++) {
        run(again);
        /* On the thread that used it, which is still alive: destructors of thread-local data would keep it loaded. */
        assert_unloaded();
    }
    return unused;
}

int main(int argc, char **argv) {
    if (argc < 5) FAIL("usage: driver LIBRARY GUID RESOURCES OUTPUT...");
    argc_ = argc, argv_ = argv;
    pthread_attr_t attributes;
    pthread_t thread;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, 512 * 1024);
    if (pthread_create(&thread, &attributes, work, NULL)) FAIL("no thread");
    pthread_join(thread, NULL);
    pthread_attr_destroy(&attributes);
    return 0;
}
