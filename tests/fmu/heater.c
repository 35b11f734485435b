/* A unit of FMI 2.0 for co-simulation, written after the standard alone: a plate that a heater warms, read by a sensor
 * beside it. It takes communication steps of 10 ms, shows no state, and has parameters that are fixed while it runs.
 */
#include <stddef.h>
#include <stdlib.h>

typedef void *component;
enum { POWER = 0, READING = 1, CAPACITY = 10, LOSS = 11, COUPLING = 12, SENSOR = 13, ROOM = 14, VALUES = 15 };
enum { OK = 0, ERROR = 3 };
typedef struct { double value[VALUES]; double plate, sensor; } heater;

static void start(heater *h)
{
    h->value[POWER] = 0.0;
    h->value[CAPACITY] = 20.0; /* J/K */
    h->value[LOSS] = 0.5;      /* W/K */
    h->value[COUPLING] = 0.2;  /* W/K */
    h->value[SENSOR] = 0.4;    /* J/K */
    h->value[ROOM] = 295.0;    /* K */
}

const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(component c, int on, size_t n, const char *const names[]) { return OK; }

component fmi2Instantiate(const char *name, int type, const char *guid, const char *place, const void *callbacks,
                          int visible, int logging)
{
    heater *h = calloc(1, sizeof(heater));
    start(h);
    return h;
}

void fmi2FreeInstance(component c) { free(c); }
int fmi2SetupExperiment(component c, int tolerant, double tolerance, double begin, int ends, double end) { return OK; }
int fmi2EnterInitializationMode(component c) { return OK; }

int fmi2ExitInitializationMode(component c)
{
    heater *h = c;
    h->plate = h->sensor = h->value[ROOM];
    return (h->value[CAPACITY] > 0.0 && h->value[SENSOR] > 0.0) ? OK : ERROR;
}

int fmi2Terminate(component c) { return OK; }

int fmi2Reset(component c)
{
    start(c);
    return OK;
}

int fmi2GetReal(component c, const unsigned vr[], size_t n, double value[])
{
    heater *h = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= VALUES) {
            return ERROR;
        }
        value[k] = vr[k] == READING ? h->sensor : h->value[vr[k]];
    }
    return OK;
}

int fmi2SetReal(component c, const unsigned vr[], size_t n, const double value[])
{
    heater *h = c;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] >= VALUES) {
            return ERROR;
        }
        h->value[vr[k]] = value[k];
    }
    return OK;
}

int fmi2DoStep(component c, double at, double step, int forward)
{
    heater *h = c;
    if (step < 0.00999 || step > 0.01001) {
        return ERROR;
    }
    for (int k = 0; k < 10; k++) {
        double dt = step / 10.0, flow = h->value[COUPLING] * (h->plate - h->sensor);
        h->plate += dt * (h->value[POWER] - h->value[LOSS] * (h->plate - h->value[ROOM]) - flow) / h->value[CAPACITY];
        h->sensor += dt * flow / h->value[SENSOR];
    }
    return OK;
}

#define NONE(name) int name(void) { return ERROR; }
NONE(fmi2GetInteger) NONE(fmi2GetBoolean) NONE(fmi2GetString) NONE(fmi2SetInteger) NONE(fmi2SetBoolean)
NONE(fmi2SetString) NONE(fmi2GetFMUstate) NONE(fmi2SetFMUstate) NONE(fmi2FreeFMUstate) NONE(fmi2SerializedFMUstateSize)
NONE(fmi2SerializeFMUstate) NONE(fmi2DeSerializeFMUstate) NONE(fmi2GetDirectionalDerivative)
NONE(fmi2SetRealInputDerivatives) NONE(fmi2GetRealOutputDerivatives) NONE(fmi2CancelStep) NONE(fmi2GetStatus)
NONE(fmi2GetRealStatus) NONE(fmi2GetIntegerStatus) NONE(fmi2GetBooleanStatus) NONE(fmi2GetStringStatus)
